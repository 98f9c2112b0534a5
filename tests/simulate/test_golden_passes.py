"""The passes of a small scene against those kept; ``python -m tests.simulate.test_golden_passes`` keeps new ones."""

import math
from pathlib import Path

import numpy as np

from pegbar import Ink, PerspectiveCamera, render_passes
from tests.meshes import box, ribbon, torus

KEPT = Path(__file__).parents[1] / "golden" / "passes.npz"


def rendered():
    camera = PerspectiveCamera.look_at((0.6, 0.9, 2.6), (0, 0, 0), (96, 64), math.radians(48))
    scene = [torus(0.7, 0.22), ribbon(), box((0.5, 0.1, 0.1), 0.5)]
    passes = render_passes(scene, camera, samples=2, bands=(0.35, 0.7, 1), ink=Ink(1.5)).resolved()
    return {name: getattr(passes, name) for name in ("beauty", "depth", "coverage", "object_id")}


def test_the_scene_looks_as_it_did():
    got = rendered()
    with np.load(KEPT) as kept:
        assert np.array_equal(got["object_id"], kept["object_id"])
        for name in ("beauty", "depth", "coverage"):
            np.testing.assert_allclose(got[name], kept[name], rtol=1e-5, atol=1e-6)
    assert len(np.unique(got["object_id"])) == 4


if __name__ == "__main__":
    np.savez_compressed(KEPT, **rendered())
    print(f"wrote {KEPT}")
