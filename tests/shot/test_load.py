import pytest

from pegbar import FormatError, ShotError
from pegbar.shot.load import key_lines, load_shot

GOOD = """\
[shot]
frames = "1-4"
size = [96, 128]

[drawing]
frames = "d.####.png"
hold = 2

[drawing.palette]
"#8A4B2A" = "head"

[passes]
beauty = "b.####.exr"
unit = "cm"
"""


def load(tmp_path, text):
    path = tmp_path / "shot.toml"
    path.write_text(text, encoding="utf-8")
    return load_shot(path)


def test_a_good_shot_is_read_with_its_defaults(tmp_path):
    shot = load(tmp_path, GOOD)
    assert (shot.shot.size, shot.drawing.hold, shot.drawing.matte) == ((96, 128), 2, "auto")
    assert shot.drawing.palette == {"#8a4b2a": "head"}
    assert shot.passes.metres == 0.01
    assert shot.output.frames == "final/final.####.png"


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("frame_rat = 24", 'shot.frame_rat: no such key (did you mean "frame_rate"?)'),
        ("frame_rate = 0", "shot.frame_rate: input should be greater than 0, got 0"),
        ("frame_rate = nan", "shot.frame_rate: input should be a finite number, got nan"),
        ("size = [0, 5]", "shot.size.0: input should be greater than 0, got 0"),
        ("size = [4]", "shot.size.1: is missing"),
        ("name = 3", "shot.name: input should be a valid string, got 3"),
    ],
)
def test_a_wrong_line_is_named(tmp_path, line, problem):
    text = GOOD.replace("size = [96, 128]", line)
    with pytest.raises(ShotError) as caught:
        load(tmp_path, text)
    assert caught.value.problems == [f"{tmp_path / 'shot.toml'}:3: {problem}"]


def test_all_problems_come_at_once(tmp_path):
    text = (
        GOOD.replace("hold = 2", 'hold = "twos"\nmat = "ink"')
        .replace("#8A4B2A", "#8A4B")
        .replace("[passes]", "[pases]")
    )
    with pytest.raises(ShotError) as caught:
        load(tmp_path, text)
    found = sorted(int(problem.split(":")[1]) for problem in caught.value.problems)
    assert found == [7, 8, 11, 13]


@pytest.mark.parametrize(("text", "line"), [("[shot\n", 1), ("[shot]\nname = \n", 2), ('a = 1\nb = "x\n', 2)])
def test_text_that_is_not_toml_is_named_with_its_line(tmp_path, text, line):
    with pytest.raises(FormatError, match="not TOML") as caught:
        load(tmp_path, text)
    assert caught.value.line == line


def test_bytes_that_are_no_text_and_folders_are_refused(tmp_path):
    (tmp_path / "shot.toml").write_bytes(b"[shot]\nname = '\xff'")
    with pytest.raises(FormatError, match="byte 15: not UTF-8"):
        load_shot(tmp_path / "shot.toml")
    with pytest.raises(FormatError, match="a folder"):
        load_shot(tmp_path)
    with pytest.raises(FileNotFoundError):
        load_shot(tmp_path / "none.toml")


def test_linear_light_is_only_written_to_exr(tmp_path):
    with pytest.raises(ShotError, match="output.*linear light"):
        load(tmp_path, GOOD + '[output]\nspace = "linear"\n')
    assert load(tmp_path, GOOD + '[output]\nframes = "f.####.exr"\n').output.composite_space == "linear"


def test_keys_are_found_in_sections_dotted_and_quoted():
    text = 'a.b = 1\n[ x . "y z" ]\n# c = 3\n"q r" = 2\n[[t]]\nk=1'
    lines = key_lines(text)
    assert lines[("a", "b")] == 1
    assert lines[("x", "y z", "q r")] == 4
    assert lines[("t", "k")] == 6
