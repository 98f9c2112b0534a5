"""A clip's body with the limb lengths and swings of a drawn figure, so that these are not taken for a turned view.

Equation 1 of Jain et al. 2010 has the clip's own body, and a camera can explain short legs or small steps only by
turning: a side view with small steps comes out as one from farther in front. So both are solved beside the camera, with
the clip's own as a prior: linear least squares for a view that is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from pegbar.align.camera_fit import RAYLEIGH_MEDIAN
from pegbar.scene.body import bones_between
from pegbar.scene.contacts import FEET

Floats = NDArray[np.float64]
#: How much drawn limbs differ from a person's in length and in how far they swing: standard deviations, as shares.
_LENGTH, _SWING = 0.25, 0.2
#: Widths are held tighter: a side view tells nothing of them, and they alone keep the near leg before the far one.
_WIDTH, _WIDTHS = 0.06, ("shoulder", "hip")
#: A limb is never made shorter or longer than so many times its length in the clip.
_SHORTEST, _LONGEST = 0.3, 3.0
#: Marks are right to this share of the figure's spread at best, and count linearly beyond so many times the usual one.
_EXACT, _KNEE = 2e-2, 2.5
#: Drawings of one shot are alike: they count as so many at most.
_POSES = 10
_ROUNDS = 8
#: The body's heading is smoothed over so many seconds, so that a stride's twist counts as swing.
_HEADING = 0.5


@dataclass(frozen=True, eq=False)
class Proportions:
    """How a drawn body differs from the clip's: factors (K,) of the limbs' lengths, and of how far they swing."""

    lengths: Floats
    swings: Floats

    def describe(self, kinds: Sequence[str]) -> str:
        """Return the lengths that differ much, in words."""
        told = (f"{kind} {length:.1f}" for kind, length in zip(kinds, self.lengths, strict=True) if _is_much(length))
        return ", ".join(told) or "none much"


@dataclass(frozen=True, eq=False)
class Body:
    """The clip's limbs as a tree, at F drawings: markers ``points`` (F, N, 3) in metres, of ``names``.

    Left and right limbs share a length, named by the marker at their outer ends; ``rate`` is drawings a second.
    """

    names: tuple[str, ...]
    points: Floats
    rate: float

    @cached_property
    def root(self) -> str:
        """The marker that the others hang on."""
        outer = {self.names[child] for _, child in bones_between(self.names)}
        return next((name for name in self.names if name not in outer), self.names[0])

    @cached_property
    def limbs(self) -> tuple[tuple[int, int, int], ...]:
        """Inner marker, outer marker and length of each limb, from the root outwards."""
        inner = {child: parent for parent, child in bones_between(self.names)}
        root = self.names.index(self.root)
        parents = {child: inner.get(child, root) for child in range(len(self.names)) if child != root}
        order = [root]
        for marker in order:
            order += [child for child, parent in parents.items() if parent == marker]
        return tuple((parents[child], child, self.kinds.index(_kind(self.names[child]))) for child in order[1:])

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """The names of the K lengths."""
        return tuple(dict.fromkeys(_kind(name) for name in self.names if name != self.root))

    @cached_property
    def swings(self) -> Floats:
        """How far each limb (F, V, 3) is from its mean direction over the shot, seen from the body's heading."""
        ways = np.stack([self.points[:, outer] - self.points[:, inner] for inner, outer, _ in self.limbs], axis=1)
        turn = _about_y(-_headings(self.names, self.points, self.rate))
        ahead = np.einsum("fab,fvb->fva", turn, ways)
        swings: Floats = np.einsum("fba,fvb->fva", turn, ahead - _mean(ahead))
        return swings

    def ways(self) -> Floats:
        """The way from the root to each marker, length by length and then swing by swing: (F, N, 2 K, 3)."""
        kinds = len(self.kinds)
        ways = np.zeros((*self.points.shape[:2], 2 * kinds, 3))
        for limb, (inner, outer, kind) in enumerate(self.limbs):
            ways[:, outer] = ways[:, inner]
            ways[:, outer, kind] += self.points[:, outer] - self.points[:, inner]
            ways[:, outer, kinds + kind] += self.swings[:, limb]
        return ways

    def drawn(self, proportions: Proportions) -> Floats:
        """Return the points (F, N, 3) with these proportions, the feet as high over the floor as before."""
        moved = self.points.copy()
        for limb, (inner, outer, kind) in enumerate(self.limbs):
            way = self.points[:, outer] - self.points[:, inner]
            length = np.linalg.norm(way, axis=1, keepdims=True)
            way = way + (proportions.swings[kind] - 1) * self.swings[:, limb]
            way *= length / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
            moved[:, outer] = moved[:, inner] + proportions.lengths[kind] * way
        feet = [self.names.index(foot) for foot in FEET if foot in self.names]
        low, before = (points[:, feet, 1][np.isfinite(points[:, feet, 1])] for points in (moved, self.points))
        if low.size and before.size:
            moved[..., 1] += before.min() - low.min()
        return moved


