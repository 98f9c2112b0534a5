import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pegbar import Motion
from pegbar.io.bvh import write_bvh


def read(path):
    """World positions and rotations by joint name, by the file's own words: offsets, channels, forward kinematics."""
    head, _, body = path.read_text().partition("MOTION\n")
    words = iter(head.split()[1:])
    joints, stack, ends = [], [], {}
    for word in words:
        if word in ("ROOT", "JOINT"):
            joints.append({"name": next(words), "parent": stack[-1] if stack else None})
        elif word == "End":
            assert next(words) == "Site"
            joints.append(None)
        elif word == "{":
            stack.append(len(joints) - 1 if joints[-1] else None)
            if not joints[-1]:
                joints.pop()
        elif word == "}":
            stack.pop()
        elif word == "OFFSET":
            offset = np.array([float(next(words)) for _ in range(3)])
            if stack[-1] is None:
                ends[joints[stack[-2]]["name"]] = offset
            else:
                joints[stack[-1]]["offset"] = offset
        elif word == "CHANNELS":
            joints[stack[-1]]["channels"] = [next(words) for _ in range(int(next(words)))]
    lines = body.splitlines()
    rows = np.array([line.split() for line in lines[2:]], float)
    assert lines[0] == f"Frames: {len(rows)}"
    positions, rotations, place = [], [], 0
    for joint in joints:
        values = rows[:, place : place + len(joint["channels"])]
        place += len(joint["channels"])
        shift, turn = np.tile(joint["offset"], (len(rows), 1)), Rotation.identity(len(rows))
        for channel, column in zip(joint["channels"], values.T, strict=True):
            axis = "XYZ".index(channel[0])
            if channel.endswith("position"):
                shift[:, axis] = column
            else:
                turn = turn * Rotation.from_rotvec(np.eye(3)[axis] * column[:, None], degrees=True)
        if joint["parent"] is not None:
            parent = joint["parent"]
            shift, turn = positions[parent] + rotations[parent].apply(shift), rotations[parent] * turn
        positions.append(shift)
        rotations.append(turn)
    assert place == rows.shape[1]
    names = [joint["name"] for joint in joints]
    return {
        "names": names,
        "positions": dict(zip(names, positions, strict=True)),
        "rotations": {name: turn.as_matrix() for name, turn in zip(names, rotations, strict=True)},
        "channels": {joint["name"]: len(joint["channels"]) for joint in joints},
        "rate": 1 / float(lines[1].split()[2]),
        "ends": ends,
    }


def motion(seed, joints=6, frames=4, *, stretch=False, upright=False):
    """A tree of joints in random order of parents, turning at random; with ``stretch`` its bones change length."""
    random = np.random.default_rng(seed)
    parents = [-1, *(int(random.integers(joint)) for joint in range(1, joints))]
    order = random.permutation(joints)
    rank = np.argsort(order)
    turns = Rotation.random(frames * joints, random_state=seed)
    if upright:
        turns = Rotation.from_euler("ZXY", [[30.0 * i, 90 if i % 2 else -90, 20] for i in range(frames * joints)], True)
    rotations = turns.as_matrix().reshape(frames, joints, 3, 3)
    bones = np.repeat(random.normal(size=(1, joints, 3)), frames, axis=0)
    if stretch:
        bones[:, 1:] *= random.uniform(0.5, 2, (frames, joints - 1, 1))
    positions = random.normal(size=(frames, joints, 3))
    for joint in range(1, joints):
        parent = parents[joint]
        positions[:, joint] = positions[:, parent] + np.einsum("fij,fj->fi", rotations[:, parent], bones[:, joint])
    return Motion(
        tuple(f"joint {joint}" for joint in order),
        tuple(-1 if parents[joint] < 0 else int(rank[parents[joint]]) for joint in order),
        positions[:, order],
        rotations[:, order],
        float(random.choice([24, 29.97, 120])),
    )


@given(st.integers(0, 999), st.sampled_from([("cm", 0.01), ("m", 1), ("mm", 0.001), ("inch", 0.0254), (0.5, 0.5)]))
def test_a_motion_comes_back_from_the_file(tmp_path_factory, seed, unit):
    file = tmp_path_factory.getbasetemp() / "clip.bvh"
    clip = motion(seed, upright=seed % 5 == 0)
    write_bvh(file, clip, unit=unit[0])
    got = read(file)
    assert sorted(got["names"]) == sorted(name.replace(" ", "_") for name in clip.names)
    assert got["rate"] == pytest.approx(clip.frame_rate, rel=1e-6)
    for joint, name in enumerate(clip.names):
        name = name.replace(" ", "_")
        np.testing.assert_allclose(got["positions"][name] * unit[1], clip.positions[:, joint], atol=3e-6)
        np.testing.assert_allclose(got["rotations"][name], clip.rotations[:, joint], atol=1e-6)
        assert got["channels"][name] == (6 if clip.parents[joint] < 0 else 3)
    leaves = {clip.names[joint].replace(" ", "_") for joint in range(6) if joint not in clip.parents}
    assert set(got["ends"]) == leaves


