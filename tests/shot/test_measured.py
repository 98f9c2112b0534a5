"""The figures of a simulated shot, measured some frames at a time, against all frames at once."""

import numpy as np
import pytest

from pegbar.shot.measured import measured
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Cloth, Strands
from pegbar.simulate.measures import measure_cloth, measure_strands
from pegbar.simulate.scene import SimulationScene
from tests.walkers import walker

FRAMES, DEEP = 230, 117


@pytest.fixture(scope="module")
def simulated():
    """A flag and a line far from a figure, that flutter; in one frame the flag lies in its thigh."""
    figure = walker(FRAMES, speed=0.0)
    chance = np.random.default_rng(0)
    limb = figure.limb_names.index("left_thigh")
    middle = (figure.volumes.start[0, limb] + figure.volumes.end[0, limb]) / 2
    flag = Cloth("flag", np.array([[9.0, 0, 0], [9, 0.1, 0], [9, 0, 0.1]]), np.array([[0, 1, 2]]))
    line = Strands("line", np.array([[7.0, 1, 0], [7, 0.5, 0], [7, 0, 0]]), np.array([3]), np.array([0.01]))
    cache = MemoryCache()
    for frame in range(FRAMES):
        moved = flag.vertices + chance.normal(0, 0.002, (3, 3))
        cache.write("flag", frame, {"positions": moved - moved[0] + middle if frame == DEEP else moved})
        cache.write("line", frame, {"positions": line.points * (1 + frame / 1000)})
    return SimulationScene(24, FRAMES, (flag, line), (figure,)), cache


def test_figures_are_those_of_all_frames(simulated):
    scene, cache = simulated
    found = measured(scene, cache, 1001)
    for kind, name, measure in (("cloth", "flag", measure_cloth), ("strands", "line", measure_strands)):
        part, whole = found[kind][name], measure(scene, cache, name)
        told = [part[key] for key in ("stretch_median", "stretch_p99", "stretch_max")]
        np.testing.assert_allclose(told, whole.percentiles, atol=1e-5)
        assert part["deepest_penetration_m"] == whole.penetration.max()
        assert part["in_limb"] == whole.limb[int(whole.penetration.argmax())]
    assert (found["cloth"]["flag"]["in_frame"], found["cloth"]["flag"]["in_limb"]) == (1001 + DEEP, "left_thigh")
    assert found["deepest_penetration_m"] == found["cloth"]["flag"]["deepest_penetration_m"] > 0.02
    assert found["stretch_p99"] == found["cloth"]["flag"]["stretch_p99"]
    assert found["particles"] == {}


def test_a_scene_without_elements_has_no_figures():
    found = measured(SimulationScene(24, 2, ()), MemoryCache(), 1)
    assert found["deepest_penetration_m"] is found["stretch_p99"] is None
