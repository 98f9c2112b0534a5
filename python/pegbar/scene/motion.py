"""A skeleton in motion: joint positions and rotations per frame, in metres, Y up."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.body import MARKERS
from pegbar.scene.clip_report import ClipReport
from pegbar.scene.joints import EXTRA, map_joints
from pegbar.scene.optical import joint_centres

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Motion:
    """A clip with F frames and J joints.

    Attributes
    ----------
    names : tuple of str
        The file's joints; optical points have labels for names.
    parents : tuple of int
        Each joint's parent or -1.
    positions : (F, J, 3) float
        World metres, Y up; missing points are NaN.
    rotations : (F, J, 3, 3) float
        Take joint axes to world axes.
    frame_rate : float
        Frames a second.
    rest_frame : int or None
        Index of an inserted T-pose, which is no part of the movement.
    joints : dict of str to str
        Canonical marker -> joint where the meaning of names is given; "" for none. The rest is found (`joint_map`).
    rest : (J, 3) float, optional
        Joint positions of the rest pose in metres, Y up, for files that have one.
    ends : dict of (3,) float
        The end of a joint's bone where no other joint is, in the joint's axes, metres (BVH end sites).
    report : ClipReport, optional
        What was found about the file's unit, axes, floor and so on when it was read.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: Floats
    rotations: Floats
    frame_rate: float
    rest_frame: int | None = None
    joints: Mapping[str, str] = field(default_factory=dict)
    rest: Floats | None = None
    ends: Mapping[str, Floats] = field(default_factory=dict)
    report: ClipReport | None = None

    @cached_property
    def joint_map(self) -> Mapping[str, str]:
        """Canonical marker -> the file's joint, as given or as `map_joints` finds it."""
        rest = self.rest if self.rest is not None or not len(self.positions) else self.positions[0]
        rest = None if rest is None or not np.isfinite(rest).all() else rest
        found = map_joints(self.names, self.parents, rest=rest) | dict(self.joints)
        return {marker: joint for marker, joint in found.items() if joint}

    @property
    def known_markers(self) -> tuple[str, ...]:
        """The canonical markers and extra ones that `markers` can give."""
        return tuple(name for name in (*MARKERS, *EXTRA) if name in self.joint_map or name in self.derived)

    @cached_property
    def derived(self) -> Mapping[str, Floats]:
        """Canonical markers (F, 3) that are the middle of several optical markers, unless `joints` gives them."""
        if any(parent >= 0 for parent in self.parents):
            return {}
        centres = joint_centres(self.names, self.positions)
        return {marker: points for marker, points in centres.items() if marker not in self.joints}

    def markers(self, names: Sequence[str], *, centres: bool = True) -> Floats:
        """Return the positions (F, N, 3) of joints or canonical markers, in metres.

        A name is first looked for among the file's joints, then among the canonical markers. Of these the head is the
        middle between its joint at the skull's base and the top of the skull, and a hand whose joint is at the wrist
        the middle between it and the farthest finger; optical markers give joint centres by the usual midpoints.

        Parameters
        ----------
        names : sequence of str
            The file's joint names or canonical markers (`pegbar.scene.body.MARKERS`, or collars, wrists and toes).
        centres : bool
            False: canonical markers are the joints of `joint_map` themselves.

        Raises
        ------
        ValueError
            For a name that is neither; it says what there is and which is spelt alike.

        Examples
        --------
        >>> motion = Motion(("Hips", "Spine"), (-1, 0), np.zeros((5, 2, 3)), np.zeros((5, 2, 3, 3)), 24)
        >>> motion.markers(["Spine", "pelvis"]).shape
        (5, 2, 3)
        """
        if isinstance(names, str):
            raise ValueError(f"names: want several names, got the text {names!r}")
        if not len(names):
            return np.empty((len(self.positions), 0, 3))
        return np.stack([self._marker(str(name), centres) for name in names], axis=1)

    def slice(self, start: int | None = None, stop: int | None = None, step: int | None = None) -> Motion:
        """Return every ``step``-th frame from ``start`` up to, but without, ``stop``, counted as in Python slices.

        The frame rate is divided by the step. The rest frame stays marked where it is among the frames kept.

        Raises
        ------
        ValueError
            For a step below 1.
        """
        step = 1 if step is None else step
        if step < 1:
            raise ValueError(f"step: want 1 or more, got {step}")
        kept = list(range(len(self.positions))[start:stop:step])
        return self.changed(
            positions=self.positions[start:stop:step],
            rotations=self.rotations[start:stop:step],
            frame_rate=self.frame_rate / step,
            rest_frame=next((place for place, frame in enumerate(kept) if frame == self.rest_frame), None),
        )

    def changed(self, **fields: Any) -> Motion:
        """Return the motion with other ``fields`` and the same `joint_map`."""
        return dataclasses.replace(self, **fields).knowing(self.joint_map)

    def knowing(self, joint_map: Mapping[str, str]) -> Motion:
        """Return this motion, whose ``joint_map`` is known already and need not be found."""
        self.__dict__["joint_map"] = joint_map
        return self

    def _marker(self, name: str, centres: bool) -> Floats:
        if name in self.names:
            return np.asarray(self.positions[:, self.names.index(name)], np.float64)
        if centres and name in self.derived:
            return self.derived[name]
        joint = self.joint_map.get(name)
        if joint not in self.names:
            raise ValueError(self._unknown(name))
        place = self.names.index(joint)
        kind = name.split("_")[-1]
        if centres and (kind == "head" or (kind == "hand" and self._at_wrist(name, place))):
            half: Floats = np.einsum("fij,j->fi", self.rotations[:, place], self._tip(place)) / 2
            return half + self.positions[:, place]
        return np.asarray(self.positions[:, place], np.float64)

    def _at_wrist(self, hand: str, place: int) -> bool:
        """Whether the forearm ends at the hand's joint."""
        elbow = self.joint_map.get(hand.replace("hand", "elbow"))
        parent = self.parents[place]
        while parent >= 0 and not np.any(self._offset(place, parent)):
            place, parent = parent, self.parents[parent]
        return parent >= 0 and self.names[parent] == elbow

    def _offset(self, joint: int, above: int) -> Floats:
        """Where ``joint`` is in the axes of ``above`` in the first frame, (3,); differences of rounding are 0."""
        apart = self.rotations[0, above].T @ (self.positions[0, joint] - self.positions[0, above])
        return np.where(np.abs(apart).max() > 1e-6, apart, 0.0)

    def _tip(self, joint: int) -> Floats:
        """The farthest point of what hangs on ``joint``, in its axes (3,)."""
        tip, waiting = np.zeros(3), [joint]
        for below in waiting:
            waiting += [child for child, parent in enumerate(self.parents) if parent == below and child not in waiting]
            offset = self._offset(below, joint)
            end = self.ends.get(self.names[below])
            if end is not None:
                offset = offset + self.rotations[0, joint].T @ self.rotations[0, below] @ end
            if np.linalg.norm(offset) > np.linalg.norm(tip):
                tip = offset
        return tip

    def _unknown(self, name: str) -> str:
        canonical = self.known_markers
        alike = difflib.get_close_matches(name.lower(), {known.lower() for known in (*self.names, *canonical)}, 1, 0.5)
        near = next((known for known in (*self.names, *canonical) if [known.lower()] == alike), None)
        hint = f" (did you mean {near!r}?)" if near else ""
        missing = f"the clip has no joint for {name}" if name in (*MARKERS, *EXTRA) else f"no joint is called {name!r}"
        shown = ", ".join(self.names[:40]) + (", ..." if len(self.names) > 40 else "")
        return f"names: {missing}{hint}; there are {shown}; markers {', '.join(canonical) or 'none'}"
