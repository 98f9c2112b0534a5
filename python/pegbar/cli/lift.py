"""`pegbar lift`: a drawn sequence as 3D animation."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pegbar.cli.batch import progress


def lift(
    shot: Path,
    /,
    *,
    overwrite: Annotated[bool, Parameter(negative="", help="Lift again what is up to date.")] = False,
) -> int:
    """Make a 3D animation of a shot's drawing; see `pegbar lift --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.align_stage import AlignStage
    from pegbar.shot.lift_stage import LiftStage
    from pegbar.shot.plan import open_shot
    from pegbar.shot.remarks import Remarks

    stage, remarks = LiftStage(AlignStage(open_shot(shot, aligned=False)), overwrite), Remarks()
    with progress("align", len(stage.align.numbers)) as advance:
        alignment, aligned = stage.align.run(lambda _done, _all: advance())
    remarks.add(alignment.notes, alignment.warnings, made=aligned)
    values, made = stage.run()
    remarks.add(values["notes"], made=True)
    for line in remarks.lines(shot):
        print(f"pegbar: {line}", file=sys.stderr)
    parts = [
        f"markers {values['marker_reprojection_px']:.1f} px and skeleton {values['skeleton_reprojection_px']:.1f} px "
        "from the drawing",
        f"skeleton {100 * values['skeleton_to_markers_m']:.1f} cm from the markers",
        f"limbs change by {values['limb_length_residual']:.1%}",
        f"{100 * values['to_clip_m']:.0f} cm from the clip",
    ]
    if (slide := values["foot_slide_worst_m"]) is not None:
        parts.append(f"standing feet slide {1000 * slide:.0f} mm at most")
    print(f"lift: {', '.join(parts)}")
    files = ", ".join(path.name for path in stage.outputs())
    print(f"lift: {'written' if made else 'up to date'}: {files}, in {os.path.relpath(stage.folder)}")
    return 0
