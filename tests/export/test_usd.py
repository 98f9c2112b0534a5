import dataclasses
import sys

import numpy as np
import pytest

from pegbar import MissingExtraError
from pegbar.export.usd import usd_layer
from tests.motions import swaying

pxr = pytest.importorskip("pxr")
from pxr import Gf, Usd, UsdGeom, UsdSkel  # noqa: E402


def opened(layer, tmp_path, suffix=".usda"):
    path = str(tmp_path / f"motion{suffix}")
    assert layer.Export(path)
    return Usd.Stage.Open(path)


def joints_at(stage, code):
    """World matrices (K, 4, 4) of the joints as UsdSkel evaluates them, columns as usual."""
    cache = UsdSkel.Cache()
    root = UsdSkel.Root(stage.GetDefaultPrim())
    cache.Populate(root, Usd.TraverseInstanceProxies())
    query = cache.GetSkelQuery(UsdSkel.Skeleton.Get(stage, "/figure/skeleton"))
    matrices = query.ComputeJointSkelTransforms(code)
    return np.array([np.array(matrix) for matrix in matrices]).transpose(0, 2, 1)


@pytest.mark.parametrize("stretch", [0.0, 0.3])
@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_usdskel_evaluates_to_the_motion(stretch, suffix, tmp_path):
    motion = swaying(stretch=stretch)
    stage = opened(usd_layer(motion), tmp_path, suffix)
    for frame in (0, 2, 6):
        found = joints_at(stage, frame)[: len(motion.names)]
        np.testing.assert_allclose(found[:, :3, 3], motion.positions[frame], atol=2e-5)
        np.testing.assert_allclose(found[:, :3, :3], motion.rotations[frame], atol=2e-5)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert (stage.GetTimeCodesPerSecond(), stage.GetEndTimeCode()) == (24, 6)


@pytest.mark.parametrize("stretch", [0.0, 0.3])
def test_the_figure_moves_with_the_bones(stretch, tmp_path):
    motion = swaying(stretch=stretch)
    stage = opened(usd_layer(motion), tmp_path)
    cache = UsdSkel.Cache()
    cache.Populate(UsdSkel.Root(stage.GetDefaultPrim()), Usd.TraverseInstanceProxies())
    query = cache.GetSkelQuery(UsdSkel.Skeleton.Get(stage, "/figure/skeleton"))
    skinning = cache.GetSkinningQuery(stage.GetPrimAtPath("/figure/capsules"))
    points = UsdGeom.Mesh.Get(stage, "/figure/capsules").GetPointsAttr().Get()
    assert skinning.ComputeSkinnedPoints(query.ComputeSkinningTransforms(4), points, 4)
    places, found = motion.positions[4], np.array(points)
    for end in motion.names:
        near = np.linalg.norm(found - places[motion.names.index(end)], axis=1)
        assert near.min() < 0.08
    assert np.linalg.norm(found[:, None] - places[None], axis=2).min(axis=1).max() < 0.35


def test_a_step_holds_until_just_before_the_next(tmp_path):
    motion = swaying(3)
    stage = opened(usd_layer(motion, times=[0, 0.5, 1.0], interpolation="step"), tmp_path)
    held = joints_at(stage, 11.8)[: len(motion.names), :3, 3]
    np.testing.assert_allclose(held, motion.positions[0], atol=2e-5)
    moved = joints_at(opened(usd_layer(motion, times=[0, 0.5, 1.0]), tmp_path, ".usdc"), 11.8)[
        : len(motion.names), :3, 3
    ]
    assert np.abs(moved - motion.positions[1]).max() < np.abs(held - motion.positions[1]).max() / 5


def test_names_that_usd_does_not_allow_are_changed_and_stay_apart(tmp_path):
    motion = dataclasses.replace(swaying(2), names=("a:b", "a.b", "1", "ß", "", "x", "x_"))
    stage = opened(usd_layer(motion), tmp_path)
    leaves = [path.split("/")[-1] for path in UsdSkel.Skeleton.Get(stage, "/figure/skeleton").GetJointsAttr().Get()]
    assert leaves == ["a_b", "a_b_", "_1", "_", "__", "x", "x_"]


def test_wrong_times_are_named():
    with pytest.raises(ValueError, match="times"):
        usd_layer(swaying(3), times=[0, 2, 1])


def test_a_missing_library_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingExtraError, match=r'pip install "pegbar\[usd\]"'):
        usd_layer(swaying(2))


def test_matrices_are_row_vectors_in_usd():
    assert np.array(Gf.Matrix4d().SetTranslate(Gf.Vec3d(1, 2, 3)))[3, :3].tolist() == [1, 2, 3]
