import csv
import dataclasses
import json

import cv2
import numpy as np
import pygltflib
import pytest

from pegbar import read_motion
from pegbar.cli.main import main
from pegbar.io.alignment import read_alignment
from pegbar.io.bvh import write_bvh
from pegbar.sample.shot import write_sample
from pegbar.scene.body import MARKERS, bones_between
from pegbar.shot import lift_stage
from tests.export.test_gltf import Played
from tests.motions import OFFSETS, PARENTS, swaying

LEG = (("hip", "knee"), ("knee", "foot"))


def rest_of(offsets):
    """Places (J, 3) of the joints of `swaying` when none is turned."""
    rest = np.array(offsets, float)
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            rest[joint] += rest[parent]
    return rest


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The sample shot, 24 small frames, lifted on twos."""
    shot = write_sample(tmp_path_factory.mktemp("lifted"), size=(240, 136), frames=24, samples=1)
    shot.write_text(shot.read_text() + '\n[lift]\nformats = ["bvh", "glb", "usd", "csv", "npz"]\n')
    assert main(["lift", str(shot)]) == 0
    return shot


def test_the_markers_are_the_drawn_ones_and_near_the_truth(made):
    folder = made.parent
    held, truth = np.load(folder / "lift/markers.npz"), np.load(folder / "truth.npz")
    alignment = read_alignment(folder / "align/alignment.npz")
    names = held["names"].tolist()
    for frame, camera in enumerate(alignment.cameras):
        known = [alignment.names.index(name) for name in names]
        np.testing.assert_allclose(camera.project(held["markers"][frame]), alignment.markers[frame, known], atol=1e-6)
    true = truth["drawn"][:, [truth["names"].tolist().index(name) for name in names]]
    found = held["markers"]
    root = names.index("pelvis")
    away = (found - found[:, [root]]) - (true - true[:, [root]])
    assert np.sqrt(np.mean(np.sum(away**2, axis=2))) < 0.06


def test_the_skeleton_comes_onto_the_markers_and_reads_back(made):
    folder = made.parent / "lift"
    held, film = np.load(folder / "markers.npz"), read_motion(folder / "animation.bvh")
    assert len(film.positions) == 24
    assert film.frame_rate == pytest.approx(24)
    posed = film.markers(held["names"].tolist())
    assert np.sqrt(np.mean(np.sum((posed - held["markers"]) ** 2, axis=2))) < 0.06
    bones = np.linalg.norm(posed[:, 1] - posed[:, 0], axis=1)
    np.testing.assert_allclose(bones, bones[0], rtol=1e-3)
    document = pygltflib.GLTF2().load(str(folder / "animation.glb"))
    assert {node.name for node in document.nodes} >= {"pelvis", "left_knee"}
    report = json.loads((folder / "report.json").read_text())
    assert report["marker_reprojection_px"] < 1e-6
    assert 0 < report["skeleton_reprojection_px"] < 5
    rows = list(csv.DictReader((folder / "markers.csv").read_text().splitlines()))
    assert len(rows) == 24 * len(held["names"])
    assert float(rows[0]["y"]) == pytest.approx(held["markers"][0, 0, 1], abs=1e-5)


def test_nothing_is_done_twice(made, capsys):
    before = (made.parent / "lift/animation.bvh").stat().st_mtime_ns
    assert main(["lift", str(made)]) == 0
    assert "up to date" in capsys.readouterr().out
    assert (made.parent / "lift/animation.bvh").stat().st_mtime_ns == before


@pytest.fixture
def again(made, monkeypatch):
    """Lift the shot again with other lines in its [lift] section, without a sheet; returns the results' folder."""
    monkeypatch.setattr(lift_stage, "lift_sheet", lambda *_: np.zeros((2, 2, 3), np.uint8))
    text = made.read_text()

    def lift(lines, code=0):
        head, _ = text.split("[lift]")
        made.write_text(f'{head}[lift]\noutput = "other"\npreview = "none"\n{lines}\n')
        assert main(["lift", str(made)]) == code
        return made.parent / "other"

    yield lift
    made.write_text(text)


def markers_of(folder):
    held = np.load(folder / "markers.npz")
    return held["names"].tolist(), held["markers"], held


