"""Deformation beside libigl's ARAP on two drawn figures; the mesh renderer beside OpenCV, one affine warp a triangle.

libigl goes from frame to frame (warm start, one iteration); ours takes every frame by itself. How far both keep edges
and sides is measured in the run; so is how far both pictures of the mesh differ.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benches.measure import Row, alternate
from pegbar import Deformer, render_mesh

DATA = Path(os.environ.get("PEGBAR_TEST_DATA", Path(__file__).parents[2] / "shared" / "data")) / "deform"
SIZE = (1920, 1080)


def run() -> Iterator[Row]:
    """Yield rows for each figure, and for one rendered."""
    for name in ("char1", "char4"):
        path = DATA / f"arap_{name}.npz"
        if path.exists():
            yield from beside_libigl(name, dict(np.load(path)))
        else:
            yield Row.left_out(f"deform {name}", f"no {path}")
    yield from rendering()


def beside_libigl(name: str, data: dict[str, NDArray[Any]]) -> Iterator[Row]:
    """Yield rows: factors, one round and five, beside libigl with the mesh in space (as usual) and in the plane."""
    try:
        import igl
    except ImportError as error:
        yield Row.left_out(f"deform {name}", error)
        return
    vertices, triangles, handles = data["vertices"], data["triangles"].astype(np.int64), data["handles"]
    ours = Deformer(vertices, triangles, handles)
    for axes in (3, 2):
        padding = ((0, 0),) * 2, ((0, 0), (0, axes - 2))
        flat, positions = np.pad(vertices, padding[1]), np.pad(data["positions"], (padding[0][0], *padding[1]))

        def factor(flat: NDArray[np.float64] = flat, axes: int = axes) -> Any:
            solver = igl.ARAPData()
            solver.max_iter = 1
            igl.arap_precomputation(flat, triangles.astype(np.int32), axes, handles.astype(np.int32), solver)
            return solver

        peer = f"libigl in {axes}D"
        factors = alternate(lambda: Deformer(vertices, triangles, handles), factor)
        yield Row(
            f"Deformer {name}, factors", f"{factors[0]:.1f} ms", f"{peer} {factors[1]:.1f} ms", "", "promise 20 ms"
        )
        solver = factor()
        theirs = quality(vertices, triangles, follow(igl, solver, flat, positions)[..., :2])
        for rounds in (1, 5):
            times = alternate(
                lambda rounds=rounds: [ours.deform(p, iterations=rounds) for p in data["positions"][::5]],
                lambda solver=solver, at=(flat, positions[::5]): follow(igl, solver, *at),
                rounds=11,
            )
            got = quality(vertices, triangles, ours.deform_many(data["positions"], iterations=rounds))
            yield Row(
                f"deform {name}, {rounds} round{'s' * (rounds > 1)}, a frame",
                f"{times[0] / 60:.3f} ms",
                f"{peer} {times[1] / 60:.3f} ms",
                f"{times[1] / times[0]:.1f}x",
                "promise 2x" if rounds == 1 else "",
                f"edges change {got[0]:.2f}% ({theirs[0]:.2f}%), flipped {got[1]:.2f}% ({theirs[1]:.2f}%)",
            )


def follow(igl: Any, solver: Any, vertices: NDArray[np.float64], positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """libigl's vertices in every frame, each from the one before."""
    out, place = [], vertices
    for position in positions:
        place = igl.arap_solve(position, solver, place)
        out.append(place)
    return np.array(out)


def quality(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], places: NDArray[np.float64]
) -> tuple[float, float]:
    """Mean change of the edges' lengths and share of the triangles on their other side, in percent."""
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)

    def lengths(at: NDArray[np.float64]) -> NDArray[np.float64]:
        away: NDArray[np.float64] = np.linalg.norm(at[..., pairs[:, 0], :] - at[..., pairs[:, 1], :], axis=-1)
        return away

    def areas(at: NDArray[np.float64]) -> NDArray[np.float64]:
        a, b = (at[..., triangles[:, k], :] - at[..., triangles[:, 0], :] for k in (1, 2))
        return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]

    change = np.abs(lengths(places) / lengths(vertices) - 1).mean()
    return 100 * float(change), 100 * float((areas(places) * areas(vertices) <= 0).mean())


def rendering() -> Iterator[Row]:
    """Yield rows: a bent sheet of 2,450 triangles, figure-sized and as large as the picture."""
    part = np.linspace(0, 1, 36)
    rest = np.stack(np.meshgrid(part, part), axis=-1).reshape(-1, 2)
    first = (np.arange(35)[:, None] * 36 + np.arange(35)).ravel()
    halves = [[first, first + 1, first + 36], [first + 1, first + 37, first + 36]]
    triangles = np.concatenate([np.stack(half, axis=1) for half in halves])
    rows, columns = np.mgrid[:1000, :1000]
    texture = np.stack([rows % 256, columns % 256, (rows + columns) // 8, np.full(rows.shape, 255)], -1).astype(
        np.uint8
    )
    for name, scale, least in (("a figure's 600 x 900", (600, 900), 60), ("the whole picture", (1919, 1079), 0)):
        places = rest * scale + 8 * np.sin(rest[:, ::-1] * 9)
        begin = time.perf_counter()
        theirs = warp_triangles(places, triangles, rest * 999, texture)
        peer = 1e3 * (time.perf_counter() - begin)
        (ours,) = alternate(lambda at=places: render_mesh(at, triangles, rest * 999, texture, SIZE), rounds=21)
        got = render_mesh(places, triangles, rest * 999, texture, SIZE)
        both = (got[..., 3] > 0) & (theirs[..., 3] > 0)
        differ = np.abs(got[both].astype(int) - theirs[both]).max(axis=1)
        if np.quantile(differ, 0.9) > 8:
            raise AssertionError(f"OpenCV's picture differs by {np.quantile(differ, 0.9)} levels")
        yield Row(
            f"render_mesh {len(triangles)} triangles, {name}",
            f"{ours:.1f} ms",
            f"cv2.warpAffine a triangle {peer:.0f} ms",
            f"{peer / ours:.0f}x",
            f"promise {1000 / least:.1f} ms" if least else "",
            f"{1e3 / ours:.0f} frames/s; pictures differ by {np.quantile(differ, 0.5):.0f} levels (median)",
        )


def warp_triangles(
    places: NDArray[np.float64], triangles: NDArray[np.int64], coordinates: NDArray[np.float64], texture: NDArray[Any]
) -> NDArray[np.uint8]:
    """The usual way: for each triangle an affine warp of its box, put in through a mask."""
    out = np.zeros((SIZE[1], SIZE[0], 4), np.uint8)
    for corners in triangles:
        at, of = places[corners].astype(np.float32), coordinates[corners].astype(np.float32)
        x, y, width, height = cv2.boundingRect(at)
        x, y = max(x, 0), max(y, 0)
        width, height = min(width, SIZE[0] - x), min(height, SIZE[1] - y)
        if width <= 0 or height <= 0:
            continue
        matrix = cv2.getAffineTransform(of, at - np.float32([x, y]))
        part = cv2.warpAffine(texture, matrix, (width, height), borderMode=cv2.BORDER_REPLICATE)
        mask = cv2.fillConvexPoly(np.zeros((height, width), np.uint8), np.round(at - [x, y]).astype(np.int32), 1)
        np.copyto(out[y : y + height, x : x + width], part, where=mask[..., None] > 0)
    return out
