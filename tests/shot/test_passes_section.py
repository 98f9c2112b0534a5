"""Where passes are, written into a shot file: the old lines are kept, the rest is untouched."""

import tomllib

import pytest

from pegbar import FormatError, ShotError
from pegbar.shot.passes_section import passes_text, replace_passes, write_passes
from tests.shots import make_shot

NEW = passes_text("imported/p.####.exr")


@pytest.mark.parametrize(
    "text",
    [
        '[drawing]\nframes = "d"\n',
        '[drawing]\nframes = "d"\n\n[passes]\nbeauty = "old"\nunit = "cm" # feet\n',
        '[passes]\nbeauty = "old"\ndepth = "z"\n\n# what comes next\n[output]\nframes = "f.####.png"  # here\n',
        '[passes]\n[output]\nframes = "f.####.png"',
    ],
)
def test_only_the_section_changes(text):
    changed = replace_passes(text, NEW)
    before, after = tomllib.loads(text), tomllib.loads(changed)
    assert after.pop("passes") == {"beauty": "imported/p.####.exr"}
    before.pop("passes", None)
    assert after == before
    assert all(line.strip() in changed for line in text.splitlines())
    assert replace_passes(changed, NEW) == changed


def test_a_shot_file_is_written_and_its_folder_counts(tmp_path):
    shot = make_shot(tmp_path / "shot", 2)
    assert write_passes(shot, tmp_path / "render/p.####.exr") == '[passes]\nbeauty = "../render/p.####.exr"\n'
    assert tomllib.loads(shot.read_text())["passes"] == {"beauty": "../render/p.####.exr"}
    assert '# before: beauty = "p.####.exr"' in shot.read_text()


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ('passes = { beauty = "x" }\n[drawing]\nframes = "d"\n', FormatError),
        ('[drawing]\nframe = "d"\n', ShotError),
        ("[drawing\n", FormatError),
    ],
)
def test_what_cannot_be_changed_stays_as_it_is(tmp_path, text, error):
    shot = tmp_path / "shot.toml"
    shot.write_text(text)
    with pytest.raises(error):
        write_passes(shot, tmp_path / "p.####.exr")
    assert shot.read_text() == text