def test_depth_from_lengths_and_flips_are_passed_on(again, capsys):
    flip = 'depth = "lengths"\nformats = ["npz"]\nflips = [{{ joint = "{}", drawings = "{}" }}]'
    _, markers, held = markers_of(again(flip.format("left_hand", "3-5")))
    ends = held["bones"]
    lengths = np.linalg.norm(markers[:, ends[:, 1]] - markers[:, ends[:, 0]], axis=2)
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], lengths.shape), rtol=1e-6)
    again(flip.format("wing", "3-5"), 2)
    assert "wing" in capsys.readouterr().err
    again(flip.format("left_hand", "99"), 2)
    assert "no drawing 99 with marks, only 1-24" in capsys.readouterr().err


def test_lengths_are_taken_as_given(again, capsys):
    names, markers, _ = markers_of(again('depth = "lengths"\nformats = ["npz"]\nlengths = { left_hand = 0.31 }'))
    forearm = markers[:, names.index("left_hand")] - markers[:, names.index("left_elbow")]
    np.testing.assert_allclose(np.linalg.norm(forearm, axis=1), 0.31, atol=1e-6)
    again("lengths = { left_hand = 0.31 }", 2)
    assert 'only depth = "lengths" takes lengths' in capsys.readouterr().err
    again('depth = "lengths"\nlengths = { pelvis = 0.31 }', 2)
    assert "'pelvis' hangs on no other marker" in capsys.readouterr().err


def test_a_limb_is_turned_by_hand_at_the_clips_depth_too(made, again):
    names, plain, _ = markers_of(made.parent / "lift")
    _, turned, _ = markers_of(again('formats = ["npz"]\nflips = [{ joint = "left_hand", drawings = "3-5" }]'))
    hand = names.index("left_hand")
    moved = np.linalg.norm(turned - plain, axis=2)
    assert moved[2:5, hand].min() > 0.005
    assert np.delete(moved, [hand, names.index("left_finger")], axis=1).max() < 1e-9
    assert moved[[1, 5]].max() < 1e-9


def test_a_held_hand_stays_and_the_skeletons_too(again, capsys):
    folder = again('formats = ["npz", "bvh"]\nheld = [{ joint = "left_hand", drawings = "8-12" }]')
    names, markers, _ = markers_of(folder)
    held = markers[7:12, names.index("left_hand")]
    np.testing.assert_allclose(held, np.tile(held[0], (5, 1)), atol=1e-9)
    posed = read_motion(folder / "animation.bvh").markers(["left_hand"])[7:12, 0]
    np.testing.assert_allclose(posed, held, atol=1e-3)
    place = [0.3, 1.2, 0.4]
    folder = again(f'formats = ["npz"]\nheld = [{{ joint = "left_hand", drawings = "8-9", at = {place} }}]')
    np.testing.assert_allclose(markers_of(folder)[1][7:9, names.index("left_hand")], [place] * 2)
    again('held = [{ joint = "tail", drawings = "8" }]', 2)
    assert "lift.held: 'tail' is not marked" in capsys.readouterr().err


def test_standing_feet_are_edited_and_do_not_slide(again, capsys):
    folder = again('formats = ["npz", "bvh"]\n[lift.planted]\nleft_foot = "4-9"')
    names, _, held = markers_of(folder)
    assert np.flatnonzero(held["planted"].any(axis=0)).tolist() == [names.index("left_foot")]
    assert np.flatnonzero(held["planted"][:, names.index("left_foot")]).tolist() == list(range(3, 9))
    feet = read_motion(folder / "animation.bvh").markers(["left_foot"])[3:9, 0]
    assert np.linalg.norm(feet - feet[0], axis=1).max() < 1e-4
    report = json.loads((folder / "report.json").read_text())
    assert report["standing"] == {"left_foot": ["4-9"]}
    assert report["foot_slide_worst_m"] < 1e-6
    assert not markers_of(again('formats = ["npz"]\nplanted = false'))[2]["planted"].any()
    again('planted = { tail = "1" }', 2)
    assert "tail" in capsys.readouterr().err


