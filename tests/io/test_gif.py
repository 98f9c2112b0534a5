import av
import numpy as np
import pytest

from pegbar.io.gif import write_gif


def read(file):
    """Frames as another program shows them, RGBA, and when each begins, in hundredths of a second."""
    with av.open(str(file)) as container:
        pictures = [(frame.to_ndarray(format="rgba"), frame.pts) for frame in container.decode(video=0)]
    return [picture for picture, _ in pictures], [time for _, time in pictures]


def moving(count=60, alpha=255, noise=0):
    """A disc that goes from left to right over a plain ground."""
    random = np.random.default_rng(1)
    for index in range(count):
        picture = np.full((40, 90, 4), (240, 240, 235, alpha), np.uint8)
        place = np.hypot(*(np.indices((40, 90)) - np.array([20, 12 + index])[:, None, None])) < 10
        colour = random.integers(0, 256, (place.sum(), 3)) if noise else (200, 30, 60)
        picture[place, :3], picture[place, 3] = colour, 255
        yield picture


def test_frames_come_back_in_order_and_time(tmp_path):
    file = tmp_path / "a.gif"
    durations = [3, 4] * 30
    write_gif(file, moving(), durations)
    frames, times = read(file)
    assert len(frames) == 60
    assert times == np.cumsum([0, *durations[:-1]]).tolist()
    for frame, want in zip(frames, moving(), strict=True):
        assert np.array_equal(frame[..., :3], want[..., :3])


def test_what_is_transparent_stays_so_and_leaves_no_trail(tmp_path):
    file = tmp_path / "a.gif"
    write_gif(file, moving(alpha=0), [5] * 60)
    for frame, want in zip(read(file)[0], moving(alpha=0), strict=True):
        assert np.array_equal(frame[..., 3], want[..., 3])
        assert np.array_equal(frame[want[..., 3] > 0], want[want[..., 3] > 0])


def test_a_figure_that_comes_and_goes_leaves_nothing(tmp_path):
    full, empty = np.full((8, 8, 4), 255, np.uint8), np.zeros((8, 8, 4), np.uint8)
    write_gif(tmp_path / "a.gif", [full] * 24 + [empty] * 2 + [full], [4] * 27)
    frames = read(tmp_path / "a.gif")[0]
    assert [int(frame[..., 3].max()) for frame in frames[-4:]] == [255, 0, 0, 255]


def test_many_colours_become_near_ones(tmp_path):
    ramp = np.stack(np.meshgrid(np.arange(256), np.arange(256)), axis=2).astype(np.uint8)
    picture = np.dstack([ramp, np.full((256, 256), 40, np.uint8)])
    write_gif(tmp_path / "a.gif", [picture], [4])
    found = read(tmp_path / "a.gif")[0][0][..., :3].astype(int)
    assert np.abs(found - picture).mean() < 5


def test_another_scene_has_its_own_colours(tmp_path):
    red, blue = np.full((16, 16, 3), (250, 10, 10), np.uint8), np.full((16, 16, 3), (10, 60, 250), np.uint8)
    write_gif(tmp_path / "a.gif", [red] * 24 + [blue] * 3, [4] * 27)
    frames = read(tmp_path / "a.gif")[0]
    assert np.array_equal(frames[0][..., :3], red)
    assert np.array_equal(frames[-1][..., :3], blue)


def test_a_still_and_a_single_pixel(tmp_path):
    write_gif(tmp_path / "a.gif", [np.full((1, 1, 3), 7, np.uint8)] * 3, [4] * 3)
    assert read(tmp_path / "a.gif")[0][0][..., :3].tolist() == [[[7, 7, 7]]]


def test_wrong_frames_are_named(tmp_path):
    with pytest.raises(ValueError, match="want at least one"):
        write_gif(tmp_path / "a.gif", [], [])
    with pytest.raises(ValueError, match=r"frames\[1\]: want 2 rows x 2 columns"):
        write_gif(tmp_path / "a.gif", [np.zeros((2, 2, 3), np.uint8), np.zeros((2, 3, 3), np.uint8)], [4, 4])
    assert list(tmp_path.iterdir()) == []
