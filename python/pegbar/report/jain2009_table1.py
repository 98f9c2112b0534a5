"""Table 1 and figure 10 of Jain, Sheikh, Hodgins 2009 for people: clips read, tables, files of numbers, a plot."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from pegbar.io.motion import read_motion
from pegbar.report.clips import find_clip
from pegbar.report.jain2009 import (
    MARKERS,
    NOISES,
    OFFSETS,
    PAIRS,
    PRINTED,
    PRINTED_CLIP,
    UPPER,
    VIEWS,
    WAYS,
    Lifted,
    Result,
    coordinate_errors,
    culprit,
    table1,
)

NAME = "jain2009-table1"
_COLORS = dict(zip(WAYS, ("#1f77b4", "#ff7f0e", "#2ca02c"), strict=True))
_ALL = slice(None)


def reproduce(data: Path, output: Path) -> list[str]:
    """Repeat the experiment with the clips in ``data``, write its files into ``output`` and return the lines to print.

    Raises
    ------
    FileNotFoundError
        For a folder that is not there.
    ValueError
        For a clip that the folder does not hold, naming it.
    FormatError
        For a broken clip.
    """
    paths = {clip: find_clip(data, clip) for clip in sorted({clip for pair in PAIRS for clip in pair})}
    result = table1({clip: read_motion(path, unit="cmu") for clip, path in paths.items()})
    output.mkdir(parents=True, exist_ok=True)
    files = [output / f"{NAME}.csv", output / f"{NAME}-views.csv", output / f"{NAME}.png"]
    _write_offsets(files[0], result)
    _write_views(files[1], result)
    write_plot(files[2], result)
    lines = [*table(result), "", *views(result), "", *worst(result), "", *findings(result)]
    return [*lines, "", *(f"wrote {file}" for file in files)]


def table(result: Result) -> list[str]:
    """Return table 1, the paper's beside ours: a camera offset a row."""
    names = [f"{truth} with {clip}" for truth, clip in PAIRS]
    lines = [
        "Error of the lifted upper body as a ratio to the time-aligned clip's, camera off by some degrees",
        "",
        f"{'off by':>14}{'paper':>16}" + "".join(f"{name:>18}" for name in names) + f"{'mean':>8}" + f"{'refine':>9}"
        f"{'lengths given':>15}",
    ]
    for offset in OFFSETS:
        paper = f"{PRINTED[offset][0] / PRINTED_CLIP[0]:.2f} ({PRINTED[offset][0]:.4f})" if offset in PRINTED else "-"
        ratios = "".join(f"{result.offsets[pair][offset].ratio(WAYS[0]):18.3f}" for pair in PAIRS)
        means = [result.mean_ratio(way, offset) for way in WAYS]
        lines.append(f"{offset[0]:+7d}{offset[1]:+7d}{paper:>16}{ratios}{means[0]:8.3f}{means[1]:9.3f}{means[2]:15.3f}")
    exact = [result.offsets[pair][0, 0] for pair in PAIRS]
    metres = "  ".join(
        f"{name}: {lifted.clip_error():.4f} -> {lifted.error(WAYS[0]):.4f} m"
        for name, lifted in zip(names, exact, strict=True)
    )
    return [
        *lines,
        "",
        f"Camera as it is, root mean square error of clip -> closed form: {metres}",
        "off by: azimuth, elevation. Pairs: the closed form. paper: its mean error over its clip's 0.0062 m.",
    ]


def views(result: Result) -> list[str]:
    """Return the ratios from front, three-quarter and side, with noisy marks, upper body and whole body."""
    lines = [
        "Mean ratio over the three pairs: upper body / whole body",
        "",
        f"{'view':>14}{'noise':>8}" + "".join(f"{way:>24}" for way in WAYS),
    ]
    for view in VIEWS:
        for noise in NOISES:
            lifted = [result.views[pair][view, noise] for pair in PAIRS]
            cells = [" / ".join(f"{_mean(lifted, way, part):.3f}" for part in (UPPER, _ALL)) for way in WAYS]
            lines.append(f"{view:>14}{noise:>5} px" + "".join(f"{cell:>24}" for cell in cells))
    return [*lines, "", "noise: deviation of the marks in pixels of a picture in which the figure is 500 px tall."]


def _mean(lifted: list[Lifted], way: str, markers: slice) -> float:
    return float(np.mean([one.ratio(way, markers) for one in lifted]))


def worst(result: Result) -> list[str]:
    """Return where each way errs most, three-quarter view, exact marks; and where rigid limbs do from every view."""
    lines = ["Largest error, camera as it is:"]
    for pair in PAIRS:
        for way in WAYS:
            distance, frame, marker = result.offsets[pair][0, 0].worst(way)
            lines.append(f"  {pair[0]} with {pair[1]}, {way}: {distance:.3f} m, {marker}, frame {frame}")
    lines += [
        "",
        "Limb that errs most with refine (outer marker, root mean square), and frames with its depth's sign wrong:",
    ]
    for view, angles in VIEWS.items():
        for noise in NOISES[:2]:
            for pair in PAIRS:
                found = culprit(result.views[pair][view, noise], WAYS[1], angles)
                lines.append(
                    f"  {view}, {noise} px, {pair[0]} with {pair[1]}: {found.marker} {found.error:.3f} m, wrong in "
                    f"{found.wrong} frames, the clip in {found.clip_wrong}"
                )
    return lines


