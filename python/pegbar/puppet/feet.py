"""Feet that stand where the clip's feet stand: a drawn figure's legs have other lengths, so its feet would slide.

A foot that stands in the clip (`pegbar.scene.contacts`) is held at one place of the ground, the body is as high as the
clip's, and legs of two bones reach for their feet: the knee bends in the plane in which it is bent. Between steps what
a foot is moved by changes smoothly. Where the figure stays in place the ground moves under it as fast as the clip goes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, label, maximum_filter1d

from pegbar.puppet.drawn_pose import moved_bones
from pegbar.puppet.retarget import body_scale, facing_turn
from pegbar.scene.contacts import BEGIN, FEET, foot_contacts
from pegbar.scene.gait import facing
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: What feet do that stand in the clip.
STANDS = ("locked", "free")
#: A leg is stretched to this part of its length at most: beyond, the knee would snap.
_STRETCH = 0.998
#: One foot stands higher than the other by this part of the figure's height at most.
_TILT = 0.06
#: Seconds over which the body sinks so that both feet are reached.
_SINKING = 0.3


@dataclass(frozen=True)
class Leg:
    """The joints of a leg of two bones, ``hip``, ``knee`` and ``foot``, and which of `FEET` drives it."""

    hip: int
    knee: int
    foot: int
    side: int


def standing_legs(puppet: Puppet) -> tuple[Leg, ...]:
    """The legs that feet of a clip drive; none for figures that are as drawn, like animals."""
    if not puppet.fitted:
        return ()
    drives = {puppet.drives.get(name): joint for joint, name in enumerate(puppet.names)}
    moved = {int(child) for (_, child), turned in zip(puppet.bones, moved_bones(puppet), strict=True) if turned}
    legs = []
    for side, marker in enumerate(FEET):
        foot = drives.get(marker, -1)
        knee = int(puppet.parents[foot]) if foot >= 0 else -1
        hip = int(puppet.parents[knee]) if knee >= 0 else -1
        if hip >= 0 and {foot, knee} <= moved:
            legs.append(Leg(hip, knee, foot, side))
    return tuple(legs)


def standing_feet(motion: Motion) -> Flags | None:
    """Which feet stand on the ground (F, 2) in the frames of a clip; None for a clip without feet."""
    if any(foot not in motion.known_markers for foot in FEET):
        return None
    return foot_contacts(motion.markers(FEET), FEET, motion.frame_rate)


def lock_feet(
    puppet: Puppet,
    poses: Floats,
    clip: Floats,
    drawn: Floats,
    reference: Floats,
    *,
    contacts: Flags,
    path: Floats,
    frame_rate: float,
) -> Floats:
    """Return poses (F, J, 3) whose feet stand still where the clip's do.

    Parameters
    ----------
    puppet : Puppet
    poses : (F, J, 3) float
        The figure as `pegbar.puppet.retarget.retarget` has it, the root where it was drawn.
    clip : (F, J, 3) float
        The clip's markers, world metres, y up.
    drawn, reference : (J, 3) float
        The drawn figure in 3D, and the clip's pose that it was recognised in.
    contacts : (F, 2) bool
        Which foot stands, left and right.
    path : (F, 3) float
        How far the ground goes by under the figure, in its scale.
    frame_rate : float
    """
    legs, scale = standing_legs(puppet), body_scale(puppet, drawn, reference)
    floor = float(drawn[:, 1].min() - scale * np.nanmin(reference[:, 1]))
    feet = [leg.foot for leg in legs]
    hips = [leg.hip for leg in legs]
    # Feet that stand in the reference are as high there as they are drawn.
    standing = np.array([_stands(reference[leg.foot, 1], clip[contacts[:, leg.side], leg.foot, 1]) for leg in legs])
    raised = standing * (drawn[feet, 1] - floor - scale * reference[feet, 1])
    raised = np.maximum(raised, raised.min(initial=0) + _uneven(poses, legs, drawn))
    height = scale * clip[:, hips, 1].mean(axis=1) - poses[:, hips, 1].mean(axis=1)
    if standing.any():
        height += drawn[hips, 1].mean() - floor - scale * float(reference[hips, 1].mean())
    result: Floats = poses + (floor + height)[:, None, None] * np.array([0.0, 1.0, 0.0])
    # Parts of the body that lie on the ground do not sink into it.
    others = np.setdiff1d(np.arange(poses.shape[1]), [joint for leg in legs for joint in (leg.knee, leg.foot)])
    result[..., 1] += np.maximum(floor - result[:, others, 1].min(axis=1), 0)[:, None]
    targets = _steps(puppet, poses, clip, reference, feet, scale)
    targets[..., 1] = floor + scale * clip[:, feet, 1] + raised
    for place, leg in enumerate(legs):
        targets[:, place] += held(targets[:, place] + path, contacts[:, leg.side])
    result[..., 1] += _rising(poses, result, legs, targets, contacts, frame_rate)[:, None]
    result[..., 1] -= _sinking(puppet, result, legs, targets, drawn, frame_rate)[:, None]
    for place, leg in enumerate(legs):
        _reach(result, leg, targets[:, place], drawn)
    return result


def _stands(height: float, standing: Floats) -> bool:
    """Whether an ankle at ``height`` is as low as it is where it stands (F,)."""
    return bool(len(standing)) and bool(height < np.median(standing) + BEGIN[1])


def _uneven(poses: Floats, legs: tuple[Leg, ...], drawn: Floats) -> Floats:
    """How much higher each foot stands (L,) than the lowest: drawn hips are tilted, and one leg is longer.

    On level ground the other knee would be bent in all poses.
    """
    reach = np.array([poses[:, leg.hip, 1].mean() - sum(_lengths(leg, drawn)) for leg in legs])
    higher: Floats = np.minimum(reach - reach.min(initial=np.inf), _TILT * np.ptp(drawn[:, 1]))
    return higher


def _steps(puppet: Puppet, poses: Floats, clip: Floats, reference: Floats, feet: list[int], scale: float) -> Floats:
    """Where feet (F, L, 3) go in the clip, as seen from the body and in the figure's scale.

    They are as much farther apart, sideways, as the retargeted ones are on the whole. How far one is before the other
    in the drawn pose is no part of how the figure walks.
    """
    root = int(np.flatnonzero(puppet.parents < 0)[0])
    places = poses[:, [root]] + scale * (clip[:, feet] - clip[:, [root]])
    azimuth = np.radians(_facing(puppet, reference) + facing_turn(puppet, clip, reference))
    aside = np.stack([np.cos(azimuth), np.zeros_like(azimuth), -np.sin(azimuth)], axis=1)
    for place, foot in enumerate(feet):
        apart = ((poses[:, foot] - places[:, place]) * aside).sum(axis=1).mean()
        places[:, place] += apart * aside
    moved: Floats = places
    return moved


def _facing(puppet: Puppet, reference: Floats) -> float:
    """The azimuth in degrees in which the clip's person faces in ``reference`` (J, 3); 0 where nothing tells."""
    driven = {puppet.drives[name]: joint for joint, name in enumerate(puppet.names) if name in puppet.drives}
    azimuths = facing({name: reference[None, joint] for name, joint in driven.items()})
    return 0.0 if azimuths is None else float(np.nan_to_num(azimuths[0]))


