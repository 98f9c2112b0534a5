"""`pegbar align`: cameras, and the drawing's joints in 3D."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from pegbar.cli.batch import progress

if TYPE_CHECKING:
    from pegbar.scene.alignment import Alignment

_ROOTS = {"in_place": "stays in place", "travel": "travels"}


def align(
    shot: Path,
    /,
    *,
    overwrite: Annotated[bool, Parameter(negative="", help="Align again what is up to date.")] = False,
) -> int:
    """Align a shot's drawing with its clip; see `pegbar align --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.align_stage import AlignStage
    from pegbar.shot.plan import open_shot
    from pegbar.shot.remarks import Remarks

    stage = AlignStage(open_shot(shot, aligned=False), overwrite)
    with progress("align", len(stage.numbers)) as advance:
        alignment, made = stage.run(lambda _done, _all: advance())
    # Whoever aligns again wants to hear it again.
    remarks = Remarks()
    remarks.add(alignment.notes, alignment.warnings, made=True)
    for line in remarks.lines(shot):
        print(f"pegbar: {line}", file=sys.stderr)
    print(f"align: {summary(alignment)}")
    where = os.path.relpath(stage.folder)
    count = len(stage.numbers)
    print(f"align: {count} drawing{'' if count == 1 else 's'} {'aligned' if made else 'up to date'}, in {where}")
    return 0


def summary(alignment: Alignment) -> str:
    """Return camera, error and what was guessed in one line."""
    import numpy as np

    camera = alignment.cameras[0]
    usual, worst = float(np.median(alignment.errors)), int(np.argmax(alignment.errors))
    parts = [
        f"{alignment.mode} camera, {math.degrees(camera.field_of_view):.0f} degrees wide",
        f"the clip's root {_ROOTS.get(alignment.root, 'travels in part')}",
        f"clip and drawing {usual:.1f} px apart (at most {alignment.errors[worst]:.1f})",
    ]
    guessed = int(alignment.estimated.sum())
    if guessed:
        parts.append(f"{guessed} hidden joints guessed")
    return ", ".join(parts)
