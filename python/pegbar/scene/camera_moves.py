"""The moves of an animation camera: keys of pan, zoom and rotation, and what lies between them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

Track = Literal["pan_x", "pan_y", "zoom", "rotate"]
Ease = Literal["linear", "ease", "hold"]
TRACKS: tuple[Track, ...] = get_args(Track)
EASES: tuple[Ease, ...] = get_args(Ease)
_AT_REST: dict[Track, float] = {"pan_x": 0.0, "pan_y": 0.0, "zoom": 1.0, "rotate": 0.0}
_PATHS: dict[Ease, Callable[[float], float]] = {
    "linear": lambda part: part,
    "ease": lambda part: part * part * (3 - 2 * part),
    "hold": lambda part: 0.0,
}


@dataclass(frozen=True)
class CameraKey:
    """A value at a film frame, and how the camera goes on from it to the next key."""

    frame: int
    value: float
    ease: Ease = "linear"


@dataclass(frozen=True)
class CameraMoves:
    """Keys of each track, frames rising; a track without keys is at rest.

    Before the first key and after the last one the camera stands still. ``linear`` moves evenly to the next key,
    ``ease`` begins and ends softly (3 t^2 - 2 t^3), ``hold`` stays until the next key.

    Examples
    --------
    >>> moves = CameraMoves({"pan_x": (CameraKey(1, 0.0), CameraKey(5, 40.0))})
    >>> moves.at(3)
    {'pan_x': 20.0, 'pan_y': 0.0, 'zoom': 1.0, 'rotate': 0.0}
    """

    tracks: Mapping[Track, tuple[CameraKey, ...]]

    def at(self, frame: int) -> dict[Track, float]:
        """Return the value of every track at film ``frame``."""
        return {track: _value(self.tracks.get(track, ()), frame, rest) for track, rest in _AT_REST.items()}

    @property
    def frames(self) -> tuple[int, ...]:
        """The frames with a key, rising."""
        return tuple(sorted({key.frame for keys in self.tracks.values() for key in keys}))

    def within(self, first: int, last: int) -> CameraMoves:
        """Return the same moves of frames ``first`` to ``last`` with keys in them only: one a frame if need be."""
        if all(first <= frame <= last for frame in self.frames):
            return self
        tracks = {
            track: tuple(CameraKey(frame, self.at(frame)[track]) for frame in range(first, last + 1))
            for track, keys in self.tracks.items()
            if keys
        }
        return CameraMoves(tracks)


def _value(keys: tuple[CameraKey, ...], frame: int, rest: float) -> float:
    if not keys:
        return rest
    place = bisect_right(keys, frame, key=lambda key: key.frame)
    if place in (0, len(keys)):
        return keys[max(place - 1, 0)].value
    before, after = keys[place - 1], keys[place]
    part = _PATHS[before.ease]((frame - before.frame) / (after.frame - before.frame))
    return before.value + part * (after.value - before.value)
