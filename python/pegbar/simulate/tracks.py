"""Where volumes and pins are at any time: the drawn frames, the pre-roll before them, and the motion between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.elements import Pin, Prop
from pegbar.simulate.scene import Character, SimulationScene

Floats = NDArray[np.float64]


def filled(track: Floats) -> Floats:
    """Return ``track`` (F, ...) with NaN filled over time: linearly between known frames, held before and after.

    What is NaN in all frames stays so.
    """
    flat = track.reshape(len(track), -1).copy()
    frames = np.arange(len(flat))
    for column in np.flatnonzero(np.isnan(flat).any(axis=0)):
        known = ~np.isnan(flat[:, column])
        if known.any():
            flat[:, column] = np.interp(frames, frames[known], flat[known, column])
    whole: Floats = flat.reshape(track.shape)
    return whole


def at_times(track: Floats, times: Floats) -> Floats:
    """Return ``track`` (F, ...) at ``times`` (S,) in frames, by cubics through the frames; held outside.

    The slope at a frame is that between its neighbours (Catmull and Rom), limited so that nothing overshoots.
    """
    last = len(track) - 1
    place = np.clip(times, 0, last)
    index = np.minimum(place.astype(int), max(last - 1, 0))
    share = (place - index).reshape(-1, *[1] * (track.ndim - 1))
    # Slopes of the frames around the times: those of a long shot's whole track would make each of its frames slower.
    first = max(int(index.min(initial=last)) - 1, 0)
    track = track[first : int(index.max(initial=0)) + 3]
    index, last = index - first, last - first
    padded = np.concatenate([track[:1], track, track[-1:]])
    steps = np.diff(padded, axis=0)
    slopes = np.where(steps[:-1] * steps[1:] > 0, (steps[:-1] + steps[1:]) / 2, 0.0)
    slopes = np.sign(slopes) * np.minimum(np.abs(slopes), 3 * np.minimum(np.abs(steps[:-1]), np.abs(steps[1:])))
    after = np.minimum(index + 1, last)
    a, b, before, behind = track[index], track[after], slopes[index], slopes[after]
    rest = 1 - share
    values: Floats = rest**2 * ((1 + 2 * share) * a + share * before) + share**2 * ((3 - 2 * share) * b - rest * behind)
    return values


class Volumes:
    """All capsules of a scene over time: the characters' limbs and the props."""

    def __init__(self, scene: SimulationScene, props: Sequence[Prop]) -> None:
        rows = [_limb_rows(character) for character in scene.characters]
        rows += [_prop_rows(scene, prop) for prop in props]
        empty = np.empty((scene.frames, 0, 8))
        rows_of_all = np.concatenate([empty, *rows], axis=1)
        #: Which of all limbs and props' capsules, in their order, are known; the others push nothing.
        self.known = np.flatnonzero(~np.isnan(rows_of_all).any(axis=(0, 2)))
        self.rows = rows_of_all[:, self.known]
        self._pre_roll = scene.pre_roll

    def at(self, times: Floats) -> Floats:
        """Return the capsules (S, C, 8) at ``times`` (S,) in frames, negative in the pre-roll.

        A row is the start (3) and its radius, the end (3) and its radius.
        """
        rows: Floats = at_times(self.rows, times)
        if self._pre_roll.blend:
            grown = np.clip((times + self._pre_roll.frames) / self._pre_roll.blend, 0, 1)
            rows[..., 3::4] *= (grown**2 * (3 - 2 * grown))[:, None, None]
        return rows


def pin_track(scene: SimulationScene, pin: Pin, vertices: Floats) -> Floats:
    """Return where ``pin`` holds ``vertices`` (p, 3), given before the first frame, in every frame: (F, p, 3)."""
    if pin.kind == "world":
        return np.repeat(vertices[None], scene.frames, axis=0)
    if pin.path is not None:
        led: Floats = vertices @ pin.path[..., :3].transpose(0, 2, 1) + pin.path[:, None, :, 3]
        return led
    character = scene.character(pin.character)
    if pin.kind == "marker":
        marker = filled(character.markers[:, character.marker_names.index(pin.target)])
        moved: Floats = vertices + (marker - marker[0])[:, None]
        return moved
    origin, axes, lengths = limb_frames(character, pin.target)
    local = np.einsum("fij,fpi->fpj", axes[:1], vertices - origin[:1, None])[0]
    scaled = local * (lengths / lengths[0])[:, None]
    held: Floats = origin[:, None] + np.einsum("fij,fpj->fpi", axes, scaled)
    return held


