import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar.scene.gait import facing, floor_height, hurried, travel

RATE = 60.0


def hips(azimuths):
    """Hips of a person that faces these azimuths in degrees."""
    turn = np.radians(np.asarray(azimuths, float))
    left = np.stack([np.cos(turn), np.zeros(len(turn)), -np.sin(turn)], axis=1) * 0.1
    return {"left_hip": left, "right_hip": -left}


@given(st.lists(st.floats(-170, 170), min_size=1, max_size=20))
def test_facing_is_square_to_the_hips_and_counts_whole_turns(steps):
    azimuths = np.cumsum(steps)
    got = facing(hips(azimuths))
    np.testing.assert_allclose(got - got[0], azimuths - azimuths[0], atol=1e-9)
    assert (got[0] - azimuths[0]) % 360 == pytest.approx(0, abs=1e-9) or (got[0] - azimuths[0]) % 360 > 359.99


def test_facing_follows_the_worlds_axes_and_bears_gaps():
    assert facing(hips([0]))[0] == pytest.approx(0)  # left is +X, so ahead is +Z
    assert facing(hips([90]))[0] == pytest.approx(90)
    seen = hips([10, 20, 30])
    seen["left_hip"][1] = np.nan
    np.testing.assert_allclose(facing(seen), [10, np.nan, 30])
    assert facing({"left_hip": seen["left_hip"]}) is None


@pytest.mark.parametrize(
    ("azimuth", "step", "direction"),
    [(0, (0, 1), 0), (90, (0, 1), -90), (-90, (0, 1), 90), (180, (0, 1), 180), (45, (1, 1), 0), (0, (1, 1), 45)],
)
def test_travel_is_seen_from_the_person(azimuth, step, direction):
    x, z = step
    pelvis = np.linspace(0, 1, 50)[:, None] * [x, 0, z]
    distance, got = travel(pelvis, facing(hips([azimuth] * 50)))
    assert distance == pytest.approx(np.hypot(x, z))
    assert (got - direction + 180) % 360 - 180 == pytest.approx(0, abs=1e-6)


def test_on_the_spot_there_is_no_direction():
    sway = 0.05 * np.sin(np.linspace(0, 30, 200))[:, None] * [1, 0, 1]
    assert travel(sway, np.zeros(200))[1] is None
    assert travel(np.full((5, 3), np.nan), np.zeros(5)) == (0.0, None)
    assert travel(np.zeros((1, 3)), np.zeros(1)) == (0.0, None)


def walk(floor, frames=240, toes=True):
    """Feet that stand for half of each second and swing 15 cm high for the other half."""
    time = np.arange(frames) / RATE
    feet = {}
    for side, shift in (("left", 0), ("right", 0.5)):
        phase = (time + shift) % 1
        swing = np.clip((phase - 0.5) * 2, 0, 1)
        place = np.stack([np.zeros(frames), floor + 0.15 * np.sin(np.pi * swing), np.floor(time + shift) + swing], 1)
        feet[f"{side}_foot"] = place + np.array([0, 0.08, -0.1])
        if toes:
            feet[f"{side}_toe"] = place
    return feet


@pytest.mark.parametrize("floor", [-0.05, 0.0, 0.04, 1.3])
def test_the_floor_is_where_feet_stand(floor):
    assert floor_height(walk(floor), RATE, 1.7) == pytest.approx(floor, abs=0.005)
    assert floor_height(walk(floor, toes=False), RATE, 2.0) == pytest.approx(floor, abs=0.005)


def test_the_floor_bears_gaps_jumps_and_a_foot_through_it():
    feet = walk(0.0)
    feet["left_toe"][:100] = np.nan
    assert floor_height(feet, RATE, 1.7) == pytest.approx(0, abs=0.01)
    # A few frames of a flight do not lift it, a few frames below do not lower it.
    feet = {name: points + [0, 0.5, 0] * (np.arange(240) > 180)[:, None] for name, points in walk(0.0).items()}
    feet["right_toe"][50] = [0, -0.2, 0]
    assert floor_height(feet, RATE, 1.7) == pytest.approx(0, abs=0.01)
    assert floor_height({}, RATE, 1.7) is None
    assert floor_height({"left_toe": np.full((4, 3), np.nan)}, RATE, 1.7) is None
    assert floor_height({"left_toe": np.array([[0, 0.3, 0.0]])}, RATE, 1.7) == pytest.approx(0.3)


@pytest.mark.parametrize(("waves", "told"), [(2.4, False), (4.8, True)])
def test_a_wave_at_twice_its_rate_is_told(waves, told):
    time = np.arange(240) / RATE
    hand = 0.15 * np.sin(2 * np.pi * waves * time)[:, None] * [1, 0, 0] + [0.3, 0.4, 0]
    seen = {"left_hand": hand, "left_shoulder": np.zeros((240, 3))}
    assert hurried(seen, RATE) is told
    # Trembling is quick, but not far.
    assert not hurried(seen | {"left_hand": hand * 0.05}, RATE)
    assert not hurried({name: points[:5] for name, points in seen.items()}, RATE)
