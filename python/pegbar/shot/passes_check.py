"""What rendered passes mean, told by the shot's limbs and ground: unit and kind of depth, camera, alpha."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.export.limbs import limb_meshes
from pegbar.export.shot_scene import ShotScene
from pegbar.layer.alpha_kind import alpha_kind
from pegbar.layer.depth_convention import (
    FORMS,
    UNITS,
    Convention,
    DepthSample,
    Fit,
    Form,
    find_background,
    fit_ground,
    fit_limbs,
    forms_differ,
    ground_depth,
    ray_lengths,
    unit_of,
)
from pegbar.shot.incoming import Finding, Incoming, joined
from pegbar.simulate.passes import render_passes

Alpha = Literal["premultiplied", "straight"]
# Frames that are looked at, spread over the shot.
_SAMPLES = 5
_WHERE = "some frames"
# So many of the limbs' pixels must have their depth for limbs to be in the picture under this camera.
_LIMBS, _BEYOND = 0.6, 0.02
_GROUND, _GROUND_PIXELS = 0.3, 400
_JUMP, _FARTHER = 1.02, 1.02
_WORDS: dict[Form, str] = {
    "planar": "along the view axis",
    "radial": "along rays from the camera",
    "inverse": "one over the distance",
}


@dataclass(frozen=True)
class ImportOptions:
    """What the user knows of the passes; None: to be found. ``unit`` is metres a unit."""

    form: Form | None = None
    unit: float | None = None
    alpha: Alpha | None = None


@dataclass(frozen=True)
class Judgement:
    """How passes are to be read, and the table's lines that say why."""

    convention: Convention
    alpha: Alpha
    findings: tuple[Finding, ...]


def judge(incoming: Incoming, frames: Sequence[int], scene: ShotScene, options: ImportOptions) -> Judgement:
    """Return what the passes of ``frames`` mean; some frames, spread over them, are read.

    Raises FormatError and OSError for files that cannot be read.
    """
    chosen = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, _SAMPLES).round().astype(int))]
    raws, checks, pictures = [], [], []
    for frame in chosen:
        channels, names = incoming.read(frame)
        picture = _thinned(joined(channels, names.beauty), scene.image_size)
        pictures.append(picture)
        raws.append(_thinned(channels[names.depth], scene.image_size))
        if names.check is not None:
            checks.append(_thinned(channels[names.check], scene.image_size))
    start = find_background(raws, [picture[..., 3] for picture in pictures])
    is_checked = len(checks) == len(raws)
    seen = checks if is_checked else raws
    before = replace(start, background=None) if is_checked else start
    rows = [frame - scene.frames[0] for frame in chosen]
    samples = [_sample(raw, scene, row) for raw, row in zip(seen, rows, strict=True)]
    convention, findings = _depth(samples, before, options, _usual(scene, rows), raws, start)
    findings = [*_said(start, raws), *findings]
    findings.append(_camera(samples, convention, is_checked, scene, rows))
    alpha, line = _alpha(pictures, options)
    return Judgement(replace(convention, background=start.background), alpha, (*findings, line))


