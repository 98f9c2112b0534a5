"""Which side is which: exchanged marks, mirrored motions, mirrored pictures.

Parallel rays cannot tell a figure from its reflection in the picture plane: the view from (azimuth, elevation) is the
mirror image of the view from (azimuth + 180, -elevation). So of the four ways in which a drawing and a clip may differ
in left and right two and two look alike:

* the clip as it is, or: picture mirrored after it was marked (the clip's mirror image, marks exchanged);
* marks exchanged, or: the mirror image of the clip.

What tells them apart is depth: of a pair of which one marker is marked as covered, that one is farther away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pegbar.align.marks import EXCHANGED
from pegbar.scene.body import MARKERS
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
_LEFT = [index for index, name in enumerate(MARKERS) if name.startswith("left_")]
_RIGHT = [MARKERS.index(MARKERS[index].replace("left_", "right_")) for index in _LEFT]
# Metres by which two markers must differ in depth to say something, how often, and how clearly.
_APART, _VOTES, _CLEAR = 0.05, 4, 0.6
# Eighths of a turn to the person's left.
_SEEN_FROM = ("front", "front left", "left", "back left", "back", "back right", "right", "front right")


class Sides(NamedTuple):
    """The view, whether the clip's mirror image is taken, and whether the drawing's marks are exchanged.

    ``told`` says whether covered marks decided between the ways that look alike.
    """

    azimuth: float
    elevation: float
    mirrored: bool
    swapped: bool
    told: bool

    @property
    def words(self) -> str:
        """What to tell people of it."""
        return {
            (False, False): "as marked",
            (False, True): "left and right exchanged",
            (True, False): "mirror image of the clip",
            (True, True): "picture mirrored",
        }[self.mirrored, self.swapped]


def mirror(markers: Floats) -> Floats:
    """The mirror image of canonical markers (..., 16, 3): reflected in x = 0, left and right exchanged."""
    reflected: Floats = markers[..., EXCHANGED, :] * np.array([-1.0, 1.0, 1.0])
    return reflected


def tell_sides(markers: Floats, azimuth: float, elevation: float, exchanged: bool, visible: NDArray[np.bool_]) -> Sides:
    """Return which of the two ways that look alike it is.

    ``markers`` (F, 16, 3) are the clip's where each drawing has it, ``visible`` (F, 16) the drawing's canonical marks
    that are not covered; without covered marks the camera is taken to be level or above.
    """
    seen = markers[:, EXCHANGED] if exchanged else markers
    depth = OrthographicCamera.from_angles(azimuth, elevation).depth(seen)
    farther = depth[:, _LEFT] - depth[:, _RIGHT]
    only_one = (visible[:, _LEFT] != visible[:, _RIGHT]) & (np.abs(farther) > _APART)
    agrees = (farther > 0) == ~visible[:, _LEFT]
    votes, share = int(only_one.sum()), float(agrees[only_one].mean()) if only_one.any() else 0.5
    told = votes >= _VOTES and max(share, 1 - share) >= _CLEAR
    reflected = share < 0.5 if told else exchanged and elevation < 0
    if not reflected:
        return Sides(azimuth, elevation, False, exchanged, told)
    return Sides((180 - azimuth) % 360, -elevation, True, not exchanged, told)


def seen_from(markers: Floats, azimuth: float) -> str:
    """The side of a person, ``markers`` (F, 16, 3), that a camera at ``azimuth`` degrees sees."""
    across = markers[:, _LEFT].mean(axis=1) - markers[:, _RIGHT].mean(axis=1)
    # Facing is left hand cross up, in the horizontal plane; the mean over the frames keeps a turn's middle.
    facing = np.nansum(np.stack([across[:, 2] * -1, across[:, 0]], axis=1), axis=0)
    relative = azimuth - np.degrees(np.arctan2(facing[0], facing[1]))
    return _SEEN_FROM[round(relative / 45) % 8]