def test_another_skeleton_is_posed_at_its_own_size(made, again, capsys):
    rig = swaying(1)
    offsets = 0.5 * OFFSETS
    empty = rig.changed(positions=np.array([rest_of(offsets)]), rotations=np.tile(np.eye(3), (1, 7, 1, 1)))
    write_bvh(made.parent / "rig.bvh", empty, unit="m")
    folder = again('formats = ["bvh", "npz"]\nskeleton = "rig.bvh"')
    posed = read_motion(folder / "animation.bvh", unit="cm")
    assert posed.names == rig.names
    thigh = np.linalg.norm(posed.positions[:, 4] - posed.positions[:, 3], axis=1)
    report = json.loads((folder / "report.json").read_text())
    shin = np.linalg.norm(posed.positions[:, 5] - posed.positions[:, 4], axis=1)
    np.testing.assert_allclose(shin / thigh, np.linalg.norm(OFFSETS[5]) / np.linalg.norm(OFFSETS[4]), rtol=1e-3)
    names, markers, _ = markers_of(folder)
    legs = [markers[:, names.index(f"left_{b}")] - markers[:, names.index(f"left_{a}")] for a, b in LEG]
    drawn = sum(np.median(np.linalg.norm(leg, axis=1)) for leg in legs)
    assert (thigh + shin)[0] == pytest.approx(report["skeleton_size"] * drawn, rel=0.05)
    knee = posed.positions[:, 4] - posed.positions[:, 3]
    cosine = np.sum(knee * legs[0], axis=1) / np.linalg.norm(knee, axis=1) / np.linalg.norm(legs[0], axis=1)
    assert np.degrees(np.arccos(np.median(cosine))) < 15
    fitted = again('formats = ["bvh"]\nskeleton = "rig.bvh"\nproportions = "drawing"')
    closer = json.loads((fitted / "report.json").read_text())
    assert closer["skeleton_to_markers_m"] < report["skeleton_to_markers_m"]
    again('skeleton = "no.bvh"', 2)
    assert "no.bvh" in capsys.readouterr().err


def test_every_format_shows_the_same_animation(again):
    pxr = pytest.importorskip("pxr")
    lines = 'formats = ["bvh", "glb", "usd", "csv", "npz"]\nframe_rate = 30\ninterpolation = "linear"\nloop = true'
    folder = again(lines)
    bvh = read_motion(folder / "animation.bvh")
    assert bvh.frame_rate == pytest.approx(30)
    assert len(bvh.positions) == 31
    np.testing.assert_allclose(bvh.positions[-1], bvh.positions[0], atol=1e-4)
    stage = pxr.Usd.Stage.Open(str(folder / "animation.usda"))
    cache, root = pxr.UsdSkel.Cache(), pxr.UsdSkel.Root(stage.GetDefaultPrim())
    cache.Populate(root, pxr.Usd.TraverseInstanceProxies())
    query = cache.GetSkelQuery(pxr.UsdSkel.Skeleton.Get(stage, "/figure/skeleton"))
    data = (folder / "animation.glb").read_bytes()
    for frame in (0, 7, 30):
        played = Played(data, frame)
        matrices = np.array([np.array(matrix) for matrix in query.ComputeJointSkelTransforms(frame)])
        for joint, name in enumerate(bvh.names):
            np.testing.assert_allclose(played.joint(name)[:3, 3], bvh.positions[frame, joint], atol=1e-4)
            np.testing.assert_allclose(matrices[joint, 3, :3], bvh.positions[frame, joint], atol=1e-4)
    rows = list(csv.DictReader((folder / "markers.csv").read_text().splitlines()))
    names, _, held = markers_of(folder)
    assert len(rows) == 31 * len(names)
    assert (rows[-1]["frame"], rows[-1]["drawing"], rows[-1]["seconds"]) == ("31", "1", "1.0")
    table = np.array([[float(row[axis]) for axis in "xyz"] for row in rows]).reshape(31, len(names), 3)
    np.testing.assert_allclose(table, held["frame_markers"], atol=1e-6)
    pybvh = pytest.importorskip("pybvh")
    peer = pybvh.read_bvh_file(str(folder / "animation.bvh"))
    known = [node.name for node in peer.nodes if not node.is_end_site()]
    places = peer.node_positions()[:, [not node.is_end_site() for node in peer.nodes]] / 100
    order = [known.index(name) for name in bvh.names]
    np.testing.assert_allclose(places[:, order], bvh.positions, atol=1e-4)


