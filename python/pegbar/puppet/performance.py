"""A puppet performing a clip: its poses, its mesh and what is in front of what, frame by frame (2007 paper, s7)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.asap import AsapShapes
from pegbar.puppet.clip_poses import clip_markers, clip_times, continued
from pegbar.puppet.deform import Deformer
from pegbar.puppet.drawn_pose import drawn_pose
from pegbar.puppet.extremities import Extremities
from pegbar.puppet.feet import STANDS, lock_feet, standing_feet, standing_legs
from pegbar.puppet.occlusion import Pieces, piece_ranks
from pegbar.puppet.pose_blend import blend_poses, closed_loop, ease
from pegbar.puppet.retarget import body_scale, facing_turn, retarget
from pegbar.puppet.root_path import follow, ground_poses, horizontal_path
from pegbar.puppet.turning import shown_turn, turned_markers
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
#: Degrees by which a figure may turn away from its drawn view before the picture no longer shows what would be seen.
PAST_VIEW = 60.0
#: Cameras, and ways to deform, that `Direction` knows.
CAMERAS, SHAPES = ("still", "following"), ("asap", "arap")
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
    feet : {"locked", "free"}
        Whether feet that stand in the clip keep their place on the ground (`pegbar.puppet.feet`).
    travel : {"auto", "in-place", "travelling"}
        Whether the figure goes where the clip goes; "auto" where that is less than a step.
    camera : {"still", "following"}
        A following camera goes along with a travelling figure.
    transition : float
        Seconds from the drawn pose to the clip's first one; 0 for none.
    between : float
        Seconds from one clip's last pose to the next one's first.
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
    feet: str = "locked"
    travel: str = "auto"
    camera: str = "still"
    transition: float = 0.0
    between: float = 0.3
    loop: bool = False
    inflation: float = 0.5
    shapes: str = "asap"


@dataclass(frozen=True, eq=False)
class Performance:
    """What `perform` returns: F frames of a puppet in motion.

    Attributes
    ----------
    puppet : Puppet
    poses : (F, J, 3) float
        World metres, as the puppet's camera sees them.
    meshes : (F, n, 2) float
        The puppet's vertices in pixels of its picture.
    pieces : Pieces
    ranks : (F, P) int
        The order of the pieces, 0 the farthest.
    frame_rate : float
    shift : (F, 2) float
        By how many pixels what stands still moves through a following camera's picture.
    notes : tuple of str
        What a user should know.
    """

    puppet: Puppet
    poses: Floats
    meshes: Floats
    pieces: Pieces
    ranks: Ints
    frame_rate: float
    shift: Floats
    notes: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.poses)

    def triangle_depths(self, frame: int) -> Floats:
        """Return a depth (T,) for every triangle in ``frame``: larger is farther, alike within a piece."""
        depths: Floats = -self.ranks[frame][self.pieces.of_triangle].astype(np.float64)
        return depths


def perform(puppet: Puppet, motion: Motion | Sequence[Motion], direction: Direction | None = None) -> Performance:
    """Move a puppet as a clip moves.

    Parameters
    ----------
    puppet : Puppet
        Made with this clip (`make_puppet`), which set its camera.
    motion : Motion or sequence of Motion
        Several are performed one after another; the puppet was made with the first.
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
    for name, known in (("camera", CAMERAS), ("shapes", SHAPES), ("feet", STANDS)):
        if getattr(direction, name) not in known:
            raise ValueError(f"direction: want {name} of {', '.join(known)}, got {getattr(direction, name)!r}")
    rest = drawn_pose(puppet)
    motions = (motion,) if isinstance(motion, Motion) else tuple(motion)
    poses, way, rate, notes = _joined(puppet, rest, motions, direction)
    if direction.loop:
        poses, length = closed_loop(puppet.bones, poses, rate)
        way = way[:length]
    count = round(direction.transition * rate)
    if count > 0:
        poses = np.concatenate([_between(puppet, rest, poses[0], count), poses])
        way = np.concatenate([np.append(ease(count), 1.0)[:, None] * way[0], way])
    gone = follow(way, rate) if direction.camera == "following" else np.zeros_like(way)
    poses = poses + (way - gone)[:, None]
    root = root_joint(puppet)
    pieces = Pieces.of_puppet(puppet)
    return Performance(
        puppet=puppet,
        poses=poses,
        meshes=deformed_meshes(puppet, rest, poses, direction),
        pieces=pieces,
        ranks=piece_ranks(pieces, puppet.bones, puppet.camera, poses),
        frame_rate=rate,
        shift=puppet.camera.project(rest[root] - gone) - puppet.camera.project(rest[root]),
        notes=notes,
    )


