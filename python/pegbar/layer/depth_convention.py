"""What a depth pass of another package means: which unit, measured along the view axis or the ray, what is background.

Decided by what is known to be in the picture: limbs and ground, whose planar depth a camera gives. A convention is
right where depth and reference differ by one factor, the unit, over all these pixels; under a wrong one, or another
camera, the ratios spread.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera

Floats = NDArray[np.float64]
Form = Literal["planar", "radial", "inverse"]
FORMS: tuple[Form, ...] = ("planar", "radial", "inverse")
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "foot": 0.3048}
#: Depths from here on are background in any unit: Blender writes 1e10, others 1e30.
BACKGROUND = 1e9
# Ratios of depth to reference that count as one (natural logarithm).
_WINDOW = 0.02
# Shares that count as alike, and how many times closer the right form then is.
_ALIKE, _CLOSER = 0.1, 2.0
# A scale that is so near to a unit is that unit: limbs between rendered and measured pixels differ by less.
_UNIT = 0.015
# Of alpha-less pixels that share one depth, this many make it the background.
_CONSTANT = 0.5


@dataclass(frozen=True)
class Convention:
    """How to read a depth pass: its form, metres a unit, whether it counts backwards, and what is background.

    ``background`` is a depth of the file that means nothing, besides 0, NaN and 1e9 and more; None: there is none.
    """

    form: Form = "planar"
    scale: float = 1.0
    negative: bool = False
    background: float | None = None

    def planar(self, raw: NDArray[np.floating], rays: Floats) -> NDArray[np.float32]:
        """Return planar depth in metres, +inf for background; ``rays`` as `ray_lengths` gives them."""
        values, known = _values(raw, self)
        found = _formed(values, rays, self.form) * self.scale
        depth: NDArray[np.float32] = np.where(known, found, np.inf).astype(np.float32)
        return depth


@dataclass(frozen=True, eq=False)
class DepthSample:
    """A depth pass with what is known: planar depths of ``limbs`` and ``ground``, +inf where they are not (H, W).

    ``rays`` is the length of a ray a metre of planar depth, ``inner`` tells pixels that are surely a limb's.
    """

    raw: NDArray[np.floating]
    limbs: Floats
    ground: Floats
    rays: Floats
    inner: NDArray[np.bool_]


@dataclass(frozen=True)
class Fit:
    """How well a convention explains pixels: ``share`` of them agree at ``scale``, to within ``spread`` (median)."""

    form: Form
    scale: float
    share: float
    spread: float
    pixels: int


def ray_lengths(camera: PerspectiveCamera) -> Floats:
    """Return for every pixel (H, W) the distance from the camera at a planar depth of 1."""
    rays = _directions(camera)
    lengths: Floats = np.linalg.norm(rays, axis=2)
    return lengths


def ground_depth(camera: PerspectiveCamera, height: float, reach: float = 10.0) -> Floats:
    """Return the planar depth (H, W) of the ground plane, +inf where it is not seen or farther than ``reach``.

    ``reach`` counts metres from the world's origin along x and along z.
    """
    world = _directions(camera) @ camera.rotation
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = (height - camera.position[1]) / world[..., 1]
        places = camera.position + depth[..., None] * world
        seen = (depth > 0) & (np.abs(places[..., [0, 2]]).max(axis=2) < reach)
    found: Floats = np.where(seen, depth, np.inf)
    return found


def _directions(camera: PerspectiveCamera) -> Floats:
    width, height = camera.image_size
    across, down = np.meshgrid(np.arange(width), np.arange(height))
    pixels = np.stack([across, down, np.ones_like(across)], axis=2)
    rays: Floats = pixels @ np.linalg.inv(camera.intrinsic).T
    return rays


def find_background(raws: Sequence[NDArray[np.floating]], alphas: Sequence[NDArray[np.floating]]) -> Convention:
    """Return what is background in depth passes ``raws``, and whether they count backwards; all else is not known.

    A constant far away, as a clip plane gives it, is background where most pixels without alpha have it.
    """
    every = np.concatenate([raw.ravel() for raw in raws])
    known = _is_depth(every)
    negative = bool(known.any() and (every[known] <= 0).all())
    sign = -1.0 if negative else 1.0
    empty = np.concatenate([alpha.ravel() <= 0 for alpha in alphas])
    there = every[known & empty] * sign
    if there.size:
        values, counts = np.unique(there, return_counts=True)
        most = int(np.argmax(counts))
        if counts[most] > _CONSTANT * empty.sum() and values[most] >= (every[known] * sign).max():
            return Convention(negative=negative, background=float(values[most] * sign))
    return Convention(negative=negative)


def fit_limbs(samples: Sequence[DepthSample], start: Convention, forms: Sequence[Form] = FORMS) -> Fit:
    """Return the convention under which most pixels of limbs have their depth."""
    parts = [(sample, sample.inner) for sample in samples]
    return _fit(parts, start, forms, "limbs")


def fit_ground(samples: Sequence[DepthSample], start: Convention, forms: Sequence[Form] = FORMS) -> Fit:
    """Return the convention under which most pixels of the ground have its depth."""
    parts = [(s, np.isfinite(s.ground) & np.isinf(s.limbs) & _values(s.raw, start)[1]) for s in samples]
    return _fit(parts, start, forms, "ground")


def forms_differ(samples: Sequence[DepthSample], start: Convention, fit: Fit, what: str) -> bool:
    """Whether ``fit`` could be told from the other of planar and radial; ``what`` is "limbs" or "ground"."""
    if fit.form == "inverse":
        return True
    other: Form = "radial" if fit.form == "planar" else "planar"
    find = fit_limbs if what == "limbs" else fit_ground
    found = find(samples, start, (other,))
    return found.share < fit.share - _ALIKE or found.spread > _CLOSER * max(fit.spread, 1e-6)


def unit_of(scale: float) -> str | None:
    """Return the name of the unit of ``scale`` metres, None where no usual unit is near."""
    return next((name for name, size in UNITS.items() if abs(math.log(scale / size)) < _UNIT), None)


def _fit(
    parts: Sequence[tuple[DepthSample, NDArray[np.bool_]]], start: Convention, forms: Sequence[Form], what: str
) -> Fit:
    best = Fit(forms[0], 1.0, 0.0, math.inf, sum(int(mask.sum()) for _, mask in parts))
    for form in forms:
        ratios = []
        for sample, mask in parts:
            values, known = _values(sample.raw[mask], start)
            found = _formed(values[known], sample.rays[mask][known], form)
            ratios.append(np.log(found / getattr(sample, what)[mask][known]))
        every = np.sort(np.concatenate([np.empty(0), *ratios]))
        if not every.size:
            continue
        after = np.searchsorted(every, every + _WINDOW, "right")
        first = int(np.argmax(after - np.arange(len(every))))
        middle = float(np.median(every[first : after[first]]))
        away = np.abs(every - middle)
        share, spread = float((away < _WINDOW / 2).sum()) / best.pixels, float(np.median(away[first : after[first]]))
        if share > best.share + _ALIKE or (share > best.share - _ALIKE and spread < best.spread):
            best = Fit(form, math.exp(-middle), share, spread, best.pixels)
    return best


def _is_depth(raw: NDArray[np.floating]) -> NDArray[np.bool_]:
    known: NDArray[np.bool_] = np.isfinite(raw) & (np.abs(raw) < BACKGROUND) & (raw != 0)
    return known


def _values(raw: NDArray[np.floating], convention: Convention) -> tuple[Floats, NDArray[np.bool_]]:
    """Positive depths, 1 where nothing is, and where something is."""
    known = _is_depth(raw)
    if convention.background is not None:
        known &= raw != convention.background
    values = np.where(known, raw, 1.0).astype(np.float64)
    values = np.where(known & convention.negative, -values, values)
    known &= values > 0
    return np.where(known, values, 1.0), known


def _formed(values: Floats, rays: Floats, form: Form) -> Floats:
    return values / rays if form == "radial" else 1 / values if form == "inverse" else values