def limb_frames(character: Character, limb: str) -> tuple[Floats, Floats, Floats]:
    """Return a limb's origin (F, 3), its axes as columns (F, 3, 3), and its sizes (F, 3) along these axes.

    The second axis runs along the limb. The others are carried from frame to frame without twist; at a limb of the
    trunk they follow the hips' or shoulders' line. Sizes are the mean radius, the length, the mean radius.
    """
    index = character.limb_names.index(limb)
    volumes = character.volumes
    start, end = filled(volumes.start[:, index]), filled(volumes.end[:, index])
    radius = filled((volumes.start_radius[:, index] + volumes.end_radius[:, index]) / 2)
    length = np.linalg.norm(end - start, axis=1)
    sizes = np.stack([np.maximum(radius, 1e-6), np.maximum(length, 1e-6), np.maximum(radius, 1e-6)], axis=1)
    along = _directions(end - start)
    side = _side(character, index)
    return start, _carried(along) if side is None else _aligned(along, side), sizes


def _limb_rows(character: Character) -> Floats:
    volumes = character.volumes
    parts = (volumes.start, volumes.start_radius[..., None], volumes.end, volumes.end_radius[..., None])
    return filled(np.concatenate(parts, axis=2))


def _prop_rows(scene: SimulationScene, prop: Prop) -> Floats:
    ends = prop.capsules.reshape(-1, 2, 4)
    held = pin_track(scene, prop.pin, ends[..., :3].reshape(-1, 3)).reshape(scene.frames, -1, 2, 3)
    radii = np.broadcast_to(ends[None, ..., 3:], (*held.shape[:3], 1))
    return np.concatenate([held, radii], axis=3).reshape(scene.frames, -1, 8)


def _directions(vectors: Floats) -> Floats:
    """Unit vectors (F, 3); a vector of no length takes the direction before it, at first straight up."""
    out, last = np.empty_like(vectors), np.array([0.0, 1.0, 0.0])
    for frame, vector in enumerate(vectors):
        length = float(np.linalg.norm(vector))
        last = vector / length if length > 1e-9 else last
        out[frame] = last
    return out


def _side(character: Character, limb: int) -> Floats | None:
    """The line (F, 3) that turns with a limb of the trunk: from the right to the left hip, or shoulder."""
    names = character.marker_names
    ends = character.limb_markers[limb] if character.limb_markers else ()
    if not {"pelvis", "chest", "neck"} & set(ends) and character.limb_names[limb] not in ("torso", "pelvis", "waist"):
        return None
    for joint in ("hip", "shoulder"):
        if f"left_{joint}" in names and f"right_{joint}" in names:
            left, right = (filled(character.markers[:, names.index(f"{s}_{joint}")]) for s in ("left", "right"))
            if np.isfinite(left).all() and np.isfinite(right).all():
                return left - right
    return None


def _carried(along: Floats) -> Floats:
    """Axes (F, 3, 3) whose second column is ``along`` (F, 3), turned from frame to frame by the smallest rotation."""
    side = np.cross(along[0], (0.0, 0.0, 1.0) if abs(along[0, 2]) < 0.9 else (1.0, 0.0, 0.0))
    axes = np.empty((len(along), 3, 3))
    for frame, direction in enumerate(along):
        side = side - (side @ direction) * direction
        side /= max(float(np.linalg.norm(side)), 1e-12)
        axes[frame] = np.stack([side, direction, np.cross(side, direction)], axis=1)
    return axes


def _aligned(along: Floats, side: Floats) -> Floats:
    """Axes (F, 3, 3) whose second column is ``along`` and whose first is as near to ``side`` (F, 3) as can be."""
    across = _directions(side - np.einsum("fi,fi->f", side, along)[:, None] * along)
    return np.stack([across, along, np.cross(across, along)], axis=2)
