import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pegbar import DegenerateError, OrthographicCamera, find_orthographic, read_motion
from pegbar.report.jain2009 import LIMBS as WALK_LIMBS
from pegbar.report.jain2009 import MARKERS, walk_poses
from tests.limbs import LIMBS, swinging

ARMS_AND_LEGS = LIMBS[2:]


def apart(camera, azimuth, elevation):
    """Degrees between two view directions' angles."""
    return abs((camera.azimuth - azimuth + 180) % 360 - 180), abs(camera.elevation - elevation)


@given(st.floats(-180, 180), st.floats(-10, 55), st.floats(1, 1000))
@settings(max_examples=15)
def test_the_camera_of_the_clips_own_picture(azimuth, elevation, scale):
    clip = swinging(1, 20)
    truth = OrthographicCamera.from_angles(azimuth, elevation, scale, (30, -20))
    drawn = truth.project(clip)
    drawn[4, 3] = np.nan
    found = find_orthographic(drawn, clip)
    assert max(apart(found, azimuth, elevation)) < 0.1
    assert found.scale == pytest.approx(scale, rel=1e-3)
    np.testing.assert_allclose(found.center, truth.center, atol=5e-3 * scale)


def test_travel_and_timing_do_not_matter():
    clip = swinging(2, 60)
    drawn = OrthographicCamera.from_angles(60, 20, 200).project(clip[np.repeat(np.arange(0, 60, 3), [1, 2] * 10)])
    drawn += np.cumsum(np.full((30, 1, 2), 7.0), axis=0)
    found = find_orthographic(drawn, clip, limbs=ARMS_AND_LEGS)
    assert max(apart(found, 60, 20)) < 3
    assert found.scale == pytest.approx(200, rel=0.05)


@pytest.mark.parametrize(("azimuth", "elevation"), [(45, 15), (90, 10)])
def test_another_actors_walk_is_enough(test_data, azimuth, elevation):
    drawn, clip = (walk_poses(read_motion(test_data / f"mocap/bvh/cmu_{name}.bvh")) for name in ("07_01", "35_01"))
    names = [MARKERS[end] for end in WALK_LIMBS[:, 1]]
    limbs = [
        limb for limb, name in zip(WALK_LIMBS, names, strict=True) if name.endswith(("ForeArm", "Hand", "Leg", "Foot"))
    ]
    limbs = [limb for limb in limbs if not MARKERS[limb[1]].endswith("UpLeg")]
    seen = OrthographicCamera.from_angles(azimuth, elevation, 300).project(drawn)
    found = find_orthographic(seen, clip, limbs=limbs)
    assert max(apart(found, azimuth, elevation)) < 10
    assert found.scale == pytest.approx(300, rel=0.15)


def test_wrong_arguments_are_named():
    clip = swinging(3, 6)
    drawn = OrthographicCamera.from_angles(0, 0).project(clip)
    with pytest.raises(ValueError, match="points: want shape"):
        find_orthographic(drawn[:5], clip)
    with pytest.raises(ValueError, match="limbs"):
        find_orthographic(drawn, clip, limbs=[(0, 11)])
    with pytest.raises(DegenerateError, match="two visible markers"):
        find_orthographic(np.full((6, 11, 2), np.nan), clip)
    with pytest.raises(DegenerateError, match="no extent"):
        find_orthographic(np.zeros((6, 11, 2)), clip)
    with pytest.raises(DegenerateError, match="a clip with frames"):
        find_orthographic(drawn, clip[:0], limbs=LIMBS)
