import numpy as np
import pytest

from pegbar.errors import FormatError
from pegbar.io.simulation_cache import FolderCache
from pegbar.simulate.cache import complete_until


def test_states_come_back_and_frames_are_listed_in_order(tmp_path):
    cache = FolderCache(tmp_path)
    for frame in (0, 1, 12, 5):
        cache.write("skirt", frame, {"positions": np.full((2, 3), frame + 0.1), "rapier": np.arange(frame)})
    assert cache.frames("skirt") == [0, 1, 5, 12]
    assert complete_until(cache, "skirt") == 2
    state = cache.read("skirt", 12)
    np.testing.assert_array_equal(state["positions"], np.full((2, 3), 12.1))
    np.testing.assert_array_equal(state["rapier"], np.arange(12))
    with pytest.raises(KeyError, match="skirt, frame 7"):
        cache.read("skirt", 7)
    cache.clear("skirt", 5)
    assert cache.frames("skirt") == [0, 1]
    assert cache.frames("none") == []


@pytest.mark.parametrize("name", ["../up", "a/b", "..", "Mäntel Nr. 2", "scarf"])
def test_any_name_is_a_folder_of_its_own_inside(tmp_path, name):
    cache = FolderCache(tmp_path / "cache")
    cache.write(name, 0, {"positions": np.zeros((1, 3))})
    assert cache.frames(name) == [0]
    assert [path.name for path in tmp_path.iterdir()] == ["cache"]
    assert len(list((tmp_path / "cache").iterdir())) == 1


def test_a_broken_file_is_named_and_others_are_forgotten(tmp_path):
    cache = FolderCache(tmp_path)
    for group in ("balls", "skirt"):
        cache.write(group, 0, {"positions": np.zeros((1, 3))})
    cache.path("balls", 0).write_bytes(b"no zip")
    with pytest.raises(FormatError, match=r"000000\.npz: no simulated frame"):
        cache.read("balls", 0)
    cache.keep_only(["skirt"])
    assert cache.frames("balls") == []
    assert cache.frames("skirt") == [0]
