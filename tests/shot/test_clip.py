import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import FormatError, ShotError
from pegbar.shot.clip import clip_text, replace_clip, write_clip
from pegbar.shot.load import load_shot

CHOICE = {
    "path": "clips/walk.bvh",
    "start": 12,
    "stop": 250,
    "azimuth": 91.5,
    "elevation": 4.0,
    "mirrored": True,
    "swapped": False,
}
DRAWING = '[drawing]\nframes = "d.####.png"\n'


def test_a_section_is_added_at_the_end():
    text = f"# top\n{DRAWING}# last\n"
    changed = replace_clip(text, CHOICE)
    assert changed.startswith(text)
    assert tomllib.loads(changed)["clip"] == CHOICE
    assert changed == f"{text}\n{clip_text(CHOICE)}"


def test_a_section_is_renewed_in_its_place_with_its_comments():
    text = (
        f"{DRAWING}\n[clip]  # mine\n# found by hand\npath = 'old # walk.bvh'   # the old one\nazimuth=5 # guess\n"
        'elevation = 1\n\n[output]\nframes = "f.####.png" # here\n'
    )
    changed = replace_clip(text, CHOICE)
    assert tomllib.loads(changed)["clip"] == CHOICE
    for kept in ("[clip]  # mine\n", "# found by hand\n", "   # the old one\n", "azimuth=91.5 # guess\n", "# here\n"):
        assert kept in changed
    assert replace_clip(changed, CHOICE) == changed
    dropped = replace_clip(changed, {"path": "x.bvh"})
    assert tomllib.loads(dropped)["clip"] == {"path": "x.bvh"}
    assert "# guess" in dropped


def test_how_the_clip_is_read_stays_where_the_clip_stays():
    text = f'{DRAWING}[clip]\npath = "clips/walk.bvh"\nfolder = "clips"\nunit = "inch"  # odd\n'
    same, other = replace_clip(text, CHOICE), replace_clip(text, {**CHOICE, "path": "clips/run.bvh"})
    assert tomllib.loads(same)["clip"] == {**CHOICE, "folder": "clips", "unit": "inch"}
    assert tomllib.loads(other)["clip"] == {**CHOICE, "folder": "clips", "path": "clips/run.bvh"}
    assert "# odd" in other


@given(st.text("ab\"\\ #'[]=\n\t\x00\x7f\x1fä日", min_size=1))
def test_any_path_survives(name):
    assert tomllib.loads(clip_text({"path": name}))["clip"]["path"] == name


def test_the_shot_file_is_written_whole_or_not_at_all(tmp_path):
    shot = tmp_path / "shot.toml"
    shot.write_text(DRAWING)
    write_clip(shot, CHOICE)
    assert load_shot(shot).clip.model_dump(exclude_unset=True) == CHOICE
    good = shot.read_text()
    with pytest.raises(ShotError, match=r"shot\.toml:8: clip\.stop|want a frame after start"):
        write_clip(shot, {**CHOICE, "stop": 3})
    assert shot.read_text() == good
    shot.write_text(f"clip = {{path = 'a.bvh'}}\n{DRAWING}")
    with pytest.raises(FormatError, match="otherwise than as a .clip. section"):
        write_clip(shot, CHOICE)
    with pytest.raises(FileNotFoundError):
        write_clip(tmp_path / "none.toml", CHOICE)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("start = -1", "clip.start"),
        ("azimuth = nan", "clip.azimuth"),
        ("elevation = 91", "clip.elevation"),
        ("pfad = 1", "no such key"),
        ("frame_rate = 0", "clip.frame_rate"),
        ("start = 5\nstop = 5", "want a frame after start"),
    ],
)
def test_wrong_clips_are_refused(tmp_path, line, said):
    shot = tmp_path / "shot.toml"
    shot.write_text(f'{DRAWING}[clip]\npath = "a.bvh"\n{line}\n')
    with pytest.raises(ShotError, match=said):
        load_shot(shot)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("[shot]\nframe_rate = 24   # film\n", "[shot]\nframe_rate = 12   # film\n"),
        ("[shot]\n# frame_rate = 24   # left open\nname = 'a'\n", "[shot]\nframe_rate = 12\nname = 'a'\n"),
        ("[shot]\nname = 'a'\n", "[shot]\nframe_rate = 12\nname = 'a'\n"),
        ("", "[shot]\nframe_rate = 12\n\n"),
        # Another section's rate is not the shot's.
        ("[shot]\n[lift]\nframe_rate = 60\n", "[shot]\nframe_rate = 12\n[lift]\nframe_rate = 60\n"),
    ],
)
def test_the_frame_rate_is_written_where_it_belongs(tmp_path, before, after):
    path = tmp_path / "shot.toml"
    path.write_text(before + DRAWING)
    write_clip(path, CHOICE, frame_rate=12.0)
    assert path.read_text() == f"{after}{DRAWING}\n{clip_text(CHOICE)}"
    assert load_shot(path).shot.frame_rate == 12


def test_without_a_frame_rate_the_shots_own_stays(tmp_path):
    path = tmp_path / "shot.toml"
    path.write_text("[shot]\nframe_rate = 24\n" + DRAWING)
    write_clip(path, CHOICE)
    assert load_shot(path).shot.frame_rate == 24
