"""`pegbar report`: one page with what every stage of a shot has found."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def report(
    shot: Path,
    /,
    *,
    output: Annotated[
        Path | None, Parameter(name=("--output", "-o"), help="The page (default: report.html beside the shot file).")
    ] = None,
) -> int:
    """Write one page of all that a shot's stages have left; see `pegbar report --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.io import atomic
    from pegbar.report.page import html_page
    from pegbar.shot.plan import open_shot
    from pegbar.shot.shot_report import has_results, report_sections

    found = open_shot(shot, aligned=False)
    sections = report_sections(found)
    if not has_results(sections):
        first = "pegbar align, secondary, lift, depth or composite"
        print(f"pegbar: note: no stage of this shot has run yet: run {first} first", file=sys.stderr)
    page = output or found.folder / "report.html"
    name = found.settings.shot.name or shot.stem
    lead = (
        f"What pegbar has found and made for {shot.name}. Stages that have not run are left out; figures with a limit "
        "are those that pegbar warns of above it. A click on a picture shows it in full size, another one puts it back."
    )
    page.parent.mkdir(parents=True, exist_ok=True)
    atomic.write_bytes(page, html_page(name, lead, sections).encode())
    print(f"report: {', '.join(section.title for section in sections)}, in {os.path.relpath(page)}")
    return 0
