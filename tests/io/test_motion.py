import csv
import re

import numpy as np
import pytest

from pegbar import FormatError, map_joints, read_motion, write_joint_map
from pegbar.io.bvh import write_bvh
from pegbar.sample.dancer import dance
from pegbar.scene.body import MARKERS
from pegbar.scene.conventions import UNITS, up_rotation
from tests.clips import bvh
from tests.conftest import DATA
from tests.skeletons import SCHEMES, person

#: Clips in which the person walks or runs ahead, by what INDEX.csv says of them.
AHEAD = re.compile(r"\b(walk|run|jog|jump, |forward jump)", re.IGNORECASE)


def index(folder):
    """Rows of INDEX.csv for clips, by file."""
    with (folder / "INDEX.csv").open(encoding="utf-8") as file:
        rows = {row["file"]: row for row in csv.DictReader(file)}
    return {name: row for name, row in rows.items() if name.startswith("mocap/") and not name.endswith(".asf")}


CLIPS = sorted(index(DATA)) if (DATA / "INDEX.csv").is_file() else []
_read = {}


@pytest.fixture
def clip(request, test_data):
    """A clip of the shared data and its row in the index."""
    return once(test_data, request.param)


def once(folder, name):
    """A clip and its row in the index, read once for all tests."""
    if name not in _read:
        _read[name] = read_motion(folder / name), index(folder)[name]
    return _read[name]


def places(motion, *markers):
    """Markers without an inserted T-pose, and without frames in which any of them is missing."""
    got = np.delete(motion.markers(markers), [] if motion.rest_frame is None else [motion.rest_frame], axis=0)
    return got[np.isfinite(got).all(axis=(1, 2))].transpose(1, 0, 2)


every = pytest.mark.parametrize("clip", CLIPS, indirect=True)


@every
def test_every_frame_is_kept_at_its_rate(clip):
    motion, row = clip
    assert len(motion.positions) == int(row["frames"])
    assert motion.frame_rate == pytest.approx(float(row["fps"]), rel=1e-4)
    assert motion.report.rate_from == ("assumed" if row["file"].endswith(".amc") else "the file")


@every
def test_all_canonical_markers_are_found(clip):
    motion, _ = clip
    assert motion.report.missing == ()
    assert set(MARKERS) <= set(motion.known_markers)
    got = motion.markers(MARKERS)
    assert got.shape == (len(motion.positions), 16, 3)
    assert np.isfinite(got).all(axis=(0, 2)).sum() >= (16 if motion.rest is not None else 8)
    assert not any("exchanged" in note for note in motion.report.notes)


@every
def test_up_is_found(clip):
    motion, row = clip
    assert motion.report.up == ("z" if re.search("z up", row["units"], re.IGNORECASE) else "y")
    chest, left, right = places(motion, "chest", "left_foot", "right_foot")
    # A jump or a sneak bends, but no one stands on the head.
    assert np.median(chest[:, 1] - (left + right)[:, 1] / 2) > 0.7


@every
def test_units_make_a_person(clip):
    motion, row = clip
    assert 1.4 < motion.report.height < 2.0
    known = {"5.644 cm": "cmu", "mm, Z": "mm", "m, Z": "m"}
    name = next(
        (unit for words, unit in known.items() if row["units"].startswith(words) or words in row["units"]), None
    )
    if name is None:
        assert motion.report.unit_from == "scaled to a height of 1.7 m"
    else:
        assert motion.report.unit == pytest.approx(UNITS[name], rel=1e-3)


@every
def test_an_inserted_t_pose_is_found_where_the_index_says(clip):
    motion, row = clip
    assert motion.rest_frame == (0 if "frame 0 is an inserted T-pose" in row["anomalies"] else None)


@every
def test_left_is_left(clip):
    """To the left of where the toes point, whoever's name says so."""
    motion, _ = clip
    for joint in ("hip", "shoulder"):
        left, right, *feet = places(
            motion, f"left_{joint}", f"right_{joint}", "left_foot", "left_toe", "right_foot", "right_toe"
        )
        ahead = (feet[1] - feet[0]) + (feet[3] - feet[2])
        across = np.cross([0, 1, 0], ahead)
        assert np.median(((left - right) * across).sum(axis=1)) > 0.01


