"""`pegbar dots`: joint marks from a layer of coloured dots."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def dots(
    shot: Path,
    /,
    *,
    overwrite: Annotated[bool, Parameter(negative="", help="Read the dots again.")] = False,
) -> int:
    """Read joint marks from a layer of dots; see `pegbar dots --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.dots_stage import DotsStage

    stage = DotsStage(shot, overwrite)
    remarks, made = stage.run()
    for remark in remarks:
        print(f"pegbar: note: {remark}", file=sys.stderr)
    print(f"dots: {'written' if made else 'up to date'}: {os.path.relpath(stage.output)}")
    return 0