def deformed_meshes(puppet: Puppet, rest: Floats, poses: Floats, direction: Direction) -> Floats:
    """Return the mesh (F, n, 2) in ``poses`` (F, J, 3); as drawn it shows the pose ``rest`` (J, 3)."""
    ends = Extremities.of_puppet(puppet)
    puppet = ends.puppet
    rest, poses = ends.extended(rest, poses)
    deformer = Deformer(puppet.vertices, puppet.triangles, puppet.handles)
    asap = AsapShapes.of_puppet(puppet, rest, inflation=direction.inflation)
    # Mesh vertices are not exactly on the bones.
    beside = puppet.vertices[puppet.handles] - handle_points(puppet, rest[None])[0]
    meshes = np.empty((len(poses), len(puppet.vertices), 2))
    for start in range(0, len(poses), _BLOCK):
        block = poses[start : start + _BLOCK]
        shapes = asap.shapes(block)[:, puppet.triangles] if direction.shapes == "asap" else None
        meshes[start : start + _BLOCK] = deformer.deform_many(handle_points(puppet, block) + beside, shapes=shapes)
    return meshes


def handle_points(puppet: Puppet, poses: Floats) -> Floats:
    """Return the pixels (F, h, 2) of the points on the bones of ``poses`` (F, J, 3) that handles stand for."""
    parents, children = puppet.bones[puppet.handle_bone].T
    share = puppet.handle_fraction[:, None]
    return puppet.camera.project(poses[:, parents] * (1 - share) + poses[:, children] * share)


def root_joint(puppet: Puppet) -> int:
    """The joint that hangs on no other."""
    return int(np.flatnonzero(puppet.parents < 0)[0])


def _joined(
    puppet: Puppet, rest: Floats, motions: Sequence[Motion], direction: Direction
) -> tuple[Floats, Floats, float, tuple[str, ...]]:
    """Poses (F, J, 3) over the drawn place, the way (F, 3) from there, the rate, and notes, of clips in a row."""
    if not motions:
        raise ValueError("motion: want at least one clip")
    if len(motions) > 1 and (direction.first, direction.last) != (None, None):
        raise ValueError("frames: want a range for one clip only, got several clips")
    reference = clip_markers(puppet, motions[0], [puppet.pose_frame])[0]
    scale, root = body_scale(puppet, rest, reference), root_joint(puppet)
    rate = clip_times(motions[0], direction.first, direction.last, direction.frame_rate)[1]
    poses: list[Floats] = []
    ways: list[Floats] = []
    notes: list[str] = []
    before: Floats | None = None
    for motion in motions:
        times, _ = clip_times(motion, direction.first, direction.last, rate)
        markers = clip_markers(puppet, motion, times)
        markers = markers if before is None else continued(puppet, markers, before)
        turned = facing_turn(puppet, markers, reference)
        notes += _turned_notes(turned, times)
        if puppet.fitted:
            anchor = int(np.abs(times - puppet.pose_frame).argmin())
            markers = turned_markers(markers, shown_turn(turned, rate) - turned, root, anchor)
        own = _on_the_ground(puppet, rest, motion, markers, reference, times, rate, direction)
        way = horizontal_path(markers[:, root], reference[root], scale, direction.travel)
        if before is not None:
            way = way - way[0] + ways[-1][-1]
            poses.append(_between(puppet, poses[-1][-1], own[0], round(direction.between * rate))[1:])
            ways.append(np.repeat(way[:1], len(poses[-1]), axis=0))
        poses.append(own)
        ways.append(way)
        before = markers
    return np.concatenate(poses), np.concatenate(ways), rate, tuple(dict.fromkeys(notes))


def _on_the_ground(
    puppet: Puppet,
    rest: Floats,
    motion: Motion,
    markers: Floats,
    reference: Floats,
    times: Floats,
    rate: float,
    direction: Direction,
) -> Floats:
    """The drawn figure (F, J, 3) in a clip's poses, standing on the floor, its root over where it was drawn."""
    own, scale = retarget(puppet, rest, markers, reference, keep=direction.keep), body_scale(puppet, rest, reference)
    # With "always" legs are as they are drawn, feet with them.
    locked = direction.feet == "locked" and direction.keep != "always" and standing_legs(puppet)
    stands = standing_feet(motion) if locked else None
    if stands is None:
        return ground_poses(own, markers, rest, reference, scale)
    root = root_joint(puppet)
    return lock_feet(
        puppet,
        own,
        markers,
        rest,
        reference,
        contacts=stands[np.rint(times).astype(int)],
        path=horizontal_path(markers[:, root], reference[root], scale, "travelling"),
        frame_rate=rate,
    )


def _between(puppet: Puppet, first: Floats, second: Floats, count: int) -> Floats:
    """``count`` poses and one from ``first`` up to, but without, ``second``."""
    return np.concatenate([first[None], blend_poses(puppet.bones, first, second, ease(count))])


def _turned_notes(turned: Floats, times: Floats) -> Iterator[str]:
    """What to say of a clip that turns the figure past what the picture shows."""
    past = np.flatnonzero(np.abs(turned) > PAST_VIEW)
    if len(past):
        first, last = times[past[0]], times[past[-1]]
        yield (
            f"the clip turns the figure {np.abs(turned).max():.0f} degrees away from the drawn view (frames "
            f"{first:.0f} to {last:.0f}): the picture shows only one side of it, so it turns less"
        )
