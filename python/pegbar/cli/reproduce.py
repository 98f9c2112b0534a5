"""`pegbar reproduce`: experiments of the papers, repeated on clips that the user has."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

#: Where each experiment is: a function of the folder with clips and the folder to write to, which returns the lines to
#: print.
EXPERIMENTS = {
    "jain2009-table1": "pegbar.report.jain2009_table1:reproduce",
    "jain2010-fig9": "pegbar.report.jain2010_figure9:reproduce",
    "foot-contact": "pegbar.report.foot_contact:reproduce",
}


def reproduce(
    experiment: str,
    /,
    *,
    data: Annotated[Path, Parameter(help="A folder that holds the experiment's clips somewhere.")],
    output: Annotated[Path, Parameter(name=["--output", "-o"], help="Folder to write to.")] = Path("reproduced"),
) -> int:
    """Repeat an experiment; see `pegbar reproduce --help`.

    Parameters
    ----------
    experiment
        Which experiment.
    """
    if experiment not in EXPERIMENTS:
        raise ValueError(f"experiment: want {' or '.join(EXPERIMENTS)}, got {experiment}")
    module, function = EXPERIMENTS[experiment].split(":")
    for line in getattr(import_module(module), function)(data, output):
        print(line)
    return 0
