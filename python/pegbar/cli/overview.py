"""What `pegbar` and `pegbar --help` print: every command on one line, by what it is for, within one screen."""

from __future__ import annotations

from collections.abc import Mapping

#: Commands by what they are for, in the order in which they are used.
SECTIONS = {
    "Begin": ("demo", "init", "check"),
    "The clip": ("match", "motion"),
    "The joints": ("dots", "align"),
    "Three jobs": ("secondary", "lift", "animate"),
    "Pictures": ("effects", "depth", "composite"),
    "Exchange": ("export", "import-passes"),
    "Results": ("report", "reproduce"),
}
_USAGE = "Hand-drawn animation joined with motion capture.  Usage: pegbar COMMAND ..."
_MORE = "pegbar COMMAND --help: options and an example.  pegbar --version"


def overview(commands: Mapping[str, str]) -> str:
    """Return the help of the whole, given every command's help, whose first line is shown."""
    shown = {name for names in SECTIONS.values() for name in names}
    sections = SECTIONS | {"More": tuple(name for name in commands if name not in shown)}
    rows = [
        (section if place == 0 else "", name, commands[name].partition("\n")[0])
        for section, names in sections.items()
        for place, name in enumerate(names)
    ]
    first, second = (max(len(row[column]) for row in rows) + 2 for column in (0, 1))
    lines = [f"{section:{first}}{name:{second}}{summary}" for section, name, summary in rows]
    return "\n".join([_USAGE, "", *lines, "", _MORE])
