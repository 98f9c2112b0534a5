"""Fills the report of a clip that stands in metres with Y up: floor, facing, travel and what looks wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pegbar.scene.body import MARKERS
from pegbar.scene.clip_report import ClipReport
from pegbar.scene.gait import facing, floor_height, hurried, travel
from pegbar.scene.joints import EXTRA
from pegbar.scene.motion import Motion


def examine(motion: Motion, report: ClipReport) -> ClipReport:
    """Return ``report`` with what the frames of ``motion`` tell; an inserted T-pose is left out."""
    known = motion.known_markers
    kept = np.arange(len(motion.positions)) != (-1 if motion.rest_frame is None else motion.rest_frame)
    wanted = [name for name in (*MARKERS, *EXTRA) if name in known]
    places = motion.markers(wanted, centres=not any(parent >= 0 for parent in motion.parents))[kept]
    markers = {name: places[:, column] for column, name in enumerate(wanted)}
    missing = tuple(name for name in MARKERS if name not in markers)
    notes = list(report.notes)
    feet = {name: points for name, points in markers.items() if name.endswith(("_foot", "_toe"))}
    height = report.height or 1.7
    azimuth = facing(markers)
    turned = azimuth[np.isfinite(azimuth)] if azimuth is not None else np.empty(0)
    distance, direction = 0.0, None
    if azimuth is not None and "pelvis" in markers:
        distance, direction = travel(markers["pelvis"], azimuth)
    if azimuth is not None and _feet_behind(markers, azimuth):
        notes.append("the feet point backwards: left and right may be exchanged")
    if hurried(markers, motion.frame_rate):
        notes.append(f"faster than people move: the true frame rate may be {motion.frame_rate / 2:.4g}")
    if report.height is not None and not 1.2 < report.height < 2.3:
        notes.append(f"the person would be {report.height:.2f} m tall: the unit may be wrong")
    if missing:
        notes.append(f"not found: {', '.join(missing)}")
    if motion.rest_frame is not None:
        notes.append(f"frame {motion.rest_frame} (from 0) is an inserted T-pose")
    return replace(
        report,
        floor=floor_height(feet, motion.frame_rate, height),
        facing=(float(turned[0]), float(turned[-1])) if len(turned) else None,
        travel=distance,
        direction=direction,
        missing=missing,
        notes=tuple(notes),
    )


def _feet_behind(markers: dict[str, np.ndarray], azimuth: np.ndarray) -> bool:
    """Whether toes are behind ankles, seen the way that hips and shoulders face."""
    ahead = np.stack([np.sin(np.radians(azimuth)), np.zeros(len(azimuth)), np.cos(np.radians(azimuth))], axis=1)
    reaches = [
        ((markers[f"{side}_toe"] - markers[f"{side}_foot"]) * ahead).sum(axis=1)
        for side in ("left", "right")
        if f"{side}_toe" in markers and f"{side}_foot" in markers
    ]
    return bool(reaches) and bool(np.isfinite(reaches).any()) and bool(np.nanmedian(reaches) < 0)
