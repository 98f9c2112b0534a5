"""A shot as USD, opened again: what its camera sees is what the shot's camera sees."""

import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar import MissingExtraError
from pegbar.export.limbs import capsules
from pegbar.export.shot_scene import lenses
from pegbar.export.shot_usd import shot_usd
from tests.export.shots import FRAMES, GONE, shot

pxr = pytest.importorskip("pxr")
from pxr import Usd, UsdGeom  # noqa: E402


def opened(scene, tmp_path, suffix=".usdc"):
    path = str(tmp_path / f"shot{suffix}")
    assert shot_usd(scene).Export(path)
    return Usd.Stage.Open(path)


def seen(stage, point, frame, size=(960, 540)):
    """The pixel at which USD's camera sees ``point``, by the rules of UsdGeomCamera."""
    camera = UsdGeom.Camera.Get(stage, "/shot/camera")
    to_world = np.array(camera.ComputeLocalToWorldTransform(frame)).T
    x, y, z, _ = np.linalg.inv(to_world) @ [*point, 1]
    focal = camera.GetFocalLengthAttr().Get(frame)
    across = focal * x / -z - camera.GetHorizontalApertureOffsetAttr().Get(frame)
    upwards = focal * y / -z - camera.GetVerticalApertureOffsetAttr().Get(frame)
    wide, tall = camera.GetHorizontalApertureAttr().Get(frame), camera.GetVerticalApertureAttr().Get(frame)
    return (across / wide + 0.5) * size[0] - 0.5, (0.5 - upwards / tall) * size[1] - 0.5


@pytest.mark.parametrize(
    ("lens", "most"),
    [({}, 1e-6), ({"zoom": 0.03}, 1e-6), ({"shift": (81.7, -33.1)}, 2e-5), ({"shift": (0, 7.0)}, 2e-6)],
)
def test_the_camera_sees_markers_where_the_shot_does(lens, most, tmp_path):
    scene = shot(**lens)
    stage = opened(scene, tmp_path)
    for row, frame in enumerate(FRAMES):
        prims = {
            prim.GetDisplayName(): prim
            for prim in stage.GetPrimAtPath("/shot/characters/Anna___Bo/markers").GetChildren()
        }
        assert set(prims) == set(scene.characters[0].marker_names)
        for index, name in enumerate(scene.characters[0].marker_names):
            place = UsdGeom.Xformable(prims[name]).ComputeLocalToWorldTransform(frame).ExtractTranslation()
            expected = scene.cameras[row].project(scene.characters[0].markers[row, index])
            np.testing.assert_allclose(seen(stage, place, frame), expected, atol=most)


def test_pixels_that_are_not_square_and_odd_sizes_are_kept():
    for stretch, size in ((1.3, (960, 540)), (1.0, (1921, 1081)), (0.8, (97, 1331))):
        scene = shot()
        wide = np.diag([stretch * size[0] / 960, size[0] / 960, 1.0])
        camera = type(scene.cameras[0])(wide @ scene.cameras[0].matrix, size)
        object.__setattr__(scene, "cameras", (camera,) * len(FRAMES))
        lens = lenses(scene)[0]
        inner = camera.intrinsic
        assert lens.focal_length / lens.width * size[0] == pytest.approx(inner[0, 0], rel=5e-8)
        assert lens.focal_length / lens.height * size[1] == pytest.approx(inner[1, 1], rel=2e-7)
        assert 35.9 < lens.width < 36.1


def test_skew_is_refused_with_its_frame():
    scene = shot()
    skewed = type(scene.cameras[0])(np.array([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]) @ scene.cameras[2].matrix, (960, 540))
    object.__setattr__(scene, "cameras", (*scene.cameras[:2], skewed, *scene.cameras[3:]))
    with pytest.raises(ValueError, match="frame 103: its camera has skew"):
        lenses(scene)


def test_units_axes_time_and_image_size(tmp_path):
    stage = opened(shot(), tmp_path)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (12, 101, 108)
    settings = stage.GetPrimAtPath(stage.GetMetadata("renderSettingsPrimPath"))
    assert tuple(settings.GetAttribute("resolution").Get()) == (960, 540)
    assert stage.GetDefaultPrim().GetPath() == "/shot"
    assert [c.GetDisplayName() for c in stage.GetPrimAtPath("/shot/characters").GetChildren()] == ["Anna & Bo", "1"]
    points = UsdGeom.Mesh.Get(stage, "/shot/ground").GetPointsAttr().Get()
    edges = np.cross(*(np.array(points[k]) - np.array(points[0]) for k in (1, 2)))
    assert edges[1] > 0
    assert {point[1] for point in points} == {0}


