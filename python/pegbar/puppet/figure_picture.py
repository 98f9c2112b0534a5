"""The picture of a puppet's mesh in a pose: all layers in one texture, drawn farthest first."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.render import render_mesh
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
Pixels = NDArray[np.uint8]
# Pictures smaller than this part of the drawing have smaller textures.
_SMALLER = 0.75
# Rows between the layers' pictures, so that none is mixed into another.
_APART = 8


@dataclass(frozen=True, eq=False)
class FigurePicture:
    """A puppet ready to be drawn.

    Layers lie below each other in ``texture`` (h, w, 4); a vertex that several of them share stands once for each:
    ``vertices`` (m,) int are the puppet's vertices, ``coordinates`` (m, 2) their places in the texture, ``triangles``
    (T, 3) int index these.
    """

    texture: Pixels
    vertices: NDArray[np.int64]
    coordinates: Floats
    triangles: NDArray[np.int64]

    @classmethod
    def of_puppet(cls, puppet: Puppet, scale: float = 1.0) -> FigurePicture:
        """Put the layers' textures together, each cut to what it shows.

        ``scale`` is how large the figure will be drawn: textures for small pictures are made smaller beforehand, so
        that lines do not break up.
        """
        keys = np.stack([np.repeat(puppet.triangle_layer, 3), puppet.triangles.ravel()], axis=1)
        corners, triangles = np.unique(keys, axis=0, return_inverse=True)
        coordinates = puppet.vertices[corners[:, 1]].copy()
        pieces: list[Pixels] = []
        top = 0
        for layer, texture in enumerate(puppet.textures):
            mine = corners[:, 0] == layer
            if not mine.any():
                continue
            low = np.maximum(np.floor(coordinates[mine].min(axis=0)).astype(int) - 2, 0)
            high = np.ceil(coordinates[mine].max(axis=0)).astype(int) + 3
            piece = texture[low[1] : high[1], low[0] : high[0]]
            coordinates[mine] += np.array([0, top]) - low
            pieces.append(piece)
            top += len(piece) + _APART
        width = max((piece.shape[1] for piece in pieces), default=1)
        atlas = np.zeros((max(top, 1), width, 4), np.uint8)
        row = 0
        for piece in pieces:
            atlas[row : row + len(piece), : piece.shape[1]] = piece
            row += len(piece) + _APART
        if scale < _SMALLER:
            size = tuple(max(1, round(side * scale)) for side in atlas.shape[1::-1])
            factor = np.array(size) / atlas.shape[1::-1]
            atlas = np.asarray(cv2.resize(atlas, size, interpolation=cv2.INTER_AREA), np.uint8)
            coordinates = coordinates * factor + (factor - 1) / 2
        return cls(atlas, corners[:, 1], coordinates, triangles.reshape(-1, 3))

    def draw(self, mesh: Floats, depths: Floats, size: tuple[int, int]) -> Pixels:
        """Return the picture (H, W, 4) uint8, straight alpha, of ``mesh`` (n, 2) with triangles at ``depths`` (T,)."""
        return render_mesh(
            mesh[self.vertices], self.triangles, self.coordinates, self.texture, size, triangle_depth=depths
        )
