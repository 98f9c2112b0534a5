"""`pegbar motion`: what clips hold, as a table or as a picture."""

from __future__ import annotations

import json
import sys
from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from pegbar.cli.batch import progress
from pegbar.errors import describe
from pegbar.io.numbers import format_frames, parse_frames

if TYPE_CHECKING:
    from pegbar.scene.clip_report import ClipReport
    from pegbar.scene.motion import Motion

_COLUMNS = ("clip", "frames", "rate", "seconds", "height", "unit", "up", "T-pose", "floor", "faces", "way", "joints")
# A note on more clips than this stands once, with so many of their names.
_FEW = 3


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ClipOptions:
    """What is known of a clip better than its file and poses say."""

    skeleton: Annotated[Path | None, Parameter(help="The .asf file of an .amc (default: the one beside it).")] = None
    unit: Annotated[str | None, Parameter(help="Metres in the file's unit, or m, cm, mm, inch, foot, cmu.")] = None
    up: Annotated[
        str | None, Parameter(help="The file's up axis: x, y, z, -x, -y or -z.", allow_leading_hyphen=True)
    ] = None
    frame_rate: Annotated[float | None, Parameter(help="Frames a second.")] = None
    joint_map: Annotated[Path | None, Parameter(help="Joints that are to be other than found (TOML).")] = None

    def read(self, path: Path) -> tuple[Motion, ClipReport]:
        """The clip and what was found about it."""
        from pegbar.io.motion import read_motion

        try:
            unit = None if self.unit is None else float(self.unit)
        except ValueError:
            unit = self.unit  # type: ignore[assignment]
        motion = read_motion(
            path, skeleton=self.skeleton, unit=unit, up=self.up, frame_rate=self.frame_rate, joints=self.joint_map
        )
        assert motion.report is not None
        return motion, motion.report


def info(
    files: list[Path],
    /,
    *,
    joints: Annotated[Path | None, Parameter(help="Write the clip's joint map to this TOML file.")] = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Print JSON instead of a table.")] = False,
    options: ClipOptions | None = None,
) -> int:
    """Print what clips hold; see `pegbar motion info --help`.

    Parameters
    ----------
    files
        BVH, AMC or C3D files, or folders of such, with the folders below.
    """
    names = dict(_named(files))
    if joints is not None and len(files) != 1:
        raise ValueError(f"--joints: want one clip, got {len(files)}")
    if joints is not None and files[0].is_dir():
        raise ValueError(f"--joints: want one clip, got the folder {files[0]}")
    read, errors = _read(names, options or ClipOptions())
    if as_json:
        failed = [{"file": str(path), "error": problem} for path, problem in errors.items()]
        print(json.dumps([_facts(*clip) for clip in read] + failed, indent=2))
    elif read:
        _print_table(read, names)
    for problem in errors.values():
        print(f"pegbar: {problem}", file=sys.stderr)
    if joints is not None and read:
        from pegbar.io.joint_map import write_joint_map

        motion = read[0][1]
        write_joint_map(joints, motion.joint_map, derived=motion.derived)
        print(f"motion info: wrote {joints}", file=sys.stderr)
    return 1 if errors else 0


def _named(files: list[Path]) -> Iterator[tuple[Path, str]]:
    """The clips that are given or in given folders, and what to call each: in folders by their paths there."""
    from pegbar.io.clip_folder import clip_files

    for path in files:
        if path.is_dir():
            yield from ((found, found.relative_to(path).as_posix()) for found in clip_files(path))
        else:
            yield path, path.name


def _read(
    paths: Collection[Path], options: ClipOptions
) -> tuple[list[tuple[Path, Motion, ClipReport]], dict[Path, str]]:
    """The clips that can be read, and of the others why they cannot."""
    read: list[tuple[Path, Motion, ClipReport]] = []
    errors: dict[Path, str] = {}
    with progress("read clips", len(paths)) as advance:
        for path in paths:
            try:
                read.append((path, *options.read(path)))
            except (OSError, ValueError) as error:
                errors[path] = describe(error)
            advance()
    return read, errors


def plot(
    file: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(alias="-o", help="The picture (default: FILE with .png).")] = None,
    frames: Annotated[str | None, Parameter(help="Frames to draw, counted from 0 (default: 8 of them).")] = None,
    options: ClipOptions | None = None,
) -> int:
    """Draw poses of a clip; see `pegbar motion plot --help`.

    Parameters
    ----------
    file
        A BVH, AMC or C3D file.
    """
    from pegbar.io.frames import write_image
    from pegbar.report.pose_plot import plot_poses

    motion, _ = (options or ClipOptions()).read(file)
    chosen = None if frames is None else parse_frames(frames)
    if chosen is not None and (strange := [frame for frame in chosen if frame >= len(motion.positions)]):
        last = len(motion.positions) - 1
        raise ValueError(f"--frames: the clip has no frame {format_frames(strange)} (it has 0-{last})")
    target = output or file.with_suffix(".png")
    write_image(target, plot_poses(motion, chosen, title=file.name))
    print(f"motion plot: wrote {target}")
    return 0


def _print_table(clips: list[tuple[Path, Motion, ClipReport]], names: Mapping[Path, str]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(*_COLUMNS, box=None, pad_edge=False, header_style="bold")
    for column in (1, 2, 3, 4, 7, 8):
        table.columns[column].justify = "right"
    for clip in clips:
        table.add_row(names[clip[0]], *_row(clip[1], clip[2]))
    console = Console(soft_wrap=not sys.stdout.isatty(), highlight=False, markup=False)
    # Into a file or a pipe every clip has one line, however long.
    console.width = console.width if sys.stdout.isatty() else max(console.width, 400)
    console.print(table)
    notes: dict[str, list[str]] = {}
    for path, _, report in clips:
        for note in report.notes:
            notes.setdefault(note, []).append(names[path])
    for note, whose in notes.items():
        # What holds for a whole collection is said once.
        if len(whose) > _FEW:
            whose = [f"{len(whose)} clips ({', '.join(whose[:_FEW])}, ...)"]
        for name in whose:
            console.print(f"{name}: {note}")


def _row(motion: Motion, report: ClipReport) -> tuple[str, ...]:
    from pegbar.scene.body import MARKERS

    count = len(motion.positions)
    name = report.unit_from.rpartition(": ")[2] if ":" in report.unit_from else ""
    faces = "-" if report.facing is None else " to ".join(dict.fromkeys(str(round(angle)) for angle in report.facing))
    found = len(MARKERS) - len(report.missing)
    return (
        str(count),
        f"{motion.frame_rate:.4g}" + ("?" if report.rate_from == "assumed" else ""),
        f"{count / motion.frame_rate:.2f}",
        "-" if report.height is None else f"{report.height:.2f} m",
        f"{report.unit:.4g} m" + (f" ({name})" if name else ""),
        report.up,
        "-" if motion.rest_frame is None else str(motion.rest_frame),
        "-" if report.floor is None else f"{report.floor:+.3f} m",
        faces,
        f"{report.travel:.1f} m {report.way}",
        f"{found}/{len(MARKERS)}",
    )


def _facts(path: Path, motion: Motion, report: ClipReport) -> dict[str, Any]:
    return {
        "file": str(path),
        "frames": len(motion.positions),
        "frame_rate": motion.frame_rate,
        "rest_frame": motion.rest_frame,
        **asdict(report),
        "way": report.way,
        "joints": dict(motion.joint_map),
    }
