"""An aligned shot as USD: the camera, the ground, and every character's markers, capsules and limb meshes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import MissingExtraError
from pegbar.export.limbs import Capsule, capsule_shape, capsules, nearest_known
from pegbar.export.shot_scene import ShotScene, camera_poses, lenses
from pegbar.export.usd import plain_names
from pegbar.simulate.scene import Character

if TYPE_CHECKING:
    from pxr import Sdf

Floats = NDArray[np.float64]
# Metres: how far the ground plane reaches, and how large a marker is drawn.
_GROUND, _MARKER = 10.0, 0.03
_NEAR, _FAR = 0.01, 10_000.0


def shot_usd(scene: ShotScene) -> Sdf.Layer:
    """Return ``scene`` as a USD layer; metres, Y up, time codes are film frames.

    ``/shot/camera`` is the camera. Under ``/shot/characters/NAME``: ``markers`` (a transform each), ``points`` (the
    same as points with a primvar ``names``), ``capsules`` (``Capsule_1``, purpose guide) and ``limbs`` (the same as
    meshes). What is not known in a frame is invisible there.

    Raises
    ------
    ValueError
        For a camera with skew.
    MissingExtraError
        Where the library `usd-core` is not installed.
    """
    try:
        from pxr import Sdf, Usd, UsdGeom
    except ImportError:
        raise MissingExtraError("USD", "usd") from None
    layer: Sdf.Layer = Sdf.Layer.CreateAnonymous("shot.usda")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(scene.frame_rate)
    stage.SetFramesPerSecond(scene.frame_rate)
    stage.SetStartTimeCode(scene.frames[0])
    stage.SetEndTimeCode(scene.frames[-1])
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/shot").GetPrim())
    _camera(stage, scene)
    if scene.ground is not None:
        _ground(stage, scene.ground)
    UsdGeom.Scope.Define(stage, "/shot/characters")
    for plain, character in zip(plain_names(c.name for c in scene.characters), scene.characters, strict=True):
        place = f"/shot/characters/{plain}"
        UsdGeom.Xform.Define(stage, place).GetPrim().SetDisplayName(character.name)
        _markers(stage, place, character, scene.frames)
        _limbs(stage, place, capsules(character), scene.frames)
    return layer


def _camera(stage: Any, scene: ShotScene) -> None:
    from pxr import Gf, Sdf, UsdGeom, UsdRender

    camera = UsdGeom.Camera.Define(stage, "/shot/camera")
    found = np.array([[lens.focal_length, lens.width, lens.height, lens.right, lens.up] for lens in lenses(scene)])
    attributes = (
        camera.CreateFocalLengthAttr(),
        camera.CreateHorizontalApertureAttr(),
        camera.CreateVerticalApertureAttr(),
        camera.CreateHorizontalApertureOffsetAttr(),
        camera.CreateVerticalApertureOffsetAttr(),
    )
    for attribute, values in zip(attributes, found.T, strict=True):
        _animate(attribute, values, scene.frames, float)
    camera.CreateClippingRangeAttr(Gf.Vec2f(_NEAR, _FAR))
    # USD multiplies row vectors from the left.
    poses = camera_poses(scene.cameras).transpose(0, 2, 1)
    _animate(camera.AddTransformOp(), poses, scene.frames, lambda pose: Gf.Matrix4d(pose.tolist()))
    settings = UsdRender.Settings.Define(stage, "/Render/settings")
    settings.CreateResolutionAttr(Gf.Vec2i(*scene.image_size))
    settings.CreateCameraRel().SetTargets([Sdf.Path("/shot/camera")])
    stage.SetMetadata("renderSettingsPrimPath", "/Render/settings")


def _ground(stage: Any, height: float) -> None:
    from pxr import Gf, UsdGeom

    mesh = UsdGeom.Mesh.Define(stage, "/shot/ground")
    corners = [(x * _GROUND, height, z * _GROUND) for x, z in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
    mesh.CreatePointsAttr([Gf.Vec3f(*corner) for corner in corners])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateExtentAttr([Gf.Vec3f(*corners[3]), Gf.Vec3f(*corners[1])])
    mesh.CreatePurposeAttr(UsdGeom.Tokens.guide)


def _markers(stage: Any, place: str, character: Character, frames: Sequence[int]) -> None:
    from pxr import Gf, Sdf, UsdGeom, Vt

    UsdGeom.Scope.Define(stage, f"{place}/markers")
    known = np.asarray(np.isfinite(character.markers).all(axis=2))
    held = np.zeros_like(character.markers)
    there: list[int] = np.flatnonzero(known.any(axis=0)).tolist()
    for marker, plain in zip(there, plain_names(character.marker_names[m] for m in there), strict=True):
        held[:, marker] = character.markers[nearest_known(known[:, marker]), marker]
        prim = UsdGeom.Xform.Define(stage, f"{place}/markers/{plain}")
        prim.GetPrim().SetDisplayName(character.marker_names[marker])
        offset = prim.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble)
        _animate(offset, held[:, marker], frames, lambda row: Gf.Vec3d(*row.tolist()))
        _show(prim, known[:, marker], frames)
    points = UsdGeom.Points.Define(stage, f"{place}/points")
    _animate_points(points, held[:, there], frames)
    points.CreateWidthsAttr(Vt.FloatArray([_MARKER] * len(there)))
    points.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
    points.CreatePurposeAttr(UsdGeom.Tokens.guide)
    names = UsdGeom.PrimvarsAPI(points).CreatePrimvar("names", Sdf.ValueTypeNames.StringArray, UsdGeom.Tokens.vertex)
    names.Set(Vt.StringArray([character.marker_names[marker] for marker in there]))


def _limbs(stage: Any, place: str, limbs: Sequence[Capsule], frames: Sequence[int]) -> None:
    from pxr import Gf, UsdGeom, Vt

    UsdGeom.Scope.Define(stage, f"{place}/capsules").CreatePurposeAttr(UsdGeom.Tokens.guide)
    UsdGeom.Scope.Define(stage, f"{place}/limbs")
    triangles = capsule_shape()[2].astype(np.int32)
    for limb, plain in zip(limbs, plain_names(limb.name for limb in limbs), strict=True):
        _capsule(UsdGeom.Capsule_1.Define(stage, f"{place}/capsules/{plain}"), limb, frames)
        mesh = UsdGeom.Mesh.Define(stage, f"{place}/limbs/{plain}")
        _animate_points(mesh, np.stack([limb.vertices(row) for row in range(len(frames))]), frames)
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(triangles)))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(triangles.reshape(-1)))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateDisplayColorAttr([Gf.Vec3f(0.6, 0.6, 0.6)])
        for prim in (stage.GetPrimAtPath(f"{place}/{kind}/{plain}") for kind in ("capsules", "limbs")):
            prim.SetDisplayName(limb.name)
            _show(UsdGeom.Imageable(prim), limb.known, frames)


def _capsule(prim: Any, limb: Capsule, frames: Sequence[int]) -> None:
    from pxr import Gf, UsdGeom, Vt

    prim.CreateAxisAttr(UsdGeom.Tokens.y)
    _animate(prim.CreateHeightAttr(), limb.lengths, frames, float)
    _animate(prim.CreateRadiusBottomAttr(), limb.radii[:, 0], frames, float)
    _animate(prim.CreateRadiusTopAttr(), limb.radii[:, 1], frames, float)
    offset = prim.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble)
    _animate(offset, (limb.start + limb.end) / 2, frames, lambda row: Gf.Vec3d(*row.tolist()))
    turn = prim.AddOrientOp(UsdGeom.XformOp.PrecisionDouble)
    _animate(turn, limb.turns, frames, lambda q: Gf.Quatd(float(q[3]), Gf.Vec3d(*q[:3].tolist())))
    wide, half = limb.radii.max(axis=1), limb.lengths / 2
    extents = [[(-r, -h - a, -r), (r, h + b, r)] for r, h, (a, b) in zip(wide, half, limb.radii.tolist(), strict=True)]
    _animate(prim.CreateExtentAttr(), np.array(extents), frames, lambda box: Vt.Vec3fArray.FromNumpy(_single(box)))


def _animate_points(prim: Any, points: Floats, frames: Sequence[int]) -> None:
    """Points (F, n, 3) and the box around them."""
    from pxr import Vt

    _animate(prim.CreatePointsAttr(), points, frames, lambda row: Vt.Vec3fArray.FromNumpy(_single(row)))
    if points.shape[1]:
        boxes = np.stack([points.min(axis=1), points.max(axis=1)], axis=1)
        _animate(prim.CreateExtentAttr(), boxes, frames, lambda box: Vt.Vec3fArray.FromNumpy(_single(box)))


def _animate(attribute: Any, values: Floats, frames: Sequence[int], convert: Callable[[Any], Any]) -> None:
    """A value a frame; what does not change is stored once."""
    if (values == values[:1]).all():
        attribute.Set(convert(values[0]))
        return
    for frame, value in zip(frames, values, strict=True):
        attribute.Set(convert(value), frame)


def _show(prim: Any, known: NDArray[np.bool_], frames: Sequence[int]) -> None:
    """Hide ``prim`` in frames in which it is not known."""
    from pxr import UsdGeom

    if known.all():
        return
    shown = prim.CreateVisibilityAttr()
    changes = np.concatenate([[True], known[1:] != known[:-1]])
    for row in np.flatnonzero(changes).tolist():
        shown.Set(UsdGeom.Tokens.inherited if known[row] else UsdGeom.Tokens.invisible, frames[row])


def _single(values: Floats) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, np.float32)
