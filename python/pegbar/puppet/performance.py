"""A puppet performing a clip: its poses, its mesh and what is in front of what, frame by frame (2007 paper, s7)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.asap import AsapShapes
from pegbar.puppet.clip_poses import clip_markers, clip_times, marker_names
from pegbar.puppet.deform import Deformer
from pegbar.puppet.drawn_pose import drawn_pose
from pegbar.puppet.occlusion import Pieces, piece_ranks
from pegbar.puppet.pose_blend import blend_poses, closed_loop, ease
from pegbar.puppet.retarget import body_scale, facing_turn, retarget
from pegbar.puppet.root_path import follow, ground_poses, horizontal_path
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
#: Degrees by which a figure may turn away from its drawn view before the picture no longer shows what would be seen.
PAST_VIEW = 60.0
# Frames deformed at a time.
_BLOCK = 32


@dataclass(frozen=True, kw_only=True)
class Direction:
    """How a clip is performed.

    Attributes
    ----------
    frame_rate : float, optional
        Pictures a second; None: the clip's rate, or the nearest part of it that is not above 30.
    first, last : int, optional
        The clip's frames to begin and end with, counted from 0; None: all but an inserted T-pose.
    keep : {"near", "always", "never"}
        How drawn limbs that point otherwise than the clip's are treated (`pegbar.puppet.retarget.retarget`).
    travel : {"auto", "in-place", "travelling"}
        Whether the figure goes where the clip goes; "auto" where that is less than a step.
    camera : {"still", "following"}
        A following camera goes along with a travelling figure.
    transition : float
        Seconds from the drawn pose to the clip's first one; 0 for none.
    loop : bool
        Cut and blend the movement so that it repeats without a jump.
    inflation : float
        How round the figure is; 0 is flat.
    shapes : {"asap", "arap"}
        Triangles foreshortened with their bones, or kept as drawn.
    """

    frame_rate: float | None = None
    first: int | None = None
    last: int | None = None
    keep: str = "near"
    travel: str = "auto"
    camera: str = "still"
    transition: float = 0.0
    loop: bool = False
    inflation: float = 1.0
    shapes: str = "asap"


@dataclass(frozen=True, eq=False)
class Performance:
    """What `perform` returns: F frames of a puppet in motion.

    ``poses`` (F, J, 3) are world metres as the puppet's camera sees them, ``ranks`` (F, P) the order of `pieces`, 0 the
    farthest, ``shift`` (F, 2) by how many pixels what stands still moves through a following camera's picture, and
    ``notes`` what a user should know.
    """

    puppet: Puppet
    poses: Floats
    ranks: Ints
    pieces: Pieces
    frame_rate: float
    shift: Floats
    notes: tuple[str, ...]
    asap: AsapShapes
    deformer: Deformer
    arap: bool = False

    def __len__(self) -> int:
        return len(self.poses)

    def meshes(self, start: int = 0, stop: int | None = None) -> Iterator[Floats]:
        """Give the vertices (n, 2) of each frame in pixels of the picture."""
        stop = len(self) if stop is None else stop
        for block in range(start, stop, _BLOCK):
            yield from self._deformed(self.poses[block : min(block + _BLOCK, stop)])

    def triangle_depths(self, frame: int) -> Floats:
        """Return a depth (T,) for every triangle in ``frame``: larger is farther, alike within a piece."""
        depths: Floats = -self.ranks[frame][self.pieces.of_triangle].astype(np.float64)
        return depths

    def handles(self, poses: Floats) -> Floats:
        """Return where (F, h, 2) the handles are in ``poses`` (F, J, 3)."""
        return handle_points(self.puppet, poses) + self._off_bone

    @property
    def _off_bone(self) -> Floats:
        """How far (h, 2) handles lie beside their bones as drawn: mesh vertices are not exactly on them."""
        rest = drawn_pose(self.puppet)
        return self.puppet.vertices[self.puppet.handles] - handle_points(self.puppet, rest[None])[0]

    def _deformed(self, poses: Floats) -> Floats:
        if self.arap:
            return self.deformer.deform_many(self.handles(poses))
        shapes = self.asap.shapes(poses)[:, self.puppet.triangles]
        return self.deformer.deform_many(self.handles(poses), shapes=shapes)


def handle_points(puppet: Puppet, poses: Floats) -> Floats:
    """Return the pixels (F, h, 2) of the points on the bones of ``poses`` (F, J, 3) that handles stand for."""
    parents, children = puppet.bones[puppet.handle_bone].T
    share = puppet.handle_fraction[:, None]
    return puppet.camera.project(poses[:, parents] * (1 - share) + poses[:, children] * share)


def perform(puppet: Puppet, motion: Motion, direction: Direction | None = None) -> Performance:
    """Move a puppet as a clip moves.

    Parameters
    ----------
    puppet : Puppet
        Made with this clip (`make_puppet`), which set its camera.
    motion : Motion
    direction : Direction, optional

    Returns
    -------
    Performance

    Raises
    ------
    ValueError
        For options that are none, or a range of frames that the clip has not.
    DegenerateError
        For joints that are missing throughout the clip, or a figure that walks into the camera.
    """
    direction = direction or Direction()
    rest = drawn_pose(puppet)
    times, rate = clip_times(motion, direction.first, direction.last, direction.frame_rate)
    markers, reference = clip_markers(puppet, motion, times), clip_markers(puppet, motion, [puppet.pose_frame])[0]
    scale = body_scale(puppet, rest, reference)
    poses = retarget(puppet, rest, markers, reference, keep=direction.keep)
    poses = ground_poses(poses, markers, rest, reference, scale)
    root = int(np.flatnonzero(puppet.parents < 0)[0])
    way = horizontal_path(markers[:, root], reference[root], scale, direction.travel)
    notes = [*_turned_notes(puppet, markers, reference, times)]
    if direction.loop:
        poses, length = closed_loop(puppet.bones, poses, rate)
        way = way[:length]
    poses, way = _with_transition(puppet, rest, poses, way, round(direction.transition * rate))
    gone = follow(way, rate) if direction.camera == "following" else np.zeros_like(way)
    poses = poses + (way - gone)[:, None]
    home = puppet.camera.project(rest[root])
    shift = puppet.camera.project(rest[root] - gone) - home
    pieces = Pieces.of_puppet(puppet)
    ranks = piece_ranks(pieces, puppet.bones, puppet.camera, poses)
    return Performance(
        puppet=puppet,
        poses=poses,
        ranks=ranks,
        pieces=pieces,
        frame_rate=rate,
        shift=shift,
        notes=tuple(notes),
        asap=AsapShapes.of_puppet(puppet, rest, inflation=direction.inflation),
        deformer=Deformer(puppet.vertices, puppet.triangles, puppet.handles),
        arap=direction.shapes == "arap",
    )


def _with_transition(puppet: Puppet, rest: Floats, poses: Floats, way: Floats, count: int) -> tuple[Floats, Floats]:
    """The poses and the way with ``count`` frames before them that lead there from the drawn pose."""
    if count < 1:
        return poses, way
    shares = ease(count)
    before = blend_poses(puppet.bones, rest, poses[0], shares)
    arrival = shares[:, None] * way[0]
    return np.concatenate([rest[None], before, poses]), np.concatenate([0 * way[:1], arrival, way])


def _turned_notes(puppet: Puppet, markers: Floats, reference: Floats, times: Floats) -> Iterator[str]:
    """What to say of a clip that turns the figure past what the picture shows."""
    turned = np.abs(facing_turn(puppet, markers, reference))
    past = np.flatnonzero(turned > PAST_VIEW)
    if len(past):
        first, last = times[past[0]], times[past[-1]]
        yield (
            f"the clip turns the figure {turned.max():.0f} degrees away from the drawn view (frames {first:.0f} to "
            f"{last:.0f}): the picture shows only one side of it"
        )
