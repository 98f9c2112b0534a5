"""A motion as animation files store it: local transforms of joints, and a figure that hangs on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from pegbar import arrays
from pegbar.export.figure import Figure, capsule_figure
from pegbar.lift.turning import swing
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
# Bones that change their length by less, in metres, are rigid.
_STRETCH = 1e-4
_UPWARDS = np.array([[0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Rig:
    """K joints: those of the motion, then one for every capsule that stretches, a child of the joint it starts at.

    ``translations`` (F, K, 3) metres, ``quaternions`` (F, K, 4) as x, y, z, w and ``scales`` (F, K, 3) are relative
    to the parent; signs are chosen so that neighbouring frames are near each other. ``moves`` and ``scaled`` (K,)
    tell the joints whose translation and scale change. ``bind`` (K, 4, 4) takes a joint's axes to the world in the
    pose that ``figure`` is bound in; ``carrier`` (n,) is the joint of each of its vertices.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    translations: Floats
    quaternions: Floats
    scales: Floats
    moves: NDArray[np.bool_]
    scaled: NDArray[np.bool_]
    bind: Floats
    figure: Figure
    carrier: NDArray[np.int64]


def rig(motion: Motion) -> Rig:
    """Return the rig of ``motion``; ValueError for a motion of points or of no frame."""
    parents = np.array(motion.parents)
    if len(parents) > 1 and (parents < 0).all():
        raise ValueError("motion: it has no skeleton, only points")
    if not len(motion.positions):
        raise ValueError("motion: it has no frame")
    translations, quaternions = _local(motion, parents)
    places = _bind_places(parents, translations[0])
    figure = capsule_figure(motion.parents, places)
    spread = np.ptp(np.linalg.norm(translations, axis=2), axis=0)
    long = [i for i, bone in enumerate(figure.bones) if bone.child is not None and spread[bone.child] > _STRETCH]
    joints, extra = len(parents), len(long)
    carriers = np.array([bone.joint for bone in figure.bones])
    carriers[long] = joints + np.arange(extra)
    tails = [figure.bones[i].child or 0 for i in long]
    starts = [figure.bones[i].joint for i in long]
    offsets = translations[:, tails]
    lengths = np.linalg.norm(offsets, axis=2)
    bind = np.tile(np.eye(4), (joints + extra, 1, 1))
    bind[:, :3, 3] = places[[*range(joints), *starts]]
    bind[joints:, :3, :3] = swing(np.repeat(_UPWARDS, extra, axis=0), offsets[0])
    scales = np.ones((len(translations), joints + extra, 3))
    scales[:, joints:, 2] = np.maximum(lengths / lengths[0], 1e-3)
    return Rig(
        (*motion.names, *(f"{motion.names[a]}_{motion.names[b]}_capsule" for a, b in zip(starts, tails, strict=True))),
        (*motion.parents, *starts),
        np.concatenate([translations, np.zeros_like(offsets)], axis=1),
        steady(np.concatenate([quaternions, _towards(offsets)], axis=1)),
        scales,
        np.concatenate([(parents < 0) | (spread > _STRETCH), np.zeros(extra, bool)]),
        np.arange(joints + extra) >= joints,
        bind,
        figure,
        carriers[figure.bone_of],
    )


def frame_seconds(motion: Motion, times: ArrayLike | None) -> Floats:
    """Return when each frame is shown (F,), in seconds: ``times``, or by the motion's rate where that is None.

    Raises ValueError for times that are not from 0 on or do not rise from frame to frame.
    """
    frames = len(motion.positions)
    given = np.arange(frames) / motion.frame_rate if times is None else times
    seconds: Floats = arrays.floats("times", given, (frames,))
    if (np.diff(seconds) <= 0).any() or (seconds < 0).any():
        raise ValueError("times: want seconds from 0 on that rise from frame to frame")
    return seconds


def steady(quaternions: Floats) -> Floats:
    """Return the same rotations (F, K, 4) with each quaternion in the half sphere of the one before."""
    turned = np.einsum("fkq,fkq->fk", quaternions[1:], quaternions[:-1]) < 0
    signs = np.where(np.cumsum(turned, axis=0) % 2 == 1, -1.0, 1.0)
    return np.concatenate([quaternions[:1], quaternions[1:] * signs[..., None]])


def _local(motion: Motion, parents: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Translations (F, J, 3) and quaternions (F, J, 4) of the joints in their parents' axes."""
    safe, root = np.maximum(parents, 0), (parents < 0)[:, None]
    turn = np.where(root[..., None], np.eye(3), motion.rotations[:, safe])
    offset = motion.positions - np.where(root, 0.0, motion.positions[:, safe])
    local = np.einsum("fjki,fjkl->fjil", turn, motion.rotations)
    return np.einsum("fjki,fjk->fji", turn, offset), _quaternions(local)


def _towards(offsets: Floats) -> Floats:
    """Quaternions (F, K, 4) that turn the z axis to each of ``offsets`` (F, K, 3)."""
    flat = offsets.reshape(-1, 3)
    turns = swing(np.repeat(_UPWARDS, len(flat), axis=0), flat)
    return _quaternions(turns.reshape(*offsets.shape[:2], 3, 3))


def _quaternions(turns: Floats) -> Floats:
    if not turns.size:
        return np.zeros((*turns.shape[:2], 4))
    flat: Floats = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat()
    return flat.reshape(*turns.shape[:2], 4)


def _bind_places(parents: NDArray[np.intp], offsets: Floats) -> Floats:
    """World places (J, 3) of the joints when none is rotated."""
    places = np.full_like(offsets, np.nan)
    while np.isnan(places).any():
        for joint, parent in enumerate(parents):
            places[joint] = offsets[joint] + (0.0 if parent < 0 else places[parent])
    return places
