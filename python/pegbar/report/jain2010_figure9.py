"""Figure 9 of Jain et al. 2010 for people: the clips read, a table, files of numbers and a plot."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from pegbar.report.clips import read_clips
from pegbar.report.jain2010 import SOURCES, STEP, TRUTH, Result, figure9

NAME = "jain2010-fig9"
_COLORS = ("#1f77b4", "#17becf", "#d62728", "#ff7f0e", "#9467bd", "#2ca02c", "#8c564b", "#555555")


def reproduce(data: Path, output: Path) -> list[str]:
    """Repeat the experiment with the clips in ``data``, write its files into ``output`` and return the table's lines.

    Raises
    ------
    FileNotFoundError
        For a folder that is not there.
    ValueError
        For a clip that the folder does not hold, naming it.
    FormatError
        For a broken clip.
    """
    result = figure9(read_clips(data, (TRUTH, *(source.clip for source in SOURCES))))
    output.mkdir(parents=True, exist_ok=True)
    files = [output / f"{NAME}.csv", output / f"{NAME}-frames.csv", output / f"{NAME}.png"]
    _write_means(files[0], result)
    _write_frames(files[1], result)
    write_plot(files[2], result)
    return [*table(result), "", *findings(result), "", *(f"wrote {file}" for file in files)]


def table(result: Result) -> list[str]:
    """Return the lines of the table: a clip a row, a way a column, mean errors in metres."""
    ways = list(result.errors)
    heads = [way.split(", ")[-1] for way in ways]
    views = [way if ", " not in way else "" for way in ways]
    lines = [
        f"Mean depth error in metres of {TRUTH} (a walk) with the depth of other clips; every {STEP}th frame",
        "",
        f"{'':32}" + "".join(f"{view:>15}" for view in views),
        f"{'clip':8}{'shows':24}"
        + "".join(f"{'start' if h == w else h:>15}" for h, w in zip(heads, ways, strict=True))
        + f"{'slow (side)':>13}  printed",
    ]
    for source in SOURCES:
        means = "".join(f"{result.mean(way, source.clip):15.3f}" for way in ways)
        lines.append(f"{source.clip:8}{source.shows:24}{means}{source.slow:13.3f}  {source.printed}")
    return [
        *lines,
        "",
        "start: faces as the walk at its start; whole: by the mean facing; registered: the camera that pegbar",
        "align finds for the clip itself. slow: a slow transcription (not the paper's figures, which are only drawn).",
    ]


def findings(result: Result) -> list[str]:
    """Return what the paper claims of figure 9, and what came out, claim by claim (side view)."""
    side = {source.clip: result.mean("side", source.clip) for source in SOURCES}
    lowest, worst = min(side, key=side.__getitem__), max(side, key=side.__getitem__)
    curve = [result.mean(way, "16_11") / result.mean(way, "35_01") for way in ("side", "side, whole")]
    lines = [
        f"another actor's walk is lowest: {_yes(lowest == '35_01')} ({lowest}, {side[lowest]:.3f} m)",
        f"run and broad jump are alike: {side['35_17']:.3f} and {side['09_01']:.3f} m, {side['16_05']:.3f} m",
        f"the curved walk errs more than run and jump: "
        f"{_yes(side['16_11'] > max(side[clip] for clip in ('35_17', '09_01', '16_05')))} ({side['16_11']:.3f} m, "
        f"{curve[0]:.1f} times the walk; {curve[1]:.1f} times by the mean facing)",
        f"the side shuffle errs less than the curved walk: {_yes(side['127_32'] < side['16_11'])} "
        f"({side['127_32']:.3f} m; its stand-in ducks under an obstacle, worst: {worst})",
    ]
    if "side, registered" in result.errors:
        changes = (f"{s.clip} {side[s.clip]:.3f} -> {result.mean('side, registered', s.clip):.3f}" for s in SOURCES)
        lines.append(f"with a registered camera instead of aligned roots (side): {', '.join(changes)}")
    return lines


def _yes(holds: bool) -> str:
    return "yes" if holds else "no"


def _write_means(path: Path, result: Result) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["clip", "shows", *(f"{way} (m)" for way in result.errors), "slow side (m)", "printed"])
        for source in SOURCES:
            means = [f"{result.mean(way, source.clip):.5f}" for way in result.errors]
            writer.writerow([source.clip, source.shows, *means, source.slow, source.printed])


def _write_frames(path: Path, result: Result) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["way", "frame", "seconds", *(f"{source.clip} (m)" for source in SOURCES)])
        for way, errors in result.errors.items():
            rows = np.stack([errors[source.clip] for source in SOURCES], axis=1)
            for frame, row in enumerate(rows):
                writer.writerow([way, frame, f"{frame / result.rate:.4f}", *(f"{value:.5f}" for value in row)])


def write_plot(path: Path, result: Result) -> None:
    """Draw the errors over time as a PNG: views in columns, aligned and registered in rows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shown = [way for way in result.errors if "whole" not in way]
    most = max(float(errors.max()) for way in shown for errors in result.errors[way].values())
    rows = 1 + any("registered" in way for way in shown)
    figure = Figure(figsize=(13, 1 + 4.4 * rows), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    for way in shown:
        view, *registered = way.split(", ")
        _draw(panels[len(registered)][int(view != "side")], way, result)
    # Head room for the legends.
    panels[0][0].set_ylim(0, 1.35 * most)
    figure.suptitle(
        f"Depth error of a walk ({TRUTH}) that takes its depth from other clips (Jain et al. 2010, figure 9)"
    )
    figure.savefig(path, format="png")


def _draw(panel: Any, way: str, result: Result) -> None:
    for source, color in zip(SOURCES, _COLORS, strict=True):
        errors = result.errors[way][source.clip]
        label = f"{source.clip} {source.shows} ({errors.mean():.3f})"
        panel.plot(np.arange(len(errors)) / result.rate, errors, color=color, linewidth=1.3, label=label)
    panel.set_title(way, fontsize=10)
    panel.set_xlabel("seconds")
    panel.set_ylabel("mean depth error over markers (m)")
    panel.grid(alpha=0.3)
    panel.legend(fontsize=7, loc="upper center", ncols=2)
