"""limb_depth at 1080p, 16 limbs on 30% of the pixels, beside a copy of as many bytes and the slow oracle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benches.measure import Row, alternate, milliseconds
from pegbar import limb_depth
from tests.oracles import depth as oracle

HEIGHT, WIDTH, LIMBS = 1080, 1920, 16


def scene() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Labels, limb ends and depths: slanted bars in a 4 x 4 grid."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    cell = x // (WIDTH // 4) + 4 * (y // (HEIGHT // 4))
    labels = np.zeros((HEIGHT, WIDTH), np.uint8)
    ends, depths = [], []
    for limb in range(LIMBS):
        center = np.array([(limb % 4 + 0.5) * WIDTH / 4, (limb // 4 + 0.5) * HEIGHT / 4])
        along = np.array([np.cos(limb / 5), np.sin(limb / 5)])
        across = (x - center[0]) * along[1] - (y - center[1]) * along[0]
        along_limb = (x - center[0]) * along[0] + (y - center[1]) * along[1]
        labels[(cell == limb) & (abs(across) < 88) & (abs(along_limb) < 113)] = limb + 1
        ends.append([center - 100 * along, center + 100 * along])
        depths.append([3 + limb / 8, 4 + limb / 16])
    return labels, np.array(ends), np.array(depths)


def run() -> Iterator[Row]:
    """Yield a row for each interpolation."""
    labels, ends, depths = scene()
    source = np.ones(labels.size * 5 // 2, np.uint8)
    target = source.copy()
    part = np.s_[500:560, 400:900]
    for how in ("linear", "perspective"):
        ours, copy = alternate(
            lambda how=how: limb_depth(labels, ends, depths, interpolation=how),
            lambda: np.copyto(target, source),
            rounds=40,
        )
        shifted = ends - [part[1].start, part[0].start]
        got, want = (
            limb_depth(labels[part], shifted, depths, interpolation=how),
            oracle.limb_depth(labels[part], shifted, depths, how),
        )
        known = np.isfinite(want)
        error = abs(got[known] / want[known] - 1).max()
        yield Row(
            f"limb_depth {how}, {(labels > 0).mean():.0%} of the pixels",
            milliseconds(ours),
            f"np.copyto {milliseconds(copy)}",
            f"{ours / copy:.2f}x the copy",
            "promise 4x",
            f"largest relative difference to the oracle {error:.0e}",
        )