@every
def test_people_go_where_they_face(clip):
    motion, row = clip
    if AHEAD.search(row["description"]) and motion.report.travel > 1 and "sideways" not in row["description"]:
        assert motion.report.way == "forwards", row["description"]
    assert -0.06 < motion.report.floor < 0.1


def test_the_clip_at_a_doubtful_rate_is_named(test_data):
    notes = {name: " ".join(once(test_data, name)[0].report.notes) for name in CLIPS}
    doubtful = [name for name in CLIPS if "frame rate may" in notes[name]]
    assert doubtful == ["mocap/bvh/cmu_141_16.bvh"]


def test_amc_and_bvh_of_one_walk_agree(test_data):
    bvh_clip = once(test_data, "mocap/bvh/cmu_02_01.bvh")[0]
    amc = once(test_data, "mocap/asfamc/02_01.amc")[0]
    joints = ["pelvis", "left_hip", "left_knee", "left_foot", "right_hip", "right_knee", "right_foot"]
    np.testing.assert_allclose(amc.markers(joints), bvh_clip.markers(joints)[1:], atol=1e-4 * UNITS["cmu"])


def test_amc_and_c3d_of_one_dance_agree(test_data):
    amc = once(test_data, "mocap/asfamc/05_13.amc")[0]
    c3d = once(test_data, "mocap/c3d/cmu_05_13.c3d")[0]
    apart = np.linalg.norm(amc.markers(MARKERS) - c3d.markers(MARKERS), axis=2)
    means = dict(zip(MARKERS, np.nanmean(apart, axis=0), strict=True))
    assert means["pelvis"] < 0.0135
    assert max(means["left_hip"], means["right_hip"]) < 0.02
    # From markers on the skin and the skull: within a hand's breadth of the skeleton's joints.
    assert max(means.values()) < 0.13, means


@pytest.mark.parametrize("name", UNITS)
@pytest.mark.parametrize("axis", ["y", "z", "-x"])
def test_unit_and_axis_are_found_and_may_be_given(name, axis, tmp_path):
    file = tmp_path / "a.bvh"
    file.write_text(bvh(unit=UNITS[name], turn=up_rotation(axis).T))
    motion = read_motion(file)
    assert (motion.report.up, motion.report.up_from) == (axis, "the pose")
    assert motion.report.unit == UNITS[name]
    assert motion.report.unit_from == f"a person's height: {name}"
    assert 1.6 < motion.report.height < 1.8
    names, _, places = person()
    rest = places[[names.index(name.replace("_", " ")) for name in motion.names]]
    np.testing.assert_allclose(motion.positions[0], rest, atol=2e-5)
    np.testing.assert_allclose(motion.rest, rest - rest[0], atol=2e-5)
    np.testing.assert_allclose(motion.rotations, np.broadcast_to(np.eye(3), motion.rotations.shape), atol=1e-12)
    assert motion.markers(["left_foot"])[0, 0] == pytest.approx(places[names.index("left ankle")], abs=2e-5)
    assert (motion.report.travel, motion.report.way) == (pytest.approx(2, abs=1e-4), "forwards")
    assert motion.report.facing == (pytest.approx(0, abs=1e-3), pytest.approx(0, abs=1e-3))
    for given in (name, UNITS[name]):
        same = read_motion(file, unit=given, up=axis, frame_rate=24)
        np.testing.assert_array_equal(same.positions, motion.positions)
        assert (same.report.up_from, same.report.rate_from, same.frame_rate) == ("given", "given", 24)
    twice = read_motion(file, unit=2 * UNITS[name])
    np.testing.assert_allclose(twice.positions, 2 * motion.positions)
    assert twice.report.notes[-1] == f"the person would be {2 * motion.report.height:.2f} m tall: the unit may be wrong"