def held(places: Floats, stands: Flags) -> Floats:
    """Return by what (F, 3) a foot at ``places`` (F, 3) is moved so that it keeps its place in each run of ``stands``.

    The place is the middle of those of the run; between runs the movement eases from one to the next.
    """
    runs, count = label(stands)
    moves = np.zeros_like(places)
    for run in range(1, count + 1):
        own = runs == run
        moves[own] = np.median(places[own], axis=0) - places[own]
    known = np.flatnonzero(stands)
    if not len(known):
        return moves
    frames = np.arange(len(places))
    after = np.searchsorted(known, frames).clip(0, len(known) - 1)
    before = (np.searchsorted(known, frames, side="right") - 1).clip(0)
    first, second = known[before], known[after]
    share = ((frames - first) / np.maximum(second - first, 1)).clip(0, 1)
    share = (share * share * (3 - 2 * share))[:, None]
    eased: Floats = moves[first] * (1 - share) + moves[second] * share
    return eased


def _rising(
    free: Floats, poses: Floats, legs: tuple[Leg, ...], targets: Floats, contacts: Flags, frame_rate: float
) -> Floats:
    """How far (F,) the body rises so that the leg it stands on is as straight as in the poses ``free`` (F, J, 3).

    The drawn legs may be drawn bent, or one longer than the other: at the clip's height knees would bend that do not in
    the clip. Where no foot stands it rises by what lies between.
    """
    lifts = np.full((len(poses), len(legs)), np.inf)
    for place, leg in enumerate(legs):
        gap = poses[:, leg.hip] - targets[:, place]
        length = np.linalg.norm(free[:, leg.hip] - free[:, leg.foot], axis=1)
        upright = np.sqrt(np.maximum(length**2 - gap[:, 0] ** 2 - gap[:, 2] ** 2, 0))
        lifts[:, place] = np.where(contacts[:, leg.side], upright - gap[:, 1], np.inf)
    wanted = lifts.min(axis=1)
    known = np.flatnonzero(np.isfinite(wanted))
    if not len(known):
        return np.zeros(len(poses))
    filled = np.interp(np.arange(len(poses)), known, wanted[known])
    smooth: Floats = gaussian_filter1d(np.maximum(filled, 0), _SINKING * frame_rate / 3, mode="nearest")
    return smooth


