"""Reads BVH, the motion capture format of most tools."""

from __future__ import annotations

import os

import numpy as np

from pegbar import _kernels
from pegbar.io.motion_bytes import read_bytes, unique
from pegbar.io.recording import Recording


def read_bvh(path: str | os.PathLike[str]) -> Recording:
    """Return the clip of a BVH file with every frame, forward kinematics done.

    Position channels mean the joint's place seen from its parent, instead of ``OFFSET``, on every joint. A joint's
    rotation channels turn it in the order in which they stand: ``Zrotation Xrotation`` is ``Rz Rx`` for columns. End
    sites are no joints; the recording keeps them beside.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Recording
        In the file's unit and axes, about which BVH says nothing.

    Raises
    ------
    FormatError
        For a file that is no BVH, is cut short, or whose counts are wrong; it names the line.
    OSError
        When the file cannot be read.
    """
    hierarchy, (counts, channels, frame_time, values) = _kernels.parse_bvh(os.fspath(path), read_bytes(path))
    raw_names, parents, offsets, end_parents, end_offsets = hierarchy
    joints = (parents, offsets, np.empty((0, 3, 3)), counts, channels)
    positions, rotations = _kernels.forward_kinematics(joints, values, True)
    names, notes = unique(raw_names)
    return Recording(
        path=path,
        names=names,
        parents=tuple(parents),
        offsets=offsets,
        positions=positions,
        rotations=rotations,
        frame_rate=1 / frame_time,
        end_parents=tuple(end_parents),
        end_offsets=end_offsets,
        notes=notes,
    )
