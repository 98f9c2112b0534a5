"""What elements are pushed by, substep by substep: limbs, props, balls, and the sheets that were simulated before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Balls, Cloth, Prop
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes

Floats = NDArray[np.float64]


class Colliders:
    """The capsules of a scene at ``substeps`` a frame, balls included, and the triangles of its cloth and props."""

    def __init__(self, scene: SimulationScene, cache: Cache, substeps: int) -> None:
        self.substeps = substeps
        self._cache = cache
        self._volumes = Volumes(scene, [element for element in scene.elements if isinstance(element, Prop)])
        self._balls = [element for element in scene.elements if isinstance(element, Balls)]
        self._sheets = [element for element in scene.elements if isinstance(element, Cloth | Prop)]
        # The last frame of what was simulated before. To list a long cache's files for every frame would take long.
        there = {element.name: cache.frames(element.name) for element in (*self._balls, *self._sheets)}
        self._last = {name: frames[-1] for name, frames in there.items() if frames}
        offsets = np.cumsum([0, *(len(sheet.vertices) for sheet in self._sheets)])
        parts = [sheet.triangles + offset for sheet, offset in zip(self._sheets, offsets, strict=False)]
        #: The triangles (T, 3) of all sheets, indices into ``vertices``.
        self.triangles = np.concatenate([np.empty((0, 3), np.int64), *parts]).astype(np.uint32)

    def times(self, first: float) -> Floats:
        """The substeps (S + 1,) of the frame after time ``first`` in frames, ``first`` included."""
        return first + np.arange(self.substeps + 1) / self.substeps

    def capsules(self, before: int, after: int) -> Floats:
        """Rows (S + 1, C, 8) from frame ``before`` to the next, ``after``; negative frames are the pre-roll."""
        return self._rows(self.times(before), before, after)

    def held(self) -> Floats:
        """Rows (S + 1, C, 8) of the first frame, which does not move."""
        return self._rows(np.zeros(self.substeps + 1), 0, 0)

    def vertices(self, frame: int) -> Floats:
        """The vertices (V, 3) of all sheets in ``frame``; in the pre-roll those of the first."""
        places = [self._positions(sheet.name, max(frame, 0), sheet.vertices) for sheet in self._sheets]
        return np.concatenate([np.empty((0, 3)), *places])

    def _rows(self, times: Floats, before: int, after: int) -> Floats:
        rows = [self._volumes.at(times)]
        for balls in self._balls:
            ends = [self._positions(balls.name, max(frame, 0), balls.centers) for frame in (before, after)]
            share = np.linspace(0, 1, self.substeps + 1)[:, None, None]
            centers = (1 - share) * ends[0] + share * ends[1]
            radii = np.broadcast_to(balls.radii[:, None], (*centers.shape[:2], 1))
            rows.append(np.concatenate([centers, radii, centers, radii], axis=2))
        return np.ascontiguousarray(np.concatenate(rows, axis=1))

    def _positions(self, name: str, frame: int, resting: Floats) -> Floats:
        if name not in self._last:
            return resting
        positions: Floats = np.asarray(self._cache.read(name, min(frame, self._last[name]))["positions"], np.float64)
        return positions