def _thinned(picture: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """One pixel for each of the drawing's."""
    factor = max(1, picture.shape[1] // size[0])
    return np.asarray(picture[factor // 2 :: factor, factor // 2 :: factor], np.float32)


def _sample(raw: NDArray[np.float32], scene: ShotScene, row: int) -> DepthSample:
    camera = scene.cameras[row]
    limbs = render_passes(limb_meshes(scene.characters, row), camera).depth.astype(np.float64)
    ground = np.full(limbs.shape, np.inf) if scene.ground is None else ground_depth(camera, scene.ground)
    # Edges of limbs, also between two of them, fall on either side.
    window = np.ones((3, 3), np.uint8)
    low, high = cv2.erode(limbs, window), cv2.dilate(limbs, window)
    inner = np.isfinite(high) & (high / _JUMP < low) & (limbs < ground)
    return DepthSample(raw, limbs, ground, ray_lengths(camera), inner)


def _depth(
    samples: Sequence[DepthSample],
    start: Convention,
    options: ImportOptions,
    usual: float,
    raws: Sequence[NDArray[np.float32]],
    own: Convention,
) -> tuple[Convention, list[Finding]]:
    """Form and unit, by limbs, else by the ground, else by how far the characters are."""
    forms = FORMS if options.form is None else (options.form,)
    fit, evidence = fit_limbs(samples, start, forms), "limbs"
    if fit.share < _LIMBS:
        fit, evidence = fit_ground(samples, start, forms), "ground"
        if fit.share < _GROUND or fit.pixels < _GROUND_PIXELS or unit_of(fit.scale) is None:
            return _guessed(raws, own, options, usual)
    told = options.form is not None or forms_differ(samples, start, fit, evidence)
    form: Form = fit.form if told else "planar"
    scale = options.unit or UNITS.get(unit_of(fit.scale) or "", fit.scale)
    return replace(start, form=form, scale=scale), [
        _form_line(form, told, options, f"{fit.share:.0%} of the {evidence} agree"),
        _unit_line(scale, fit, options),
    ]


def _form_line(form: Form, told: bool, options: ImportOptions, why: str) -> Finding:
    if options.form is not None:
        return Finding("ok" if form == "planar" else "mended", "depth", _WHERE, f"{_WORDS[form]}, as you say; {why}")
    if not told:
        text = "limbs and ground do not tell planar from radial; taken as planar"
        return Finding("guess", "depth", _WHERE, text, "--depth planar or radial")
    if form == "planar":
        return Finding("ok", "depth", _WHERE, f"{_WORDS[form]}; {why}")
    return Finding("mended", "depth", _WHERE, f"{_WORDS[form]}; {why}", "made planar")


def _unit_line(scale: float, fit: Fit, options: ImportOptions) -> Finding:
    name = unit_of(scale) or f"{scale:.4g} metres a unit"
    if options.unit is not None and abs(fit.scale / scale - 1) > 0.05:
        text = f"{name}, as you say, but {unit_of(fit.scale) or f'{fit.scale:.4g} metres a unit'} would fit"
        return Finding("problem", "unit", _WHERE, text, "leave --unit out")
    if scale == 1.0:
        return Finding("ok", "unit", _WHERE, "metres")
    kind: Literal["mended", "guess"] = "mended" if unit_of(scale) else "guess"
    return Finding(kind, "unit", _WHERE, name, "made metres")


def _guessed(
    raws: Sequence[NDArray[np.float32]], start: Convention, options: ImportOptions, usual: float
) -> tuple[Convention, list[Finding]]:
    """Form and unit where nothing known is in the picture: elements are about as far away as the characters."""
    every = np.concatenate([start.planar(raw, np.ones(raw.shape)).ravel() for raw in raws])
    every = every[np.isfinite(every)]
    form, unit = options.form or "planar", options.unit
    if not every.size:
        return replace(start, form=form, scale=unit or 1.0), [
            Finding("problem", "depth", _WHERE, "nothing is in front of the background", "render the depth pass")
        ]
    middle = float(np.median(every))
    if options.form is None and unit is None and 1 / 3 < 1 / middle / usual < 3 and not 1 / 5 < middle / usual < 5:
        form, middle = "inverse", 1 / middle
    elif options.form == "inverse":
        middle = 1 / middle
    if unit is None:
        unit = min((UNITS[name] for name in ("m", "cm", "mm")), key=lambda size: abs(np.log(middle * size / usual)))
    convention = replace(start, form=form, scale=unit)
    lines = [
        Finding("guess" if options.form is None else "ok", "depth", _WHERE, f"{_WORDS[form]}: nothing known is in the "
                "picture to tell", "--depth planar or radial, or render the check layer"),
        Finding("guess", "unit", _WHERE, f"{unit_of(unit)}: elements are {middle * unit:.2g} m away, the characters "
                f"{usual:.2g} m", "--unit, if that is wrong"),
    ]  # fmt: skip
    if not 1 / 20 < middle * unit / usual < 20:
        text = f"about {middle * unit:.2g} m away, the characters {usual:.2g} m"
        if every.max() <= 1:
            text = f"depths from {every.min():.2g} to {every.max():.2g}: they seem to be normalised"
        lines.append(Finding("problem", "depth", _WHERE, text, "render depth in units of length"))
    return convention, lines


def _camera(
    samples: Sequence[DepthSample], convention: Convention, is_checked: bool, scene: ShotScene, rows: Sequence[int]
) -> Finding:
    share, beyond = _agreement(samples, convention)
    if share >= _LIMBS and beyond <= _BEYOND:
        return Finding("ok", "camera", _WHERE, f"limbs are where the shot's camera sees them ({share:.0%} agree)")
    if is_checked:
        for shift in (-1, 1, -2, 2):
            moved = [(sample, row + shift) for sample, row in zip(samples, rows, strict=True)]
            moved = [(sample, row) for sample, row in moved if 0 <= row < len(scene.frames)]
            others = [_sample(np.asarray(sample.raw, np.float32), scene, row) for sample, row in moved]
            near, off = _agreement(others, convention)
            if others and near > max(_LIMBS, share + 0.05) and off < beyond:
                text = f"pictures show the shot's frames {abs(shift)} {'later' if shift > 0 else 'earlier'}"
                return Finding("problem", "camera", _WHERE, text, f"--shift {shift} more than now")
        text = f"another camera: {share:.0%} of the limbs' pixels are where the shot's camera sees them"
        remedy = "render with the camera of a new pegbar export: picture size, film offset, pixel aspect, no overscan"
        return Finding("problem", "camera", _WHERE, text, remedy)
    fit = fit_ground(samples, convention, (convention.form,))
    if fit.share >= _GROUND and fit.pixels >= _GROUND_PIXELS and abs(fit.scale / convention.scale - 1) < 0.02:
        text = f"the ground is where it should be ({fit.share:.0%} agree); this does not tell a pan"
        return Finding("ok", "camera", _WHERE, text, "")
    text = "not checked: neither limbs nor ground are in the picture"
    return Finding("guess", "camera", _WHERE, text, "render the check layer, or look at the composite")


def _agreement(samples: Sequence[DepthSample], convention: Convention) -> tuple[float, float]:
    """Shares of the limbs' pixels that have their depth, and that are farther away, which nothing can explain."""
    same = beyond = total = 0
    for sample in samples:
        ratio = convention.planar(sample.raw, sample.rays)[sample.inner] / sample.limbs[sample.inner]
        same += int((np.abs(ratio - 1) < _FARTHER - 1).sum())
        beyond += int((ratio >= _FARTHER).sum())
        total += ratio.size
    return (same / total, beyond / total) if total else (0.0, 0.0)


def _said(start: Convention, raws: Sequence[NDArray[np.float32]]) -> list[Finding]:
    every = np.concatenate([raw.ravel() for raw in raws])
    kinds = {
        "inf": np.isinf(every),
        "NaN": np.isnan(every),
        "0": every == 0,
        "1e9 and more": np.isfinite(every) & (np.abs(every) >= 1e9),
    }
    if start.background is not None:
        kinds[f"{start.background:g}"] = every == start.background
    there = [name for name, flags in kinds.items() if flags.any()]
    kind: Literal["ok", "mended"] = "ok" if set(there) <= {"inf", "1e9 and more"} else "mended"
    lines = [Finding(kind, "background", _WHERE, f"depth {' and '.join(there)}" if there else "none: all is filled")]
    if start.negative:
        lines.append(Finding("mended", "depth", _WHERE, "negative: it counts backwards", "turned round"))
    return lines


def _usual(scene: ShotScene, rows: Sequence[int]) -> float:
    """How far the characters' markers are, metres."""
    found = [scene.cameras[row].depth(character.markers[row]) for row in rows for character in scene.characters]
    return float(np.nanmedian(np.concatenate(found)))


def _alpha(pictures: Sequence[NDArray[np.float32]], options: ImportOptions) -> tuple[Alpha, Finding]:
    if options.alpha is not None:
        return options.alpha, Finding("ok", "alpha", _WHERE, f"{options.alpha}, as you say")
    kind = alpha_kind(pictures)
    if kind is None:
        text = "soft edges do not tell; taken as premultiplied, as EXR files are"
        return "premultiplied", Finding("guess", "alpha", _WHERE, text, "--alpha straight, if edges are bright")
    if kind == "straight":
        return kind, Finding("mended", "alpha", _WHERE, "straight", "colours multiplied by it")
    return kind, Finding("ok", "alpha", _WHERE, "premultiplied")
