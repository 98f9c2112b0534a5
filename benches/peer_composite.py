"""depth_composite beside a copy of as many bytes, the vectorised numpy oracle and OpenImageIO's zover.

One thread: run with RAYON_NUM_THREADS=1. Ours and the peer alternate, medians of each.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benches.measure import Row, alternate, milliseconds
from pegbar import depth_composite
from tests.oracles import composite as oracle

FULL_HD, ULTRA_HD = (1080, 1920), (2160, 3840)


def random_frame(size: tuple[int, int]) -> list[np.ndarray]:
    """The worst content: every alpha, coverage and order at random."""
    random = np.random.default_rng(7)
    alpha, *depths = (random.random(size, dtype=np.float32) for _ in range(3))
    drawing, rendered = (random.integers(0, 256, (*size, 4), dtype=np.uint8) for _ in range(2))
    return [drawing, alpha, depths[0], rendered, depths[1]]


def shot_frame(size: tuple[int, int]) -> list[np.ndarray]:
    """A figure on 30% of the frame, a ring around it on 10%, soft rims, nothing elsewhere."""
    random = np.random.default_rng(7)
    y, x = (np.indices(size) - np.array(size).reshape(2, 1, 1) / 2) / size[0]
    figure, ring = np.hypot(x, y) - 0.41, np.abs(np.hypot(x, 3 * y) - 0.6) - 0.03
    alpha, covered = (np.clip(0.5 - distance * size[0] / 2, 0, 1).astype(np.float32) for distance in (figure, ring))
    drawing, rendered = (random.integers(0, 256, (*size, 4), dtype=np.uint8) for _ in range(2))
    rendered[..., 3] = np.rint(255 * covered)
    depth = np.where(alpha > 0, np.float32(4), np.float32(np.inf))
    rendered_depth = np.where(covered > 0, (4 - np.sign(y)).astype(np.float32), np.float32(np.inf))
    return [drawing, alpha, depth, rendered, rendered_depth]


def levels(case: list[np.ndarray]) -> str:
    """The largest difference to the oracle."""
    got, want = depth_composite(*case).astype(float), oracle.depth_composite(*case)
    return f"max difference {np.abs(got - want).max():.3g}"


def copy_row(name: str, case: list[np.ndarray]) -> Row:
    """Ours beside a copy whose reads and writes are as many bytes as ours."""
    moved = sum(values.nbytes for values in case) + case[3].size // case[4].size * case[1].size
    source = np.ones(moved // 2, np.uint8)
    target = source.copy()
    ours, peer = alternate(lambda: depth_composite(*case), lambda: np.copyto(target, source))
    times = milliseconds(ours), milliseconds(peer)
    return Row(name, times[0], f"np.copyto {times[1]}", f"{ours / peer:.2f}x the copy", "promise 3x", levels(case))


def oracle_row(case: list[np.ndarray]) -> Row:
    """Ours beside vectorised numpy in float64."""
    ours, peer = alternate(lambda: depth_composite(*case), lambda: oracle.depth_composite(*case), rounds=3)
    times = milliseconds(ours), milliseconds(peer)
    return Row(
        "depth_composite uint8", times[0], f"numpy {times[1]}", f"{peer / ours:.0f}x", "promise 10x", levels(case)
    )


def growth_row() -> Row:
    """1080p beside 4K: the ratio is how many times dearer 4K is."""
    small, large = random_frame(FULL_HD), random_frame(ULTRA_HD)
    ours, peer = alternate(lambda: depth_composite(*small), lambda: depth_composite(*large))
    times = milliseconds(ours), milliseconds(peer)
    return Row("depth_composite uint8", times[0], f"ours at 4K {times[1]}", f"{peer / ours:.2f}x", "promise 4x +- 10%")


def zover_row(case: list[np.ndarray]) -> Row:
    """Ours on premultiplied floats beside OpenImageIO, whose pictures carry depth as a fifth channel."""
    try:
        import OpenImageIO as oiio
    except ImportError as error:
        return Row.left_out("depth_composite float32", error)
    drawing, alpha, depth, rendered, rendered_depth = case
    hue = np.concatenate([drawing[..., :3] / np.float32(255), np.ones((*alpha.shape, 1), np.float32)], axis=-1)
    planes = (hue * alpha[..., None], depth), (oracle.premultiplied(rendered).astype(np.float32), rendered_depth)
    pictures = [np.concatenate([color, z[..., None]], axis=-1) for color, z in planes]
    specification = oiio.ImageSpec(alpha.shape[1], alpha.shape[0], 5, "float")
    specification.channelnames = ("R", "G", "B", "A", "Z")
    specification.alpha_channel, specification.z_channel = 3, 4
    front, back, out = (oiio.ImageBuf(specification) for _ in range(3))
    for buffer, pixels in zip((front, back), pictures, strict=True):
        buffer.set_pixels(oiio.ROI(), pixels)
    floats = [drawing, alpha, depth, planes[1][0], rendered_depth]
    work = lambda: oiio.ImageBufAlgo.zover(out, front, back, False, oiio.ROI(), 1)  # noqa: E731
    ours, peer = alternate(lambda: depth_composite(*floats), work, rounds=5)
    difference = np.abs(out.get_pixels(oiio.FLOAT)[..., :4] - depth_composite(*floats)).max()
    times, agreement = (milliseconds(ours), milliseconds(peer)), f"largest difference {difference:.1e}"
    return Row(
        "depth_composite float32", times[0], f"oiio zover {times[1]}", f"{peer / ours:.1f}x", "promise 5x", agreement
    )


def run() -> Iterator[Row]:
    """Yield all comparisons, at 1080p unless said."""
    worst, shot = random_frame(FULL_HD), shot_frame(FULL_HD)
    three = [np.ascontiguousarray(worst[0][..., :3]), *worst[1:]]
    yield copy_row("depth_composite uint8, all at random", worst)
    yield copy_row("depth_composite uint8, all at random, RGB drawing", three)
    yield copy_row("depth_composite uint8, figure and ring", shot)
    yield oracle_row(worst)
    yield zover_row(worst)
    yield growth_row()
