"""`pegbar effects`: the list comes from the presets, and every picture shows its effect."""

from __future__ import annotations

import dataclasses
import tomllib

import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.io.frames import read_image, read_picture
from pegbar.report.contact_sheet import over_paper
from pegbar.sample.shot import write_sample
from pegbar.simulate.presets import PRESETS, check_preset, preset_elements
from tests.walkers import walker


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """The sample shot, 6 small frames."""
    return write_sample(tmp_path_factory.mktemp("effects"), size=(240, 136), frames=6, samples=1)


def test_all_presets_are_listed_with_what_they_make(capsys):
    assert main(["effects"]) == 0
    out = capsys.readouterr().out
    heads = [line.split()[0] for line in out.splitlines() if line and line[0].isalpha() and not line.startswith("All")]
    assert heads == list(PRESETS)
    assert 'pompoms      A pom-pom in each hand\n             hands "both", size 0.24, count 250' in out


@pytest.mark.parametrize("name", PRESETS)
def test_all_settings_are_shown_as_a_shot_file_takes_them(name, capsys):
    assert main(["effects", name]) == 0
    out = capsys.readouterr().out
    lines = [line for line in out.splitlines() if " = " in line and not line.startswith("elements")]
    assert [line.split()[0] for line in lines] == [field.name for field in dataclasses.fields(PRESETS[name])]
    settings = tomllib.loads("\n".join(line for line in lines if "(from the" not in line))
    check_preset(name, settings)
    figure = walker(4)
    plain, same = (preset_elements(name, figure, ground=0.0, **given) for given in ({}, settings))
    assert [element.name for element in plain] == [element.name for element in same]
    assert np.allclose(plain[0].look.color, same[0].look.color, atol=0.01)
    assert f'elements = [{{ preset = "{name}" }}]' in out


def test_the_gallery_has_a_picture_of_each(shot, tmp_path, capsys):
    folder = tmp_path / "gallery"
    for name in ("balloon", "balls"):
        assert main(["effects", name, "--gallery", str(folder), "--shot", str(shot), "--width", "120"]) == 0
    assert "effects: 1 pictures in" in capsys.readouterr().out
    assert sorted(path.name for path in folder.iterdir()) == ["balloon.png", "balls.png"]
    drawing = over_paper(read_picture(shot.parent / "drawings/dancer.0003.png"))[::2, ::2]
    for name in ("balloon", "balls"):
        picture = read_image(folder / f"{name}.png")
        assert picture.shape == (68, 120, 3)
        assert (np.abs(picture.astype(int) - drawing).max(axis=2) > 90).sum() > 40
    # Nothing of the shot's own elements is made.
    assert not (shot.parent / "secondary/cache").exists()


def test_an_effect_that_the_shot_cannot_have_is_told_and_the_others_are_made(shot, tmp_path, capsys):
    text = shot.read_text()
    bare = shot.with_name("bare.toml")
    bare.write_text(text.replace("[secondary]\n", '[secondary]\nground = "none"\n'))
    assert main(["effects", "balls", "--gallery", str(tmp_path / "g"), "--shot", str(bare)]) == 1
    error = capsys.readouterr().err
    assert "pegbar: balls: balls: want a ground for them to lie on" in error
    assert not (tmp_path / "g/balls.png").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["kilt"], "no preset 'kilt': there are scarves"),
        (["--shot", "shot.toml"], "--shot and --frame want --gallery DIR"),
        (["balls", "--gallery", "{tmp}", "--width", "3"], "--width: want 16 or more, got 3"),
        (["balls", "--gallery", "{tmp}", "--shot", "{shot}", "--frame", "7"], "frame: want 1 to 6, got 7"),
        (["balls", "--gallery", "{tmp}", "--shot", "nowhere.toml"], "nowhere.toml"),
    ],
)
def test_wrong_use_is_told(shot, tmp_path, capsys, arguments, words):
    filled = [argument.format(tmp=tmp_path / "g", shot=shot) for argument in arguments]
    assert main(["effects", *filled]) == 2
    assert words in capsys.readouterr().err
