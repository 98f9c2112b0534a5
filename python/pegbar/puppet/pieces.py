"""The pieces of a mesh, and what holds each of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pegbar.errors import DegenerateError


@dataclass(frozen=True, eq=False)
class Guides:
    """Vertices that stand in for a second handle of pieces that have handles at one place only.

    ``vertices`` (g,) int are these vertices, ``arms`` (g,) complex how they lie from their handle at rest, ``anchors``
    (g,) int the handles' indices in the list of handles, ``weights`` (g, h) float how much each other handle says about
    the turn of the piece.
    """

    vertices: NDArray[np.int64]
    arms: NDArray[np.complex128]
    anchors: NDArray[np.int64]
    weights: NDArray[np.float64]
    rest: NDArray[np.complex128]

    def place(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where the guides are (F, g, 2) when the handles are at ``positions`` (F, h, 2).

        Each turns about its handle as the other handles have turned round that handle, near ones counting more.
        """
        moved = positions[..., 0] + 1j * positions[..., 1]
        out = np.empty((len(positions), len(self.vertices), 2))
        for guide, (anchor, weights) in enumerate(zip(self.anchors, self.weights, strict=True)):
            before = np.conj(self.rest - self.rest[anchor]) * weights
            turn = ((moved - moved[:, anchor, None]) * before).sum(axis=1)
            length = np.abs(turn)
            unit = np.where(length > 0, turn, 1) / np.where(length > 0, length, 1)
            place = moved[:, anchor] + unit * self.arms[guide]
            out[:, guide, 0], out[:, guide, 1] = place.real, place.imag
        return out


def mesh_pieces(triangles: NDArray[np.integer], count: int) -> NDArray[np.int64]:
    """Return the piece (n,) of each of ``count`` vertices: vertices joined by triangles have the same number."""
    first = np.concatenate([triangles[:, 0], triangles[:, 1]])
    second = np.concatenate([triangles[:, 1], triangles[:, 2]])
    graph = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    pieces: NDArray[np.int64] = connected_components(graph, directed=False)[1].astype(np.int64)
    return pieces


def find_guides(vertices: NDArray[np.float64], triangles: NDArray[np.integer], handles: NDArray[np.integer]) -> Guides:
    """Return the guides that a mesh needs; a piece without any handle is a DegenerateError that names it."""
    pieces = mesh_pieces(triangles, len(vertices))
    _refuse_loose(pieces, handles)
    rest = vertices[:, 0] + 1j * vertices[:, 1]
    found: list[tuple[int, int]] = []
    for piece in np.unique(pieces):
        own = np.flatnonzero(pieces[handles] == piece)
        members = np.flatnonzero(pieces == piece)
        from_handle = np.abs(rest[members] - rest[handles[own[0]]])
        spread = np.abs(rest[handles[own]] - rest[handles[own[0]]]).max()
        if spread <= 1e-9 * from_handle.max() > 0:
            found.append((int(own[0]), int(members[from_handle.argmax()])))
    anchors, guides = np.array(found, np.int64).reshape(-1, 2).T
    away = np.abs(rest[handles] - rest[handles][anchors][:, None]) ** 2
    weights = np.where(away > 0, 1 / np.where(away > 0, away, 1) ** 2, 0)
    arms = rest[guides] - rest[handles][anchors]
    return Guides(guides, arms, anchors, weights, rest[handles])


def _refuse_loose(pieces: NDArray[np.int64], handles: NDArray[np.integer]) -> None:
    held = np.zeros(pieces.max(initial=-1) + 1, bool)
    held[pieces[handles]] = True
    if held.all():
        return
    number = int(np.argmin(held))
    members = np.flatnonzero(pieces == number)
    if len(members) == 1:
        raise DegenerateError(f"vertices: vertex {members[0]} is in no triangle and is no handle")
    raise DegenerateError(
        f"handles: piece {number} of the mesh ({len(members)} vertices, the first is vertex {members[0]}) has no handle"
    )