def _sinking(
    puppet: Puppet, poses: Floats, legs: tuple[Leg, ...], targets: Floats, drawn: Floats, frame_rate: float
) -> Floats:
    """How far (F,) the body sinks so that its legs are long enough."""
    needed = np.zeros(len(poses))
    for place, leg in enumerate(legs):
        length = _STRETCH * sum(_lengths(leg, drawn))
        gap = poses[:, leg.hip] - targets[:, place]
        level = np.hypot(gap[:, 0], gap[:, 2]).clip(0, length)
        needed = np.maximum(needed, gap[:, 1] - np.sqrt(length**2 - level**2))
    # As deep as it must be around each frame, then smooth: never less than what is needed there.
    reach = max(1, round(_SINKING * frame_rate))
    widest = maximum_filter1d(needed, 2 * reach + 1, mode="nearest")
    smooth: Floats = gaussian_filter1d(widest, reach / 3, mode="nearest", radius=reach)
    return smooth


def _reach(poses: Floats, leg: Leg, targets: Floats, drawn: Floats) -> None:
    """Turn a leg's two bones, in place, so that its foot is at ``targets`` (F, 3), or as near as it gets."""
    thigh, shin = _lengths(leg, drawn)
    hip, knee, foot = (poses[:, joint] for joint in (leg.hip, leg.knee, leg.foot))
    line = targets - hip
    far = np.linalg.norm(line, axis=1)
    far_enough = far.clip(abs(thigh - shin) + 1e-6, _STRETCH * (thigh + shin))
    along = line / np.maximum(far, 1e-9)[:, None]
    # The knee goes where it is bent to: off the line from hip to foot, turned along with the leg.
    bent = _off(knee - hip, _unit(foot - hip))
    bent = _off(bent, along)
    size = np.linalg.norm(bent, axis=1)
    bent = np.where((size > 1e-6)[:, None], bent / np.maximum(size, 1e-9)[:, None], _across(along))
    share = (thigh**2 - shin**2 + far_enough**2) / (2 * far_enough)
    out = np.sqrt(np.maximum(thigh**2 - share**2, 0))
    poses[:, leg.knee] = hip + share[:, None] * along + out[:, None] * bent
    poses[:, leg.foot] = hip + far_enough[:, None] * along


def _lengths(leg: Leg, drawn: Floats) -> tuple[float, float]:
    return (
        float(np.linalg.norm(drawn[leg.knee] - drawn[leg.hip])),
        float(np.linalg.norm(drawn[leg.foot] - drawn[leg.knee])),
    )


def _off(vectors: Floats, axes: Floats) -> Floats:
    """The part of vectors (F, 3) that is square to unit ``axes`` (F, 3)."""
    square: Floats = vectors - (vectors * axes).sum(axis=1)[:, None] * axes
    return square


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-9)[:, None]
    return unit


def _across(axes: Floats) -> Floats:
    """Unit vectors (F, 3) square to unit ``axes`` (F, 3)."""
    helper = np.where((np.abs(axes[:, 2]) < 0.9)[:, None], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    return _unit(_off(helper, axes))