def test_squash_and_stretch_is_kept_as_lengths_of_bones(again):
    folder = again('formats = ["bvh", "npz"]\nstretch = true\nplanted = false')
    names, markers, held = markers_of(folder)
    posed = read_motion(folder / "animation.bvh").markers(["left_knee", "left_foot"])
    known = [names.index("left_knee"), names.index("left_foot")]
    np.testing.assert_allclose(posed, markers[:, known], atol=1e-4)
    joint = held["joints"].tolist().index("left_foot")
    lengths = np.linalg.norm(posed[:, 1] - posed[:, 0], axis=1)
    np.testing.assert_allclose(held["bone_scales"][:, joint], lengths / np.median(lengths), atol=1e-3)
    assert np.ptp(held["bone_scales"][:, joint]) > 0.01


def shot_with(made, clip, output):
    """The same shot with another [clip], in a file of its own."""
    shot = made.parent / f"{output}.toml"
    text = made.read_text().replace('path = "clip.bvh"', clip).split("[lift]")[0]
    align = f'[align]\noutput = "{output}/align"\nmode = "static"\nfield_of_view = 40\n'
    shot.write_text(f'{text}[lift]\noutput = "{output}"\npreview = "none"\n{align}')
    return shot


@pytest.mark.parametrize(
    ("change", "code", "said"),
    [
        (lambda clip: clip.slice(0, 1), 2, "one.bvh: too short"),
        (lambda clip: still(clip), 0, "the clip stands still"),
    ],
    ids=["one frame", "all poses equal"],
)
def test_a_clip_that_says_too_little_is_named(made, again, capsys, change, code, said):
    folder = made.parent
    write_bvh(folder / "one.bvh", change(read_motion(folder / "clip.bvh")))
    other = shot_with(made, 'path = "one.bvh"', "bad")
    assert main(["lift", str(other)]) == code
    assert said in capsys.readouterr().err
    if code == 0:
        assert np.isfinite(read_motion(folder / "bad/animation.bvh").positions).all()


def test_a_joint_that_the_clip_lacks_is_said_and_left_out(made, again, capsys):
    folder = made.parent
    clip = read_motion(folder / "clip.bvh")
    write_bvh(
        folder / "bald.bvh", dataclasses.replace(clip, names=tuple(name.replace("head", "x") for name in clip.names))
    )
    (folder / "joints.toml").write_text('head = ""\n')
    other = shot_with(made, 'path = "bald.bvh"\njoints = "joints.toml"', "lack")
    code = main(["lift", str(other)])
    errors = capsys.readouterr().err
    assert code == 0, errors
    assert "the clip has no joint for head: left out" in errors
    assert "head" not in np.load(folder / "lack/markers.npz")["names"].tolist()
    (folder / "joints.toml").write_text('left_elbow = ""\n')
    assert main(["lift", str(other)]) == 2
    assert "bald.bvh: no left_elbow, without which it cannot be compared" in capsys.readouterr().err


def still(clip):
    """As many frames, all the first."""
    frames = len(clip.positions)
    return clip.changed(positions=clip.positions[:1].repeat(frames, 0), rotations=clip.rotations[:1].repeat(frames, 0))


def test_one_frame_a_drawing_and_a_preview(made, again):
    folder = again('formats = ["bvh"]\nframe_rate = "drawings"')
    assert len(read_motion(folder / "animation.bvh").positions) == 24
    with (made.parent / "lift/preview.gif").open("rb") as file:
        assert file.read(4) == b"GIF8"
    good, animation = cv2.imreadanimation(str(made.parent / "lift/preview.gif"))
    assert good
    assert len(animation.frames) == 24
    assert np.abs(animation.frames[0].astype(int) - animation.frames[12]).max() > 50


def test_bones_skip_markers_that_are_not_there():
    assert len(bones_between(MARKERS)) == len(MARKERS) - 1
    assert bones_between(("pelvis", "head", "left_foot")) == ((0, 1), (0, 2))
    assert bones_between(("left_hand", "left_elbow")) == ((1, 0),)