def test_rotations_take_the_files_axes_to_the_worlds(tmp_path):
    """Bones stay what they are: a child's place is its parent's turned offset, also where the file's Z is up."""
    text = bvh(turn=up_rotation("z").T).replace(" 0 0 0\n", " 30 0 0\n")
    (tmp_path / "a.bvh").write_text(text)
    motion = read_motion(tmp_path / "a.bvh")
    for joint, parent in enumerate(motion.parents):
        if parent >= 0:
            offset = motion.rest[joint] - motion.rest[parent]
            want = motion.positions[:, parent] + motion.rotations[:, parent] @ offset
            np.testing.assert_allclose(motion.positions[:, joint], want, atol=1e-9)
    assert np.abs(motion.rotations - np.eye(3)).max() > 0.1
    assert motion.ends["head"].tolist() == pytest.approx([0, 0.18, 0])


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_few_frames_are_enough(frames, tmp_path):
    (tmp_path / "a.bvh").write_text(bvh(np.linspace([0, 0.95, 0], [0, 0.95, 1], frames)))
    motion = read_motion(tmp_path / "a.bvh", up="Y")
    assert len(motion.positions) == frames
    assert motion.rest_frame is None
    assert motion.report.floor == pytest.approx(0.02)
    assert motion.report.travel == pytest.approx(0.0 if frames == 1 else 1.0)


def test_a_skeleton_without_offsets_is_measured_in_its_frames(tmp_path):
    """Position channels on every joint, all offsets 0, names that mean nothing."""
    names, parents, rest = person()
    order, lines = [], ["HIERARCHY"]

    def joint(index):
        order.append(index)
        kind = "ROOT" if parents[index] < 0 else "JOINT"
        lines.append(f"{kind} j{index} {{ OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition")
        children = [child for child, parent in enumerate(parents) if parent == index]
        for child in children:
            joint(child)
        lines.append("}" if children else "End Site { OFFSET 0 0 0 } }")

    joint(0)
    local = [rest[i] - (rest[parents[i]] if parents[i] >= 0 else 0) for i in order]
    row = " ".join(f"{100 * value:.3f}" for value in np.ravel(local))
    lines += ["MOTION", "Frames: 5", "Frame Time: 0.04", *[row] * 5]
    (tmp_path / "a.bvh").write_text("\n".join(lines) + "\n")
    motion = read_motion(tmp_path / "a.bvh")
    assert motion.report.unit_from == "a person's height: cm"
    assert motion.report.missing == ()
    assert motion.joint_map["left_knee"] == f"j{names.index('left knee')}"


def test_a_head_down_axis_that_is_given_is_doubted(tmp_path):
    (tmp_path / "a.bvh").write_text(bvh())
    motion = read_motion(tmp_path / "a.bvh", up="-y")
    assert motion.report.notes[0] == "the head is along y from the feet, though -y is up"
    assert motion.positions[0, motion.names.index("head"), 1] < 0


def test_someone_who_lies_does_not_turn_the_world(tmp_path):
    """The skeleton at rest stands along Y; the root's rotation lays it down in every frame."""
    text = bvh().replace(
        "CHANNELS 3 Xposition Yposition Zposition",
        "CHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation",
    )
    head, _, body = text.partition("Frame Time: ")
    rows = body.splitlines()
    rows[1:] = [" ".join([*row.split()[:3], "90 0 0", *row.split()[3:]]) for row in rows[1:]]
    (tmp_path / "a.bvh").write_text(head + "Frame Time: " + "\n".join(rows) + "\n")
    report = read_motion(tmp_path / "a.bvh").report
    assert report.up == "y"
    assert "lying or turned: at rest y is up, in the frames z" in report.notes


def test_exchanged_sides_are_noticed(tmp_path):
    def mirrored(name):
        side, _, joint = name.partition(" ")
        return {"left": "right_", "right": "left_"}.get(side, name) + joint

    (tmp_path / "a.bvh").write_text(bvh(rename=mirrored))
    report = read_motion(tmp_path / "a.bvh").report
    assert any("left and right may be exchanged" in note for note in report.notes)
    assert report.way == "backwards"


def test_names_that_mean_nothing_are_told_by_shape(tmp_path):
    names, _, _ = person()
    (tmp_path / "a.bvh").write_text(
        bvh(rename=lambda name: f"j{names.index(name)}", unit=0.01, turn=up_rotation("z").T)
    )
    motion = read_motion(tmp_path / "a.bvh")
    assert motion.report.missing == ()
    assert (motion.report.unit, motion.report.up, motion.report.way) == (0.01, "z", "forwards")
    assert motion.joint_map["left_knee"] == f"j{names.index('left knee')}"


