"""What an animation camera over a drawing sees: a frame that pans, zooms and turns in the plane of the paper."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera

Floats = NDArray[np.float64]
# Cosine and sine of quarter turns, which are to copy pixels.
_QUARTERS = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}


@dataclass(frozen=True)
class FilmView:
    """The part of a drawing that a film frame shows.

    At rest the frame lies in the middle of the paper, on whole pixels (left and up where the difference is odd), as
    large as its pixels. All numbers say what the camera does; the picture does the contrary.

    Parameters
    ----------
    paper, size : (width, height)
        Of the drawing and of the film frame, in pixels.
    pan_x, pan_y : float
        How far the frame's middle goes right and down, in the drawing's pixels.
    zoom : float
        How much larger things are seen; above 0.
    rotate : float
        How far the camera turns clockwise, in degrees.

    Examples
    --------
    >>> view = FilmView((960, 540), (960, 540), pan_x=100, zoom=2)
    >>> view.corners.tolist()
    [[339.5, 134.5], [819.5, 134.5], [819.5, 404.5], [339.5, 404.5]]
    """

    paper: tuple[int, int]
    size: tuple[int, int]
    pan_x: float = 0.0
    pan_y: float = 0.0
    zoom: float = 1.0
    rotate: float = 0.0

    @property
    def to_paper(self) -> Floats:
        """The (3, 3) matrix from film pixels to the drawing's pixels (pixel centres at integers)."""
        degrees = self.rotate % 360
        cosine, sine = _QUARTERS.get(degrees) or (math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))
        turn = np.array([[cosine, -sine], [sine, cosine]]) / self.zoom
        middle = (np.array(self.size) - 1) / 2
        rest = middle + (np.array(self.paper) - np.array(self.size)) // 2
        matrix = np.eye(3)
        matrix[:2, :2] = turn
        matrix[:2, 2] = rest + np.array([self.pan_x, self.pan_y]) - turn @ middle
        return matrix

    @property
    def to_film(self) -> Floats:
        """The (3, 3) matrix from the drawing's pixels to film pixels."""
        return np.asarray(np.linalg.inv(self.to_paper), np.float64)

    @property
    def corners(self) -> Floats:
        """The frame's corners (4, 2) in the drawing's pixels, from the top left one clockwise."""
        width, height = self.size
        ends = np.array([[0, 0], [width, 0], [width, height], [0, height]]) - 0.5
        places: Floats = ends @ self.to_paper[:2, :2].T + self.to_paper[:2, 2]
        return places

    @property
    def is_whole(self) -> bool:
        """Whether the frame shows the drawing as it is."""
        moved = (self.pan_x, self.pan_y, self.zoom, self.rotate % 360)
        return self.paper == self.size and moved == (0, 0, 1, 0)

    @property
    def beyond(self) -> float:
        """How far the frame reaches beyond the paper, in the drawing's pixels; 0 where it lies on it."""
        low, high = self.corners.min(axis=0), self.corners.max(axis=0)
        return float(max(0.0, (-0.5 - low).max(), (high + 0.5 - self.paper).max()))

    @property
    def sees_paper(self) -> bool:
        """Whether anything of the paper is in the frame."""
        width, height = self.paper
        ends = np.array([[0, 0], [width, 0], [width, height], [0, height]]) - 0.5
        seen = ends @ self.to_film[:2, :2].T + self.to_film[:2, 2]
        # Two rectangles are apart where one lies beyond a side of the other.
        apart = any(
            (places.max(axis=0) <= -0.5).any() or (places.min(axis=0) >= np.array(whole) - 0.5).any()
            for places, whole in ((self.corners, self.paper), (seen, self.size))
        )
        return not apart

    def camera(self, camera: PerspectiveCamera) -> PerspectiveCamera:
        """Return what ``camera``, which sees the paper, becomes: another lens, off its axis, and a roll."""
        return PerspectiveCamera(self.to_film @ camera.matrix, self.size)
