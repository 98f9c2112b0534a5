import numpy as np
import pytest

from pegbar.scene.contacts import ankle_heights, foot_contacts

NAMES = ("head", "left_foot", "right_foot")


def walk(frames=96, rate=24.0, stride=24, drop=0.0):
    """Feet that stand for half a stride and swing for half, 0.08 m high when they stand; and when they stand."""
    clip = np.zeros((frames, 3, 3))
    clip[:, 0, 1] = 1.7
    standing = np.zeros((frames, 2), bool)
    for foot in range(2):
        phase = (np.arange(frames) / stride + foot / 2) % 1
        swing = np.clip(phase * 2 - 1, 0, 1)
        clip[:, 1 + foot, 1] = 0.08 + drop + 0.2 * np.sin(np.pi * swing)
        clip[:, 1 + foot, 2] = 1.4 * ((np.arange(frames) / stride + foot / 2) // 1 + swing)
        standing[:, foot] = phase < 0.5
    return clip, standing


def test_feet_of_a_walk_stand_half_the_time():
    clip, standing = walk()
    found = foot_contacts(clip, NAMES, 24.0, 0.0)
    assert (found == standing).mean() > 0.85
    assert not (found & ~standing)[1:].any() or (found & ~standing).sum() <= 8
    np.testing.assert_allclose(ankle_heights(clip, NAMES, found), 0.08, atol=0.01)


def test_a_foot_that_slides_or_hovers_does_not_stand():
    clip, _ = walk()
    clip[:, 1] = [0, 0.08, 0]
    clip[:, 1, 2] = np.arange(96) / 24 * 0.8
    clip[:, 2] = [0, 0.3, 0]
    assert not foot_contacts(clip, NAMES, 24.0, 0.0).any()
    assert foot_contacts(clip, NAMES, 24.0)[:, 1].all()


def test_hysteresis_keeps_a_step_whole():
    clip = np.zeros((48, 3, 3))
    clip[18:30, 1, 1] = 0.07 * np.sin(np.linspace(0, np.pi, 12))
    found = foot_contacts(clip, NAMES, 24.0)
    assert found[:, 0].all()
    clip[18:30, 1, 1] *= 3
    assert not foot_contacts(clip, NAMES, 24.0)[21:27, 0].any()


def test_frames_that_are_missing_do_not_stand():
    clip = np.zeros((10, 3, 3))
    clip[4, 1] = np.nan
    found = foot_contacts(clip, NAMES, 24.0)
    assert not found[3:6, 0].any()
    assert found[[0, 1, 7, 8], 0].all()
    assert found[:, 1].all()


@pytest.mark.parametrize("frames", [0, 1, 2])
def test_short_clips(frames):
    assert foot_contacts(np.zeros((frames, 3, 3)), NAMES, 24.0).tolist() == [[True, True]] * frames


def test_wrong_arguments_are_named():
    with pytest.raises(ValueError, match="^names: want left_foot"):
        foot_contacts(np.zeros((1, 1, 3)), ["head"], 24)
    with pytest.raises(ValueError, match="^markers: "):
        foot_contacts(np.zeros((1, 2, 3)), NAMES, 24)
    with pytest.raises(ValueError, match="^frame_rate: "):
        foot_contacts(np.zeros((1, 3, 3)), NAMES, 0)
    with pytest.raises(ValueError, match="^contacts: "):
        ankle_heights(np.zeros((1, 3, 3)), NAMES, [[True]])


def test_a_slow_slide_never_begins_a_step_and_tiptoe_is_not_flat():
    clip = np.zeros((48, 3, 3))
    clip[:, 1, 0] = 0.45 / 24 * np.arange(48)
    clip[30:, 2, 1] = 0.2
    found = foot_contacts(clip, NAMES, 24.0)
    assert not found[:, 0].any()
    assert found[:29, 1].all()
    assert not found[31:, 1].any()