def test_capsules_are_the_volumes_and_meshes_lie_on_them(tmp_path):
    scene = shot()
    stage = opened(scene, tmp_path, ".usda")
    volumes = scene.characters[0].volumes
    for limb, name in enumerate(scene.characters[0].limb_names):
        prim = UsdGeom.Capsule_1.Get(stage, f"/shot/characters/Anna___Bo/capsules/{name}")
        mesh = UsdGeom.Mesh.Get(stage, f"/shot/characters/Anna___Bo/limbs/{name}")
        for row in (0, 5):
            frame = FRAMES[row]
            half = prim.GetHeightAttr().Get(frame) / 2
            to_world = np.array(prim.ComputeLocalToWorldTransform(frame)).T
            ends = (to_world @ np.array([[0, -half, 0, 1], [0, half, 0, 1]]).T).T[:, :3]
            np.testing.assert_allclose(ends, [volumes.start[row, limb], volumes.end[row, limb]], atol=1e-12)
            radii = prim.GetRadiusBottomAttr().Get(frame), prim.GetRadiusTopAttr().Get(frame)
            assert radii == (volumes.start_radius[row, limb], volumes.end_radius[row, limb])
            points = np.array(mesh.GetPointsAttr().Get(frame))
            low, high = points[: len(points) // 2], points[len(points) // 2 :]
            np.testing.assert_allclose(np.linalg.norm(low - ends[0], axis=1), radii[0], atol=1e-6)
            np.testing.assert_allclose(np.linalg.norm(high - ends[1], axis=1), radii[1], atol=1e-6)
            axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
            assert ((low - ends[0]) @ axis).max() < 1e-6
            assert ((high - ends[1]) @ axis).min() > -1e-6
            box = np.array(mesh.GetExtentAttr().Get(frame))
            np.testing.assert_allclose(box, [points.min(0), points.max(0)])


def test_meshes_face_outwards(tmp_path):
    stage = opened(shot(), tmp_path)
    mesh = UsdGeom.Mesh.Get(stage, "/shot/characters/Anna___Bo/limbs/torso")
    corners = np.array(mesh.GetPointsAttr().Get(101))[np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)]
    middle = corners.mean(axis=(0, 1))
    volume = np.einsum("ti,ti->t", corners[:, 0] - middle, np.cross(corners[:, 1] - middle, corners[:, 2] - middle))
    assert (volume > -1e-12).all()
    # Each edge is there once in each direction: the mesh is closed.
    triangles = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    edges = {(a, b) for t in triangles.tolist() for a, b in zip(t, [*t[1:], t[0]], strict=True)}
    assert len(edges) == 3 * len(triangles)
    assert {(b, a) for a, b in edges} == edges


def test_what_is_not_known_is_hidden_and_never_nan(tmp_path):
    scene = shot()
    stage = opened(scene, tmp_path)
    assert not stage.GetPrimAtPath("/shot/characters/_1/markers/left_hand")
    names = list(UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/shot/characters/_1/points")).GetPrimvar("names").Get())
    assert names == [name for name in scene.characters[1].marker_names if name != "left_hand"]
    for kind, name in (("markers", "neck"), ("limbs", "torso"), ("capsules", "torso")):
        prim = UsdGeom.Imageable(stage.GetPrimAtPath(f"/shot/characters/_1/{kind}/{name}"))
        hidden = [row for row, frame in enumerate(FRAMES) if prim.ComputeVisibility(frame) == "invisible"]
        assert tuple(hidden) == GONE
    for frame in FRAMES:
        points = np.array(UsdGeom.Points.Get(stage, "/shot/characters/_1/points").GetPointsAttr().Get(frame))
        assert np.isfinite(points).all()
        assert points.shape == (len(names), 3)


def test_axes_do_not_jump_when_a_limb_hangs_straight_down():
    scene = shot()
    down = np.tile([[0.0, -1.0, 0.0]], (8, 1)) + 1e-3 * np.array([[np.cos(a), 0, np.sin(a)] for a in np.arange(8)])
    volumes = scene.characters[0].volumes
    volumes.end[:, 0] = volumes.start[:, 0] + down
    volumes.end[4, 0] = volumes.start[4, 0]
    limb = capsules(scene.characters[0])[0]
    steps = Rotation.from_quat(limb.turns[1:]) * Rotation.from_quat(limb.turns[:-1]).inv()
    assert steps.magnitude().max() < 0.01
    assert (np.einsum("fq,fq->f", limb.turns[1:], limb.turns[:-1]) > 0).all()
    along = Rotation.from_quat(limb.turns).apply([0, 1, 0])
    np.testing.assert_allclose(along[5], down[5] / np.linalg.norm(down[5]), atol=1e-9)


def test_a_missing_library_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingExtraError, match=r'pip install "pegbar\[usd\]"'):
        shot_usd(shot())
