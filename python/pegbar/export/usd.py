"""A motion as USD: a UsdSkel skeleton, its animation and a skinned figure of capsules."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar.errors import MissingExtraError
from pegbar.export.rig import Rig, frame_seconds, rig
from pegbar.scene.motion import Motion

if TYPE_CHECKING:
    from pxr import Sdf

Floats = NDArray[np.float64]


def usd_layer(
    motion: Motion,
    *,
    times: ArrayLike | None = None,
    interpolation: Literal["linear", "step"] = "linear",
    frame_rate: float | None = None,
) -> Sdf.Layer:
    """Return ``motion`` as a USD layer: `layer.Export(path)` writes .usda, .usdc or .usd; metres, Y up.

    Joints keep the motion's names as far as USD allows letters, and stand in the path of their parents. A bone that
    changes its length moves its child joint and stretches its capsule.

    Parameters
    ----------
    motion : Motion
        A skeleton in motion.
    times : (F,) float, optional
        When each frame is shown, in seconds, rising. None: ``motion.frame_rate``.
    interpolation : {"linear", "step"}
        What happens between frames: "step" holds the pose (each pose is stored again just before the next).
    frame_rate : float, optional
        Time codes per second. None: the motion's.

    Raises
    ------
    ValueError
        For a motion without skeleton or frames, or times that do not rise.
    MissingExtraError
        Where the library `usd-core` is not installed.
    """
    try:
        from pxr import Sdf, Usd, UsdGeom, UsdSkel
    except ImportError:
        raise MissingExtraError("USD", "usd") from None
    bones = rig(motion)
    rate = float(frame_rate or motion.frame_rate)
    codes, rows = _samples(motion, times, rate, interpolation)
    layer: Sdf.Layer = Sdf.Layer.CreateAnonymous("motion.usda")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(float(codes[0]))
    stage.SetEndTimeCode(float(codes[-1]))
    root = UsdSkel.Root.Define(stage, "/figure")
    stage.SetDefaultPrim(root.GetPrim())
    paths = _paths(bones)
    _skeleton(UsdSkel.Skeleton.Define(stage, "/figure/skeleton"), bones, paths)
    _animation(UsdSkel.Animation.Define(stage, "/figure/skeleton/animation"), bones, paths, codes, rows)
    binding = UsdSkel.BindingAPI.Apply(stage.GetPrimAtPath("/figure/skeleton"))
    binding.CreateAnimationSourceRel().SetTargets([Sdf.Path("/figure/skeleton/animation")])
    _mesh(UsdGeom.Mesh.Define(stage, "/figure/capsules"), bones)
    return layer


def _samples(
    motion: Motion, times: ArrayLike | None, rate: float, interpolation: str
) -> tuple[Floats, NDArray[np.intp]]:
    """Time codes, and the frame that is stored at each; a step is stored twice, since USD's joints interpolate."""
    frames, seconds = len(motion.positions), frame_seconds(motion, times)
    codes, rows = seconds * rate, np.arange(frames)
    if interpolation == "step" and frames > 1:
        before = codes[1:] - 0.01 * np.diff(codes)
        order = np.argsort(np.concatenate([codes, before]), kind="stable")
        return np.concatenate([codes, before])[order], np.concatenate([rows, rows[:-1]])[order]
    return codes, rows


def plain_names(names: Iterable[str]) -> list[str]:
    """Return ``names`` with the letters that USD allows, each once."""
    found: list[str] = []
    for name in names:
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        plain = f"_{plain}" if not plain or plain[0].isdigit() else plain
        while plain in found:
            plain += "_"
        found.append(plain)
    return found


def _paths(bones: Rig) -> list[str]:
    """The joints' paths, parents first."""
    names = plain_names(bones.names)
    paths = []
    for joint in range(len(names)):
        path, above = names[joint], bones.parents[joint]
        while above >= 0:
            path, above = f"{names[above]}/{path}", bones.parents[above]
        paths.append(path)
    return paths


def _skeleton(skeleton: Any, bones: Rig, paths: list[str]) -> None:
    from pxr import Gf, Vt

    rest = np.tile(np.eye(4), (len(paths), 1, 1))
    for joint, parent in enumerate(bones.parents):
        above = np.eye(4) if parent < 0 else bones.bind[parent]
        rest[joint] = np.linalg.inv(above) @ bones.bind[joint]
    skeleton.CreateJointsAttr(paths)
    for create, matrices in (
        (skeleton.CreateBindTransformsAttr, bones.bind),
        (skeleton.CreateRestTransformsAttr, rest),
    ):
        # USD multiplies row vectors from the left.
        create(Vt.Matrix4dArray([Gf.Matrix4d(matrix.T.tolist()) for matrix in matrices]))


def _animation(animation: Any, bones: Rig, paths: list[str], codes: Floats, rows: NDArray[np.intp]) -> None:
    from pxr import Gf, Vt

    animation.CreateJointsAttr(paths)
    translations = animation.CreateTranslationsAttr()
    rotations, scales = animation.CreateRotationsAttr(), animation.CreateScalesAttr()
    for code, row in zip(codes.tolist(), rows.tolist(), strict=True):
        translations.Set(Vt.Vec3fArray.FromNumpy(bones.translations[row].astype(np.float32)), code)
        turns = [Gf.Quatf(w, x, y, z) for x, y, z, w in bones.quaternions[row].tolist()]
        rotations.Set(Vt.QuatfArray(turns), code)
        scales.Set(Vt.Vec3hArray([Gf.Vec3h(*scale) for scale in bones.scales[row].tolist()]), code)


def _mesh(mesh: Any, bones: Rig) -> None:
    from pxr import Gf, UsdGeom, UsdSkel, Vt

    figure = bones.figure
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(figure.vertices.astype(np.float32)))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(figure.normals.astype(np.float32)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(figure.triangles)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(figure.triangles.astype(np.int32).reshape(-1)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDisplayColorAttr([Gf.Vec3f(0.8, 0.75, 0.7)])
    low, high = figure.vertices.min(0).tolist(), figure.vertices.max(0).tolist()
    mesh.CreateExtentAttr([Gf.Vec3f(*low), Gf.Vec3f(*high)])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([mesh.GetPath().GetParentPath().AppendChild("skeleton")])
    binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray.FromNumpy(bones.carrier.astype(np.int32)))
    binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray([1.0] * len(figure.vertices)))
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
