"""`pegbar composite`: drawing and rendered passes in depth order."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from pegbar.cli.batch import BatchOptions, run_stage

if TYPE_CHECKING:
    from pegbar.shot.plan import Shot


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """What a shot file would say, for users who have none; each also replaces that key of a shot file."""

    drawings: Annotated[str | None, Parameter(help="Drawn frames, like d.####.png.")] = None
    labels: Annotated[str | None, Parameter(help="Limb-colour pictures, like l.####.png.")] = None
    annotations: Annotated[str | None, Parameter(help="Joint marks, limbs and depths (JSON).")] = None
    drawing_depth: Annotated[str | None, Parameter(help="Depth of the drawings (EXR), instead of labels.")] = None
    beauty: Annotated[str | None, Parameter(help="Rendered colour and alpha, like b.####.exr.")] = None
    depth: Annotated[str | None, Parameter(help="Rendered depth (default: in the beauty files).")] = None
    unit: Annotated[str | None, Parameter(help="Unit of the rendered depth: m, cm, mm, inch, foot.")] = None
    matte: Annotated[str | None, Parameter(help="auto, ink, unmix, fill or alpha.")] = None
    hold: Annotated[int | None, Parameter(help="Frames that each drawing is shown for (2: on twos).")] = None
    output: Annotated[str | None, Parameter(help="Finished frames, like out.####.png or out.####.exr.")] = None
    holdout: Annotated[str | None, Parameter(help="Also write the matte that holds the render out.")] = None
    space: Annotated[
        Literal["display", "linear"] | None, Parameter(help="Light that is composited in (linear: EXR frames).")
    ] = None


_KEYS = {
    "drawings": ("drawing", "frames"),
    "labels": ("drawing", "labels"),
    "annotations": ("drawing", "annotations"),
    "drawing_depth": ("drawing", "depth"),
    "beauty": ("passes", "beauty"),
    "depth": ("passes", "depth"),
    "unit": ("passes", "unit"),
    "matte": ("drawing", "matte"),
    "hold": ("drawing", "hold"),
    "output": ("output", "frames"),
    "holdout": ("output", "holdout"),
    "space": ("output", "space"),
}
_PATHS = {"drawings", "labels", "annotations", "drawing_depth", "beauty", "depth", "output", "holdout"}


def composite(shot: Path | None = None, files: FileOptions | None = None, options: BatchOptions | None = None) -> int:
    """Composite a shot; see `pegbar composite --help`.

    Parameters
    ----------
    shot
        The shot file; without one, give at least --drawings, --beauty and --output.
    """
    from pegbar.shot.stages import CompositeStage

    options = options or BatchOptions()
    plan = _plan(shot, files or FileOptions())
    if plan.beauty is None:
        raise ValueError("composite: the shot has no [passes] with a beauty sequence")
    return run_stage("composite", CompositeStage(plan, options.overwrite), options)


def _plan(path: Path | None, files: FileOptions) -> Shot:
    from pegbar.shot.load import validate_shot
    from pegbar.shot.plan import open_shot, plan_shot

    given = {field.name: getattr(files, field.name) for field in fields(files)}
    given = {name: value for name, value in given.items() if value is not None}
    if path is not None:
        shot = open_shot(path)
        if not given:
            return shot
        table: dict[str, Any] = shot.settings.model_dump(exclude_unset=True)
        folder, source = shot.folder, str(path)
    else:
        for name in ("drawings", "beauty", "output"):
            if name not in given:
                raise ValueError(f"composite: give a shot file, or --{name}")
        table, folder, source = {}, Path.cwd(), "options"
    for name, value in given.items():
        section, key = _KEYS[name]
        table.setdefault(section, {})[key] = str(Path(value).absolute()) if name in _PATHS else value
    return plan_shot(validate_shot(table, source), folder, source)
