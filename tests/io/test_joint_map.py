import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import FormatError, read_joint_map, write_joint_map
from pegbar.scene.body import MARKERS
from pegbar.scene.joints import EXTRA

names = st.text(st.characters(exclude_categories=("Cs",)), min_size=1, max_size=12)


@given(st.dictionaries(st.sampled_from((*MARKERS, *EXTRA)), names))
def test_a_map_comes_back(tmp_path_factory, joint_map):
    file = tmp_path_factory.getbasetemp() / "map.toml"
    write_joint_map(file, joint_map)
    assert read_joint_map(file, set(joint_map.values())) == joint_map


def test_what_is_missing_stands_there_as_a_comment(tmp_path):
    file = tmp_path / "map.toml"
    write_joint_map(file, {"pelvis": "Hips", "left_toe": "LeftToe"}, derived=["head", "neck"])
    lines = file.read_text().splitlines()
    assert 'pelvis = "Hips"' in lines
    assert 'left_toe = "LeftToe"' in lines
    assert '# chest = ""' in lines
    assert "# head is the middle of several points" in lines
    assert not any(line.startswith("# right_toe") for line in lines)
    assert len([line for line in lines if line.startswith("# ") and '= ""' in line]) == 13 + 1  # the heading shows one


@pytest.mark.parametrize(
    ("text", "line", "problem"),
    [
        ('pelvis = "Hips"\nhaed = "Head"', 2, r"no marker is called 'haed' \(did you mean 'head'\?\)"),
        ('\n# head\nhead = "Had"', 3, r"head: the clip has no joint 'Had' \(did you mean 'Head'\?\)"),
        ("head = 3", 1, "head: want a joint's name in quotes, got 3"),
        ('pelvis = "Hips"\n[head]\nx = 1', 2, "head: want a joint's name in quotes"),
        ('pelvis = "Hips"\nhead = Head', 2, "not TOML: "),
        ('pelvis = "Hips"\npelvis = "Head"', 2, "not TOML: "),
        ('"head" = "Tail"', 1, "head: the clip has no joint 'Tail'"),
    ],
)
def test_mistakes_come_with_their_line(text, line, problem, tmp_path):
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(FormatError, match=problem) as raised:
        read_joint_map(tmp_path / "map.toml", ["Hips", "Head"])
    assert raised.value.line == line
    assert str(raised.value).startswith(f"{tmp_path / 'map.toml'}:{line}: ")


def test_other_bytes_and_no_file(tmp_path):
    (tmp_path / "map.toml").write_bytes(b'head = "\xff"')
    with pytest.raises(FormatError, match="at byte 8: not UTF-8"):
        read_joint_map(tmp_path / "map.toml")
    with pytest.raises(FileNotFoundError):
        read_joint_map(tmp_path / "none.toml")


def test_an_empty_name_takes_a_joint_away_and_names_are_checked_only_if_known(tmp_path):
    (tmp_path / "map.toml").write_text('head = ""\nneck = "anything"')
    assert read_joint_map(tmp_path / "map.toml") == {"head": "", "neck": "anything"}
