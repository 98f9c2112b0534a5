"""`pegbar depth`: depth of every drawn pixel."""

from __future__ import annotations

from pathlib import Path

from pegbar.cli.batch import BatchOptions, run_stage


def depth(shot: Path, *, options: BatchOptions | None = None) -> int:
    """Write the depth of a shot's drawings; see `pegbar depth --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.plan import open_shot
    from pegbar.shot.stages import DepthStage

    options = options or BatchOptions()
    return run_stage("depth", DepthStage(open_shot(shot), options.overwrite), options)
