"""What a motion file says, before anything is known of its unit, its up axis or its joints' meaning."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def _no_points() -> Floats:
    return np.empty((0, 3))


@dataclass(frozen=True, eq=False)
class Recording:
    """A clip of F frames and J joints in the file's own unit and axes.

    A joint sits where its bone begins and turns with that bone, in every format: BVH's ``LeftLeg`` and Acclaim's
    ``ltibia`` are both the knee, ``LeftFoot`` and ``lfoot`` the ankle. Where an Acclaim bone has no children, the joint
    ``<bone>_end`` stands at its tip, so that no point is lost (``head_end``, ``ltoes_end``); it turns with its bone.
    Bones that begin in one point have joints in one place (``lhipjoint``, ``rhipjoint`` and ``lowerback`` at the
    ``root``; the CMU conversions to BVH have these too). Points of a C3D file are joints without parents.

    Attributes
    ----------
    path : path
        The file that was read.
    names : tuple of str
        The joints' names, each once.
    parents : tuple of int
        Each joint's parent, which stands before it, or -1.
    offsets : (J, 3) float or None
        The pose at rest, in the file's axes: each joint's place seen from its parent, a root's from the origin. None
        for points.
    positions : (F, J, 3) float
        World positions; NaN where a point is missing.
    rotations : (F, J, 3, 3) float
        From the joint's axes, which at rest are the file's, to the world's; identity for points.
    frame_rate : float or None
        Frames a second; None where the file does not say.
    unit : float or None
        Metres in a unit of the file; None where the file does not say.
    up : {"x", "y", "z", "-x", "-y", "-z"} or None
        The file's up axis; None where it does not say.
    end_parents : tuple of int
        BVH's end sites, which are no joints: the joint that each ends.
    end_offsets : (E, 3) float
        Their places in these joints' axes.
    notes : tuple of str
        What was odd, left out or renamed.
    """

    path: str | os.PathLike[str]
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Floats | None
    positions: Floats
    rotations: Floats
    frame_rate: float | None = None
    unit: float | None = None
    up: str | None = None
    end_parents: tuple[int, ...] = ()
    end_offsets: Floats = field(default_factory=_no_points)
    notes: tuple[str, ...] = ()