def test_squash_and_stretch_is_kept_where_it_happens(tmp_path):
    clip = motion(5, stretch=True)
    write_bvh(tmp_path / "a.bvh", clip, stretch=True)
    got = read(tmp_path / "a.bvh")
    assert set(got["channels"].values()) == {6}
    for joint, name in enumerate(clip.names):
        np.testing.assert_allclose(got["positions"][name.replace(" ", "_")] / 100, clip.positions[:, joint], atol=1e-6)
    write_bvh(tmp_path / "a.bvh", motion(5), stretch=True)
    assert sorted(read(tmp_path / "a.bvh")["channels"].values()) == [3] * 5 + [6]
    # Without it bones keep the length they have in the first frame.
    write_bvh(tmp_path / "a.bvh", clip)
    got = read(tmp_path / "a.bvh")
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            names = [clip.names[i].replace(" ", "_") for i in (joint, parent)]
            lengths = np.linalg.norm(got["positions"][names[0]] - got["positions"][names[1]], axis=1)
            first = np.linalg.norm(clip.positions[0, joint] - clip.positions[0, parent])
            np.testing.assert_allclose(lengths / 100, first, atol=1e-6)


def test_angles_do_not_jump_by_whole_turns(tmp_path):
    angles = np.linspace(0, 720, 49)
    turning = Rotation.from_rotvec(np.eye(3)[2] * angles[:, None], degrees=True).as_matrix()[:, None]
    write_bvh(tmp_path / "a.bvh", Motion(("hips",), (-1,), np.zeros((49, 1, 3)), turning, 24))
    rows = [line.split() for line in (tmp_path / "a.bvh").read_text().splitlines()[-49:]]
    np.testing.assert_allclose(np.array(rows, float)[:, 3], angles, atol=1e-4)


def test_end_sites_may_be_given(tmp_path):
    clip = motion(1, joints=2)
    leaf = clip.names[clip.parents.index(clip.parents.index(-1))]
    write_bvh(tmp_path / "a.bvh", clip, offsets={leaf: [0.1, 0.2, 0.3]})
    assert read(tmp_path / "a.bvh")["ends"][leaf.replace(" ", "_")].tolist() == [10, 20, 30]


STILL = {"names": ("a", "b"), "parents": (-1, 0), "frame_rate": 24.0}


@pytest.mark.parametrize(
    ("changes", "options", "problem"),
    [
        ({"parents": (-1, -1)}, {}, "motion: want one joint without a parent, got 2"),
        ({"parents": (1, 0)}, {}, "motion: want one joint without a parent, got 0"),
        ({"parents": (-1, 1)}, {}, "motion: its parents run in a circle"),
        ({"parents": (-1, 2)}, {}, "motion.parents: want values in -1..1, got 2"),
        ({"names": ("a", "a")}, {}, "motion: two joints"),
        ({"frame_rate": 0}, {}, "motion: want a frame rate"),
        ({"positions": np.full((3, 2, 3), np.nan)}, {}, "motion.positions: want finite"),
        ({"rotations": np.zeros((2, 2, 3, 3))}, {}, r"motion.rotations: want shape \(3, 2, 3, 3\)"),
        (
            {"positions": np.zeros((0, 2, 3)), "rotations": np.zeros((0, 2, 3, 3))},
            {},
            "motion: want at least one frame",
        ),
        ({}, {"unit": "cubit"}, "unit: "),
        ({}, {"unit": -1}, "unit: "),
        ({}, {"offsets": {"c": [0, 0, 0]}}, "offsets: no joints are called"),
    ],
)
def test_what_cannot_be_written_is_named(changes, options, problem, tmp_path):
    still = STILL | {"positions": np.zeros((3, 2, 3)), "rotations": np.zeros((3, 2, 3, 3)) + np.eye(3)}
    with pytest.raises(ValueError, match=f"^{problem}"):
        write_bvh(tmp_path / "a.bvh", Motion(**(still | changes)), **options)
    assert list(tmp_path.iterdir()) == []