def test_what_is_no_person_is_left_as_it_is(tmp_path):
    (tmp_path / "a.bvh").write_text(
        "HIERARCHY\nROOT ball { OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition End Site { OFFSET 0 1 0 } }\n"
        "MOTION\nFrames: 1\nFrame Time: 0.04\n1 2 3\n"
    )
    motion = read_motion(tmp_path / "a.bvh")
    assert motion.positions.tolist() == [[[1, 2, 3]]]
    report = motion.report
    assert (report.unit, report.unit_from) == (1, "assumed: no person to measure")
    assert (report.up, report.up_from, report.height, report.floor, report.facing) == ("y", "assumed", None, None, None)
    assert report.missing == MARKERS
    assert motion.rest_frame is None


def test_joints_may_be_given_by_dict_and_by_file(tmp_path):
    file = tmp_path / "a.bvh"
    file.write_text(bvh())
    found = read_motion(file)
    assert found.joint_map["head"] == "head"
    given = read_motion(file, joints={"left_hand": "left_finger", "chest": ""})
    assert given.joint_map == {
        m: j for m, j in (found.joint_map | {"left_hand": "left_finger"}).items() if m != "chest"
    }
    assert given.report.missing == ("chest",)
    assert "not found: chest" in given.report.notes
    write_joint_map(tmp_path / "map.toml", given.joint_map)
    text = (tmp_path / "map.toml").read_text().replace('# chest = ""', 'chest = ""')
    (tmp_path / "map.toml").write_text(text)
    again = read_motion(file, joints=tmp_path / "map.toml")
    assert again.joint_map == given.joint_map


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"unit": "cubit"}, "unit: want metres above 0 or one of m, cm, mm, inch, foot, cmu, got 'cubit'"),
        ({"unit": 0}, "unit: want metres"),
        ({"unit": float("nan")}, "unit: want metres"),
        ({"up": "w"}, "up: want one of"),
        ({"frame_rate": 0}, "frame_rate: want frames a second above 0, got 0"),
        ({"frame_rate": float("inf")}, "frame_rate: want"),
        ({"joints": {"nose": "head"}}, "joints: no marker is called 'nose'"),
        ({"joints": {"left_hnd": "head"}}, r"joints: no marker is called 'left_hnd' \(did you mean 'left_hand'\?\)"),
        ({"joints": {"head": "heed"}}, r"joints: head: the clip has no joint 'heed' \(did you mean 'head'\?\)"),
        ({"joints": {"head": 3}}, "joints: head: want a joint's name in quotes, got 3"),
    ],
)
def test_wrong_options_are_named(options, problem, tmp_path):
    (tmp_path / "a.bvh").write_text(bvh())
    with pytest.raises(ValueError, match=f"^{problem}"):
        read_motion(tmp_path / "a.bvh", **options)


def test_a_wrong_line_of_a_joint_map_is_named(tmp_path):
    (tmp_path / "a.bvh").write_text(bvh())
    (tmp_path / "map.toml").write_text('pelvis = "hips"\n\nhead = "heed"\n')
    with pytest.raises(FormatError, match=r"map\.toml:3: head: the clip has no joint 'heed'"):
        read_motion(tmp_path / "a.bvh", joints=tmp_path / "map.toml")


def test_the_sample_clip_comes_back(tmp_path):
    """Names that are the canonical markers' own: positions are the joints', in whatever unit they were written."""
    clip = dance().clip
    write_bvh(tmp_path / "a.bvh", clip, unit="inch")
    motion = read_motion(tmp_path / "a.bvh")
    np.testing.assert_allclose(motion.markers(clip.names), clip.positions, atol=1e-6)
    np.testing.assert_allclose(motion.markers(MARKERS), clip.markers(MARKERS), atol=1e-6)
    report = motion.report
    assert (report.unit, report.up, motion.rest_frame, report.way) == (UNITS["inch"], "y", None, "on the spot")
    assert report.floor == pytest.approx(0.02, abs=0.005)  # the toes' joints are 2 cm above the floor
    assert report.notes == ()


def test_schemes_and_files_agree(test_data):
    """The names typed for the tests are those of the files."""
    for scheme, name in {"cmu": "bvh/cmu_07_01.bvh", "cmu, 3ds Max naming": "bvh/cmu_131_01_max.bvh"}.items():
        motion = once(test_data, f"mocap/{name}")[0]
        assert sorted(motion.names) == sorted(SCHEMES[scheme][0].split())
        assert motion.joint_map == map_joints(SCHEMES[scheme][0].split())
