import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pegbar import map_joints
from pegbar.scene.conventions import (
    UNITS,
    guess_unit,
    inserted_pose,
    is_standing,
    is_t_pose,
    person_height,
    up_axis,
    up_rotation,
)
from tests.skeletons import person

AXES = ["x", "y", "z", "-x", "-y", "-z"]


def markers(turn=None, scale=1.0):
    names, parents, rest = person()
    matrix = np.eye(3) if turn is None else turn
    return {m: scale * matrix @ rest[names.index(joint)] for m, joint in map_joints(names, parents, rest=rest).items()}


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("laboratory", [False, True])
def test_the_up_axis_is_found_and_turned_to_y(axis, laboratory):
    turn = up_rotation(axis, laboratory=laboratory)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1)
    axes = dict(zip(AXES, np.concatenate([np.eye(3), -np.eye(3)]), strict=True))
    assert (turn @ axes[axis]).tolist() == [0, 1, 0]
    # A person that stands along that axis.
    assert up_axis(markers(turn.T)) == (axis, 1.0)


def test_z_up_keeps_cmus_order_in_a_laboratory_and_blenders_front():
    assert (up_rotation("z", laboratory=True) @ [1, 2, 3]).tolist() == [2, 3, 1]
    assert (up_rotation("z") @ [0, -1, 0]).tolist() == [0, 0, 1]
    with pytest.raises(ValueError, match="^up: want one of y, z, x"):
        up_rotation("w")


def test_the_up_axis_is_what_most_frames_say():
    seen = {name: np.tile(place, (10, 1)) for name, place in markers().items()}
    lying = up_rotation("z").T
    for name in seen:
        seen[name][:3] = seen[name][:3] @ lying.T
    assert up_axis(seen) == ("y", 0.7)
    seen["head"][9] = np.nan
    assert up_axis(seen) == ("y", pytest.approx(6 / 9))
    assert up_axis({"head": np.zeros(3)}) is None
    assert up_axis({name: np.full((2, 3), np.nan) for name in seen}) is None


@given(st.floats(1e-3, 1e3), st.integers(0, 99))
def test_height_is_the_chains_and_scales(scale, seed):
    turn = Rotation.random(random_state=seed).as_matrix()
    names, _, rest = person()
    links = [
        ("left ankle", "left knee"), ("left knee", "left hip"), ("chest", "neck"), ("neck", "head")
    ]  # fmt: skip
    chain = sum(np.linalg.norm(rest[names.index(a)] - rest[names.index(b)]) for a, b in links)
    chain += np.linalg.norm(rest[names.index("chest")] - (0, 0.9, 0))
    assert person_height(markers(turn, scale)) == pytest.approx(scale * chain / 0.84)
    top = scale * turn @ (rest[names.index("head")] + (0, 0.2, 0))
    assert person_height(markers(turn, scale), top) == pytest.approx(scale * (chain + 0.2) / 0.96)
    # A helper on the head's joint, or above the ceiling, is no skull.
    for far in (0.0, 2.0):
        top = scale * turn @ (rest[names.index("head")] + (0, far, 0))
        assert person_height(markers(turn, scale), top) == pytest.approx(scale * chain / 0.84)


def test_height_needs_a_person_and_bears_bent_knees_and_gaps():
    seen = markers()
    assert person_height({name: place for name, place in seen.items() if name != "neck"}) is None
    one = {name: place for name, place in seen.items() if name != "left_knee"}
    assert person_height(one) == pytest.approx(person_height(seen))
    many = {name: np.stack([place, place, np.full(3, np.nan)]) for name, place in seen.items()}
    assert person_height(many) == pytest.approx(person_height(seen))
    bent = Rotation.from_euler("x", 100, degrees=True)
    for side in ("left", "right"):
        seen[f"{side}_foot"] = seen[f"{side}_knee"] + bent.apply(seen[f"{side}_foot"] - seen[f"{side}_knee"])
    assert person_height(seen) == pytest.approx(person_height(markers()))


@given(st.sampled_from(sorted(UNITS)), st.floats(1.36, 2.04))
def test_every_known_unit_is_told_by_a_persons_height(name, height):
    assert guess_unit(height / UNITS[name]) == (name, UNITS[name])


