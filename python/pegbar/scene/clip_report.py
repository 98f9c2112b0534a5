"""What was found out about a clip when it was read, or assumed, for people to check."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ClipReport:
    """The conventions of a clip; every one can be given to `read_motion` instead.

    Attributes
    ----------
    unit : float
        Metres in a unit of the file.
    unit_from : str
        Where that is from: "given", "the file", or what the skeleton's size suggests.
    up : str
        The file's up axis: "y", "z", "x" or one of them with a minus. In the motion Y is up.
    up_from : str
        Where that is from: "given", "the file" or "the pose".
    rate_from : str
        Where the frame rate is from: "given", "the file" or "assumed".
    height : float or None
        The person's height in metres, from the lengths of the bones.
    floor : float or None
        Height of the floor in metres, where the feet stand; the data is not moved.
    facing : tuple of float or None
        The azimuth in degrees (0 along +Z, 90 along +X) in which the person faces at first and at last; whole turns
        between count.
    travel : float
        Metres between the first and the last place.
    direction : float or None
        Where to, in degrees to the left of where the person faces; None on the spot.
    missing : tuple of str
        Canonical markers that were not found.
    notes : tuple of str
        What is odd, one sentence each.
    """

    unit: float
    unit_from: str
    up: str
    up_from: str
    rate_from: str
    height: float | None = None
    floor: float | None = None
    facing: tuple[float, float] | None = None
    travel: float = 0.0
    direction: float | None = None
    missing: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def way(self) -> str:
        """The direction of travel in a word."""
        if self.direction is None:
            return "on the spot"
        quarter = round(self.direction / 90) % 4
        return ("forwards", "to the left", "backwards", "to the right")[quarter]
