"""`pegbar export` on a small sample shot: what it writes, what it refuses, and that it writes all or nothing."""

import json
import sys

import numpy as np
import pygltflib
import pytest

from pegbar.cli.main import main
from pegbar.sample.shot import write_sample

pxr = pytest.importorskip("pxr")
from pxr import Usd, UsdGeom  # noqa: E402


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """The sample shot, 4 small frames, without a [secondary] section and on twos."""
    shot = write_sample(tmp_path_factory.mktemp("export"), size=(240, 136), frames=4, samples=1)
    text = shot.read_text().replace('\n[secondary]\nelements = ["scarves", "skirt", "balls"]\n', "")
    shot.write_text(text.replace('frames = "1-4"', 'frames = "1-9"').replace("[drawing]\n", "[drawing]\nhold = 2\n"))
    assert main(["export", str(shot)]) == 0
    return shot


def test_every_format_holds_the_film(sample, capsys):
    folder = sample.parent / "export"
    table = json.loads((folder / "shot.json").read_text())
    assert table["frames"] == [*range(1, 10)]
    assert table["drawings"] == [1, 1, 2, 2, 3, 3, 4, 4, None]
    assert (folder / table["pictures"][2]).resolve() == sample.parent / "drawings/dancer.0002.png"
    assert table["pictures"][8] is None
    markers = table["characters"][0]["markers"]
    assert markers["left_hand"][0] == markers["left_hand"][1] != markers["left_hand"][2]
    assert markers["left_hand"][8] is None
    arrays = np.load(folder / "shot.npz")
    assert arrays["camera_matrix"].tolist() == table["camera"]["matrix"]
    stage = Usd.Stage.Open(str(folder / "shot.usdc"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1, 9)
    hand = UsdGeom.Xformable(stage.GetPrimAtPath("/shot/characters/sample/markers/left_hand"))
    assert list(hand.ComputeLocalToWorldTransform(3).ExtractTranslation()) == markers["left_hand"][2]
    glb = pygltflib.GLTF2.load(str(folder / "shot.glb"))
    assert "sample.limb.torso" in [node.name for node in glb.nodes]
    compile((folder / "open_in_blender.py").read_text(), "open_in_blender.py", "exec")
    assert not [path.name for path in folder.iterdir() if ".part" in path.name]


def test_it_says_which_frames_have_no_drawing(sample, capsys):
    assert main(["export", str(sample), "--formats", "npz", "-o", str(sample.parent / "again")]) == 0
    said = capsys.readouterr()
    assert "1 of 9 frames show no drawing with marks" in said.err
    written = {path.name for path in (sample.parent / "again").glob("shot*.*")}
    assert written == {"shot.json", "shot.npz"}


def test_without_usd_the_others_are_written_and_it_says_how_to_install_it(sample, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pxr", None)
    folder = sample.parent / "without"
    assert main(["export", str(sample), "-o", str(folder)]) == 0
    assert 'pip install "pegbar[usd]"' in capsys.readouterr().err
    assert {"shot.glb", "shot.npz"} <= {path.name for path in folder.iterdir()}
    assert main(["export", str(sample), "-o", str(folder), "--formats", "usd,npz"]) == 1
    assert main(["export", str(sample), "-o", str(folder / "none"), "--formats", "usd"]) == 2
    assert 'pip install "pegbar[usd]"' in capsys.readouterr().err
    assert not (folder / "none").exists()


def test_two_characters_are_seen_by_the_first_ones_camera(sample, tmp_path):
    other = write_sample(tmp_path / "other", size=(240, 136), frames=4, samples=1)
    other.write_text(other.read_text().replace('name = "sample"', 'name = "second"'))
    both = sample.parent / "both.toml"
    section = f'\n[secondary]\nelements = ["balls"]\ncharacters = ["{other.as_posix()}"]\n'
    both.write_text(sample.read_text() + section)
    folder = tmp_path / "out"
    assert main(["export", str(both), "-o", str(folder), "--formats", "usd,npz"]) == 0
    arrays = np.load(folder / "shot.npz")
    assert arrays["characters"].tolist() == ["sample", "second"]
    # Drawn on ones, the second one shows its fourth drawing when the first one, on twos, shows its second.
    marks = json.loads((other.parent / "annotation.json").read_text())
    names = arrays["character_2_marker_names"].tolist()
    place = arrays["camera_matrix"][3] @ [*arrays["character_2_markers"][3, names.index("pelvis")], 1]
    drawn = marks["frames"][3]["xy"][marks["markers"].index("pelvis")]
    np.testing.assert_allclose(place[:2] / place[2], drawn, atol=1e-6)
    stage = Usd.Stage.Open(str(folder / "shot.usdc"))
    assert stage.GetPrimAtPath("/shot/characters/second/capsules/torso")


@pytest.mark.parametrize(
    ("formats", "said"), [("obj", "no format obj"), ("usd,fbx", "no format fbx"), (",", "at least one")]
)
def test_unknown_formats_are_named(sample, formats, said, capsys):
    assert main(["export", str(sample), "--formats", formats]) == 2
    assert said in capsys.readouterr().err


def test_what_cannot_be_written_leaves_what_is_there(sample, monkeypatch, capsys):
    folder = sample.parent / "export"
    before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    monkeypatch.setattr("pegbar.shot.export_stage.shot_glb", lambda scene: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["export", str(sample)])
    assert {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before