@pytest.mark.parametrize("height", [38.5, 46, 0.8, 1e-3, 1e6])
def test_other_sizes_are_scaled(height):
    name, unit = guess_unit(height)
    assert name == ""
    assert height * unit == pytest.approx(1.7)


def clip(first, frames=40, speed=0.01):
    """A person whose arms hang and swing, behind one frame of ``first`` (elbow turns in degrees, or None)."""
    names, parents, rest = person()
    joints = map_joints(names, parents, rest=rest)
    positions, rotations = [], []
    for frame in range(frames):
        turns = np.tile(np.eye(3), (len(names), 1, 1))
        down = 80 + 40 * np.sin(frame * speed * 6)
        if first is not None and frame == 0:
            down = first
        for side, sign in (("left", -1), ("right", 1)):
            for joint in ("shoulder", "elbow", "wrist", "finger"):
                turns[names.index(f"{side} {joint}")] = Rotation.from_euler("z", sign * down, degrees=True).as_matrix()
        places = np.zeros((len(names), 3))
        for joint, parent in enumerate(parents):
            offset = rest[joint] - (rest[parent] if parent >= 0 else 0)
            places[joint] = (
                turns[parent] @ offset + places[parent] if parent >= 0 else offset + np.array([0, 0, frame * 0.01])
            )
        positions.append(places)
        rotations.append(turns)
    stack = np.stack(positions)
    return {name: stack[:, names.index(joint)] for name, joint in joints.items()}, stack, np.stack(rotations)


@pytest.mark.parametrize("step", [1, 3])
def test_an_inserted_pose_is_found_first_or_last(step):
    seen, positions, rotations = clip(0.0)
    assert inserted_pose({n: p[::step] for n, p in seen.items()}, positions[::step], rotations[::step]) == 0
    back = {name: points[::-1] for name, points in seen.items()}
    assert inserted_pose(back, positions[::-1], rotations[::-1]) == len(positions) - 1


def test_what_is_no_inserted_pose():
    # A jump to another pose than a T.
    assert inserted_pose(*clip(10 + 90.0)) is None
    # No jump.
    assert inserted_pose(*clip(None)) is None
    # A T-pose that the movement begins with, as slowly as it goes on.
    still, positions, rotations = clip(0.0, frames=5)
    assert inserted_pose({n: p[1:4] for n, p in still.items()}, positions[1:4], rotations[1:4]) is None
    names, _, rest = person()
    one = np.tile(rest, (9, 1, 1))
    assert inserted_pose({}, one, np.broadcast_to(np.eye(3), (9, len(names), 3, 3))) is None


def test_an_unturned_pose_counts_without_arms_and_names():
    _, positions, rotations = clip(0.0)
    assert inserted_pose({}, positions, rotations) == 0
    assert inserted_pose({}, *clip(30.0)[1:]) is None


def test_t_poses():
    assert is_t_pose(markers())
    assert is_t_pose(markers(Rotation.from_euler("xyz", [30, 50, 70], degrees=True).as_matrix()))
    hanging = markers()
    for side, sign in (("left", -1), ("right", 1)):
        down = Rotation.from_euler("z", sign * 60, degrees=True)
        shoulder = hanging[f"{side}_shoulder"]
        for joint in ("elbow", "hand"):
            hanging[f"{side}_{joint}"] = shoulder + down.apply(hanging[f"{side}_{joint}"] - shoulder)
    assert not is_t_pose(hanging)
    crossed = markers() | {"left_elbow": markers()["left_shoulder"] * [-1, 1, 1]}
    assert not is_t_pose(crossed)
    assert not is_t_pose(markers() | {"left_foot": markers()["left_knee"] + [0, 0, 0.4]})
    assert not is_t_pose({"head": np.zeros(3)})


def test_bones_laid_end_to_end_do_not_stand():
    assert is_standing(markers())
    flat = {name: np.array([index * 0.3, 0, 0]) for index, name in enumerate(["hip", "knee", "foot"])}
    assert not is_standing(
        {f"{side}_{n}": p for n, p in flat.items() for side in ("left", "right")} | {"head": np.ones(3)}
    )
    assert not is_standing({})
