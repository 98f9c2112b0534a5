"""Whether a drawn figure travels as its clip does: as far, less far since its legs are short, or not at all.

A walk on a treadmill, and a walk with a camera that follows, are drawn alike (Jain et al. 2010, section 5), and so are
nearly a short-legged walk before a still camera and a long-legged one with a camera that turns along. The simplest
camera decides, as it does between kinds of cameras.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pegbar.align.camera_choice import SLOWNESS, Choice, choose
from pegbar.align.camera_fit import Fit, Settings, fit
from pegbar.align.camera_terms import Shot, huber
from pegbar.align.root_motion import travelling

Floats = NDArray[np.float64]
#: A camera that is told to stand still must see part of the travel so many times closer than the whole.
_SHARE_GAIN = 1.25
#: Shares of the travel that are tried before the best is refined, and how near to none counts as none.
_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25)
_NONE = 0.1


class Root(NamedTuple):
    """The chosen camera, the share of the clip's travel that is kept, and why."""

    choice: Choice
    share: float
    notes: tuple[str, ...]


def with_share(shot: Shot, world: Floats, settings: Settings, share: float) -> Shot:
    """Return ``shot`` with its points moved on by a ``share`` of the travel of ``world`` (F, N, 3)."""
    moved = travelling(world, SLOWNESS * settings.window, share)
    return replace(shot, points=np.where(shot.seen[..., None], moved, 0.0))


def choose_root(shot: Shot, world: Floats, settings: Settings, mode: str) -> Root:
    """Return the travel with which the simplest camera explains the drawings."""
    whole = choose_mode(shot, settings, mode)
    if (mode == "auto" and whole.fit.mode == "static") or mode in ("pan", "free") or len(world) < 3:
        return Root(whole, 1.0, ())
    found, share = _best_share(shot, world, settings)
    if mode == "static":
        gain = _huber_cost(shot, whole.fit, found.noise) / max(_huber_cost(shot, found, found.noise), 1e-12)
        return Root(Choice(found, {}), share, ()) if gain > _SHARE_GAIN**2 else Root(whole, 1.0, ())
    part = choose(with_share(shot, world, settings, share), settings)
    if part.fit.mode != "static":
        return Root(whole, 1.0, ())
    how = "in place" if share == 0 else f"with {share:.2f} of the clip's travel"
    note = f"root {how}: a still camera explains the drawings; with all of it the camera moves ({whole.fit.mode})"
    return Root(part, share, (note,))


def choose_mode(shot: Shot, settings: Settings, mode: str) -> Choice:
    """Return the fit of ``mode``, or of the simplest one."""
    if mode == "auto":
        return choose(shot, settings)
    others = (fit(shot, "static", settings),) if mode != "static" else ()
    return Choice(fit(shot, mode, settings, others), {})


def _best_share(shot: Shot, world: Floats, settings: Settings) -> tuple[Fit, float]:
    """Return the still camera of least misfit over shares of the travel."""
    fits = {share: fit(with_share(shot, world, settings, share), "static", settings) for share in _SHARES}
    noise = min(found.noise for found in fits.values())
    costs = {share: _huber_cost(shot, found, noise) for share, found in fits.items()}
    best = min(costs, key=lambda share: costs[share])
    step = (_SHARES[1] - _SHARES[0]) / 2
    while step > 0.02:
        for share in (best - step, best + step):
            fits[share] = fit(with_share(shot, world, settings, share), "static", settings, (fits[best],))
            costs[share] = _huber_cost(shot, fits[share], noise)
        best = min(costs, key=lambda share: costs[share])
        step /= 2
    if abs(best) < _NONE:
        best = 0.0
    return fits[best], best


def _huber_cost(shot: Shot, found: Fit, noise: float) -> float:
    return float(huber(found.distances[shot.seen] ** 2, 4 * max(noise, 1e-9)).mean())
