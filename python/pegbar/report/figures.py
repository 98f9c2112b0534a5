"""What stages have measured in words, with units, and beside it the limit at which pegbar warns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pegbar.report.lift_quality import FAR, RIGID
from pegbar.report.page import Figure
from pegbar.scene.alignment import MISFIT, Alignment

#: What lies deeper in a limb than this share of the character's height is warned of.
DEEP = 0.01
#: What the colours of skeletons mean, and those of depth pictures: as CSS writes them, and in words.
SIDES = (
    ("rgb(40, 90, 220)", "the character's left"),
    ("rgb(215, 50, 40)", "the character's right"),
    ("rgb(110, 110, 110)", "middle"),
)
NEARNESS = (
    ("rgb(190, 30, 5)", "nearest"),
    ("rgb(164, 252, 60)", "between"),
    ("rgb(70, 100, 220)", "farthest in the shot"),
)
_ROOTS = {"in_place": "stays in place", "travel": "travels"}
_PROGRAMS = {"pegbar": "pegbar", "blender": "Blender"}
# What of a report is told in other words, or elsewhere on the page.
_LIFT = {"limb_length_residuals", "skeleton_to_markers_worst", "standing", "notes", "figure_height_px"}
_SECONDARY = {"cloth", "strands", "particles", "seconds", "made", "notes", "warnings", "deepest_penetration_m"}


def alignment_figures(alignment: Alignment, numbers: Sequence[int]) -> tuple[Figure, ...]:
    """Return what was found for drawings ``numbers``."""
    height, errors = alignment.figure_height, alignment.errors
    usual, rms = float(np.median(errors)), float(np.sqrt(np.mean(errors**2)))
    worst, most = int(np.argmax(errors)), max(3 * usual, MISFIT * height)
    wide = math.degrees(alignment.cameras[0].field_of_view)
    guessed = int(alignment.estimated.sum())
    return (
        Figure("clip", Path(alignment.clip_path).name),
        Figure("camera", f"{alignment.mode}, {wide:.0f} degrees wide"),
        Figure("the clip's person", _ROOTS.get(alignment.root, "travels in part")),
        _judged(
            "clip to the drawn joints, all drawings",
            f"{rms:.1f} pixels, {rms / height:.1%} of the figure's height",
            rms <= MISFIT * height,
            f"{MISFIT:.0%} of the height",
        ),
        _judged(
            f"clip to the drawn joints, worst: drawing {numbers[worst]}",
            f"{errors[worst]:.1f} pixels",
            bool(errors[worst] <= most),
            f"{most:.0f} pixels",
        ),
        Figure("hidden joints that were guessed", f"{guessed} of {alignment.estimated.size}"),
        Figure("feet put on the ground", f"{int(alignment.grounded.sum())}"),
    )


def lift_figures(values: Mapping[str, Any]) -> tuple[Figure, ...]:
    """Return the figures of a lift's report; what is not known here stands at the end as it is."""
    told = dict(values)
    found = [Figure("drawings", str(told.pop("drawings", "")))]
    for key, name in (("marker_reprojection_px", "3D joints"), ("skeleton_reprojection_px", "skeleton")):
        if key in told:
            found.append(_on_the_drawing(name, told.pop(key), values.get("figure_height_px"), key.startswith("skel")))
    if changes := values.get("limb_length_residuals"):
        most = max(changes, key=lambda name: changes[name])
        name = f"limb whose length changes most: to the {_plain(most)}"
        found.append(_judged(name, f"{changes[most]:.1%}", changes[most] <= RIGID, f"{RIGID:.0%}"))
    if "limb_length_residual" in told:
        found.append(Figure("limbs change their length by, on average", f"{told.pop('limb_length_residual'):.1%}"))
    if worst := values.get("skeleton_to_markers_worst"):
        where = f"(most {100 * worst['m']:.1f} cm: {_plain(worst['joint'])} in drawing {worst['drawing']})"
        found.append(Figure("skeleton to the 3D joints", f"{100 * told.pop('skeleton_to_markers_m'):.1f} cm {where}"))
    for key, name in (("foot_slide_m_per_drawing", "on average"), ("foot_slide_worst_m", "at most")):
        if (slide := told.pop(key, None)) is not None:
            found.append(Figure(f"standing feet slide from drawing to drawing, {name}", f"{1000 * slide:.0f} mm"))
    for foot, runs in values.get("standing", {}).items():
        found.append(Figure(f"{_plain(foot)} stands in drawings", ", ".join(runs)))
    if "to_clip_m" in told:
        found.append(Figure("poses to the clip's", f"{100 * told.pop('to_clip_m'):.1f} cm: what the artist added"))
    travel = told.pop("loop_travel_m", [0.0])
    if np.any(travel):
        found.append(Figure("the loop travels", f"{100 * float(np.linalg.norm(travel)):.0f} cm"))
    if (size := told.pop("skeleton_size", 1.0)) != 1.0:
        found.append(Figure("the skeleton's own size", f"{size:.4g} times the figure's"))
    return (*found, *_rest({key: value for key, value in told.items() if key not in _LIFT}))