def findings(result: Result) -> list[str]:
    """Return what the paper claims, and what came out, claim by claim."""
    exact = [result.offsets[pair][0, 0].ratio(WAYS[0]) for pair in PAIRS]
    off = [lifted.ratio(WAYS[0]) for offsets in result.offsets.values() for lifted in offsets.values()]
    return [
        f"lifting is at least as much better than the clip as printed (0.73): {_yes(max(exact) <= 0.73)} "
        f"({', '.join(f'{ratio:.2f}' for ratio in exact)})",
        f"still better than the clip with the camera 10 degrees off: {_yes(max(off) < 1)} (worst {max(off):.2f})",
        "mean error over the upper body's coordinates, as figure 10 has it (printed: clip 0.0062 m, lifted 0.0045 m):",
        f"  {PAIRS[0][0]} with {PAIRS[0][1]}, another actor: {_coordinates(result.offsets[PAIRS[0]][0, 0])}",
        f"  one cycle of {PAIRS[0][0]} with its next: {_coordinates(result.same)}",
    ]


def _coordinates(lifted: Lifted) -> str:
    upper = slice(3 * UPPER.stop)
    clip, closed = (coordinate_errors(lifted, points)[upper].mean() for points in (lifted.clip, lifted.ways[WAYS[0]]))
    return f"clip {clip:.4f} m, lifted {closed:.4f} m"


def _yes(holds: bool) -> str:
    return "yes" if holds else "no"


def _write_offsets(path: Path, result: Result) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        heads = [f"{way} {what}" for way in WAYS for what in ("(m)", "ratio")]
        writer.writerow(["drawn", "clip", "azimuth off (deg)", "elevation off (deg)", "clip alone (m)", *heads])
        for pair, offsets in result.offsets.items():
            for offset, lifted in offsets.items():
                cells = [f"{value:.5f}" for way in WAYS for value in (lifted.error(way), lifted.ratio(way))]
                writer.writerow([*pair, *offset, f"{lifted.clip_error():.5f}", *cells])


def _write_views(path: Path, result: Result) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        heads = [f"{way} {what}" for way in WAYS for what in ("upper (m)", "whole (m)")]
        writer.writerow(["drawn", "clip", "view", "noise (px)", "clip upper (m)", "clip whole (m)", *heads])
        for pair, cases in result.views.items():
            for (view, noise), lifted in cases.items():
                cells = [lifted.clip_error(), lifted.clip_error(_ALL)]
                cells += [value for way in WAYS for value in (lifted.error(way), lifted.error(way, _ALL))]
                writer.writerow([*pair, view, noise, *(f"{value:.5f}" for value in cells)])


def write_plot(path: Path, result: Result) -> None:
    """Draw figure 10 as a PNG: the error over camera offsets, and over the markers' coordinates."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 9), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2)
    for column, axis in enumerate(("azimuth", "elevation")):
        _draw_offsets(figure.add_subplot(grid[0, column]), result, column, axis)
    _draw_coordinates(figure.add_subplot(grid[1, :]), result)
    figure.suptitle("A walk lifted with another walk (Jain, Sheikh, Hodgins 2009, table 1 and figure 10)")
    figure.savefig(path, format="png")


def _draw_offsets(panel: Any, result: Result, column: int, axis: str) -> None:
    offsets = sorted((offset for offset in OFFSETS if offset[1 - column] == 0), key=lambda offset: offset[column])
    degrees = [offset[column] for offset in offsets]
    for way in WAYS:
        for pair in PAIRS:
            ratios = [result.offsets[pair][offset].ratio(way) for offset in offsets]
            panel.plot(degrees, ratios, color=_COLORS[way], linewidth=0.8, alpha=0.5)
        means = [result.mean_ratio(way, offset) for offset in offsets]
        panel.plot(degrees, means, color=_COLORS[way], linewidth=2, marker="o", label=f"{way} (mean of three pairs)")
    paper = [(offset[column], PRINTED[offset][0] / PRINTED_CLIP[0]) for offset in offsets if offset in PRINTED]
    panel.plot(*zip(*paper, strict=True), "k^--", label="the paper")
    panel.axhline(1, color="#d62728", label="time-aligned clip")
    panel.set(xlabel=f"{axis} off by (degrees)", ylabel="error / clip's error, upper body", ylim=(0, 1.4))
    panel.grid(alpha=0.3)
    panel.legend(fontsize=7, loc="upper center", ncols=2)


def _draw_coordinates(panel: Any, result: Result) -> None:
    exact, off = (result.offsets[PAIRS[0]][offset] for offset in ((0, 0), (5, 0)))
    panel.plot(coordinate_errors(exact, exact.clip), color="#d62728", label="time-aligned clip")
    for way in WAYS:
        panel.plot(coordinate_errors(exact, exact.ways[way]), color=_COLORS[way], label=way)
    panel.plot(coordinate_errors(off, off.ways[WAYS[0]]), "k:", label=f"{WAYS[0]}, azimuth off by 5 degrees")
    panel.set_xticks(range(1, 3 * len(MARKERS), 3), MARKERS, rotation=45, ha="right", fontsize=7)
    panel.set(ylabel="RMS error over frames (m)", title=f"x, y, z of every marker, {PAIRS[0][0]} with {PAIRS[0][1]}")
    panel.grid(alpha=0.3)
    panel.legend(fontsize=8, loc="upper left")