def own_proportions(body: Body) -> Proportions:
    """Return the clip's own."""
    return Proportions(np.ones(len(body.kinds)), np.ones(len(body.kinds)))


def drawn_proportions(marks: Floats, seen: NDArray[np.bool_], body: Body, jacobians: Floats) -> Proportions:
    """Return how long limbs are drawn and how far they swing, beside the clip's at the figure's common scale.

    Parameters
    ----------
    marks : (F, N, 2) float
        The drawn joints in pixels.
    seen : (F, N) bool
        Which of them count.
    body : Body
        The clip at the F drawings.
    jacobians : (F, N, 2, 3) float
        How a marker moves in the picture when it moves in the world; parallel rays have one for all.
    """
    usable = seen & np.isfinite(body.points).all(axis=-1)
    count = np.maximum(usable.sum(axis=1), 1)[:, None, None]
    ways = np.einsum("fnac,fnkc->fnak", jacobians, body.ways())
    ways = np.where(usable[..., None, None], ways, 0.0)
    ways = (ways - ways.sum(axis=1, keepdims=True) / count[..., None])[usable]
    marks = np.where(usable[..., None], marks, 0.0)
    drawn = (marks - marks.sum(axis=1, keepdims=True) / count)[usable]
    finite = np.isfinite(ways).all(axis=(1, 2))
    ways, drawn = ways[finite], drawn[finite]
    spread = float(np.sqrt(np.mean(np.sum(drawn**2, axis=1)))) if len(drawn) else 0.0
    if spread == 0.0:
        return own_proportions(body)
    return _solved(ways, drawn, spread, min(1.0, _POSES / len(marks)), body.kinds)


def jacobians_of(matrices: Floats, points: Floats) -> Floats:
    """Return how pixels move with ``points`` (F, N, 3) before cameras (F, 3, 4), as (F, N, 2, 3)."""
    image = np.einsum("fab,fnb->fna", matrices[:, :, :3], points) + matrices[:, None, :, 3]
    depth = image[..., 2, None, None]
    jacobians: Floats = (matrices[:, None, :2, :3] - image[..., :2, None] / depth * matrices[:, None, 2:, :3]) / depth
    return jacobians


def _solved(ways: Floats, drawn: Floats, spread: float, share: float, kinds: Sequence[str]) -> Proportions:
    """Factors for marks ``drawn`` (n, 2) that lie along ``ways`` (n, 2, 2 K): the scale and they in turn."""
    count = len(kinds)
    width = np.array([kind in _WIDTHS for kind in kinds])
    spreads = np.concatenate([np.where(width, _WIDTH, _LENGTH), np.where(width, _WIDTH, _SWING)])
    usual = np.repeat([1.0, 0.0], count)
    factors, trust = usual, np.ones(len(drawn))
    for _ in range(_ROUNDS):
        whole = ways @ factors
        scale = np.sum(trust[:, None] * whole * drawn) / max(np.sum(trust[:, None] * whole**2), 1e-12)
        seen = scale * ways
        distance = np.linalg.norm(seen @ factors - drawn, axis=1)
        noise = max(float(np.median(distance)) / RAYLEIGH_MEDIAN, _EXACT * spread)
        trust = np.minimum(1.0, _KNEE * noise / np.maximum(distance, 1e-12))
        weight = share / noise**2
        normal = weight * np.einsum("n,nak,nal->kl", trust, seen, seen) + np.diag(spreads**-2.0)
        factors = np.linalg.solve(normal, weight * np.einsum("n,nak,na->k", trust, seen, drawn) + usual * spreads**-2.0)
        factors[:count] = factors[:count].clip(_SHORTEST, _LONGEST)
    return Proportions(factors[:count], 1 + factors[count:] / factors[:count])


def _is_much(length: float) -> bool:
    return not 0.8 < length < 1.25


def _kind(name: str) -> str:
    return name.removeprefix("left_").removeprefix("right_")


def _headings(names: tuple[str, ...], points: Floats, rate: float) -> Floats:
    """Where the body heads at each drawing (F,), in radians about the vertical; 0 where nothing tells."""
    pairs = [(f"left_{kind}", f"right_{kind}") for kind in _WIDTHS if {f"left_{kind}", f"right_{kind}"} <= {*names}]
    if not pairs:
        return np.zeros(len(points))
    across = sum(points[:, names.index(left)] - points[:, names.index(right)] for left, right in pairs)
    across = np.nan_to_num(np.asarray(across))
    smooth = gaussian_filter1d(across, max(_HEADING * rate, 1e-3), axis=0, mode="nearest")
    headings: Floats = np.arctan2(-smooth[:, 2], smooth[:, 0])
    return headings


def _about_y(angles: Floats) -> Floats:
    cosine, sine, zero = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    rows = [[cosine, zero, sine], [zero, zero + 1, zero], [-sine, zero, cosine]]
    return np.moveaxis(np.array(rows), -1, 0)


def _mean(ways: Floats) -> Floats:
    known = np.isfinite(ways)
    mean: Floats = np.where(known, ways, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return mean