def secondary_figures(values: Mapping[str, Any]) -> tuple[Figure, ...]:
    """Return the figures of a secondary motion's report; what is not known here stands at the end as it is."""
    told = dict(values)
    names = {key: ", ".join(_plain(name) for name in told.pop(key, ())) for key in ("characters", "elements")}
    found = [
        Figure("frames", str(told.pop("frames", ""))),
        *(Figure(key, value or "-") for key, value in names.items()),
    ]
    for key, name in (("engine", "simulated by"), ("renderer", "rendered by")):
        if key in told:
            found.append(Figure(name, _PROGRAMS.get(str(value := told.pop(key)), str(value))))
    height, ground = told.pop("height_m", None), told.pop("ground_m", None)
    if height is not None:
        found.append(Figure("height of the tallest character", f"{height:.2f} m"))
    if ground is not None:
        found.append(Figure("height of the ground", f"{100 * ground:.1f} cm"))
    if "reprojection_px" in told:
        found.append(Figure("volumes to the drawn joints, at most", f"{told.pop('reprojection_px'):.1f} pixels"))
    if "overlap_before_m" in told:
        before, after = told.pop("overlap_before_m"), told.pop("overlap_after_m")
        found.append(Figure("limbs' volumes overlap by", f"{100 * before:.1f} cm, moved apart {100 * after:.1f} cm"))
    if "repaired_boxes" in told:
        found.append(Figure("limb boxes mended by other drawings", str(told.pop("repaired_boxes"))))
    for kind in ("cloth", "strands", "particles"):
        for name, part in values.get(kind, {}).items():
            found += _element(_plain(name), part, height)
    if (stretch := told.pop("stretch_p99", None)) is not None:
        found.append(Figure("all cloth: 99 of 100 threads are stretched by at most", f"{stretch:.1%}"))
    found += _rest({key: value for key, value in told.items() if key not in _SECONDARY})
    if seconds := values.get("seconds"):
        parts = (f"{name} {value:.1f} s" for name, value in seconds.items())
        found.append(Figure("computing time of the last run", ", ".join(parts)))
    return tuple(found)


def _on_the_drawing(name: str, apart: float, height: float | None, is_judged: bool) -> Figure:
    """How far 3D joints are seen from the drawn ones."""
    title = f"{name} to the drawn joints"
    if height is None:
        return Figure(title, f"{apart:.1f} pixels")
    value = f"{apart:.1f} pixels, {apart / height:.1%} of the figure's height"
    return (
        _judged(title, value, apart <= FAR * height, f"{FAR:.0%} of the height") if is_judged else Figure(title, value)
    )


def _element(name: str, part: Mapping[str, Any], height: float | None) -> Iterator[Figure]:
    """One element: what it is made of, how deep it lies in a limb, how far it is stretched."""
    rest = dict(part)
    counts = [f"{rest.pop(key)} {key}" for key in ("vertices", "strands", "points") if key in rest]
    if counts:
        yield Figure(f"{name}: made of", ", ".join(counts))
    if "deepest_penetration_m" in rest:
        deep, limb, frame = rest.pop("deepest_penetration_m"), rest.pop("in_limb", ""), rest.pop("in_frame", "")
        where = f": {_plain(limb)} in frame {frame}" if deep > 0 and limb else ""
        title = f"{name}: deepest in a limb"
        if height:
            limit = f"{1000 * DEEP * height:.0f} mm ({DEEP:.0%} of the height)"
            yield _judged(title, f"{1000 * deep:.1f} mm{where}", deep <= DEEP * height, limit)
        else:
            yield Figure(title, f"{1000 * deep:.1f} mm{where}")
    if "stretch_p99" in rest:
        usual, most, largest = (rest.pop(f"stretch_{key}", math.nan) for key in ("median", "p99", "max"))
        value = f"{usual:.1%} usually, 99 of 100 threads by at most {most:.1%}, one by {largest:.1%}"
        yield Figure(f"{name}: stretched by", value)
    for key, word in (("falling_mean", "falling"), ("settled_mean", "lying")):
        if key in rest:
            yield Figure(f"{name}: {word} at a time, on average", f"{rest.pop(key):.0f}")
    yield from _rest(rest, f"{name}: ")


def _judged(name: str, value: str, good: bool, limit: str) -> Figure:
    """A figure that pegbar warns of above ``limit``."""
    return Figure(name, value, f"good: up to {limit}" if good else f"look at it: more than {limit}", good)


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _rest(values: Mapping[str, Any], prefix: str = "") -> Iterator[Figure]:
    """The plain numbers and words of a report, those of its parts after theirs."""
    for key, value in values.items():
        name = f"{prefix}{_plain(key)}"
        if isinstance(value, Mapping):
            yield from _rest(value, f"{name}: ")
        elif isinstance(value, bool) or value is None or isinstance(value, str):
            yield Figure(name, "-" if value is None else str(value))
        elif isinstance(value, int | float):
            yield Figure(name, f"{value:.4g}" if isinstance(value, float) else str(value))
