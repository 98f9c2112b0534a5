"""Finds Blender: an executable, or a Python that has the module `bpy`, and its version."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from pegbar.errors import BlenderError

#: Names the Blender to use: an executable, or a Python that has bpy.
VARIABLE = "PEGBAR_BLENDER"
#: The oldest that the tests have run with.
OLDEST = (3, 4)
_PATIENCE = 60.0
_ASK_PYTHON = """
import importlib.metadata, importlib.util
if importlib.util.find_spec("bpy") is None:
    raise SystemExit("this Python has no module bpy")
try:
    version = importlib.metadata.version("bpy")
except importlib.metadata.PackageNotFoundError:
    import bpy
    version = bpy.app.version_string
print("Blender", version)
"""
# What distributions leave out. Debian's Blender uses the system's Python, and asks for no numpy.
_ASK_BLENDER = """
import importlib.util, bpy
built = bpy.app.build_options
parts = {"cycles": built.cycles, "freestyle": built.freestyle, "bullet": built.bullet}
parts["numpy"] = importlib.util.find_spec("numpy") is not None
print("pegbar:lacks", *(name for name, is_there in parts.items() if not is_there))
"""
_HELP = {"numpy": "install numpy for the Python that Blender uses (Debian, Ubuntu: apt install python3-numpy)"}


@dataclass(frozen=True)
class Blender:
    """A Blender that can be run: ``program`` is its executable, or a Python that has bpy; ``version`` like "5.0.1"."""

    program: str
    is_python: bool
    version: str

    def command(self, script: str | Path, arguments: tuple[str, ...] = ()) -> list[str]:
        """Return the command line that runs ``script`` without a window and without the user's own start-up file."""
        if self.is_python:
            return [self.program, str(script), "--", *arguments]
        start = ["--background", "--factory-startup", "--python-exit-code", "1", "--python", str(script)]
        return [self.program, *start, "--", *arguments]


def find_blender(setting: str | None = None, *, folder: str | Path = ".") -> Blender:
    """Return the Blender to use.

    Looked at are, in this order, ``setting`` (a path, relative to ``folder``, or a program on PATH), the environment
    variable PEGBAR_BLENDER (likewise, relative to the working folder), this Python's own bpy, and ``blender`` on PATH.

    Raises
    ------
    BlenderError
        Where there is none (the message says how to install it), and for one that is named and does not exist, is no
        Blender, is older than 3.4, or was built without what we need.
    """
    for named, base in ((setting, Path(folder)), (os.environ.get(VARIABLE), Path())):
        if named:
            return ask_version(_program(named, base))
    if importlib.util.find_spec("bpy") is not None:
        return ask_version(sys.executable)
    if found := shutil.which("blender"):
        return ask_version(found)
    raise BlenderError(
        "there is no Blender: install 3.4 or later (blender.org, or the distribution's) so that `blender` is on PATH, "
        f"or the module bpy into a Python 3.11 of its own (pip install bpy), and set {VARIABLE} to executable or Python"
    )


def ask_version(program: str) -> Blender:
    """Return what kind of Blender ``program`` is; BlenderError for none and for one that is too old or lacks parts."""
    said = _ask([program, "--version"])
    is_python = re.match(r"Python \d", said) is not None
    if is_python:
        said = _ask([program, "-c", _ASK_PYTHON])
    found = re.search(r"^Blender (\d+)\.(\d+)\S*", said, re.MULTILINE)
    if found is None:
        raise BlenderError(f"{program}: this is no Blender: it says {_short(said)}")
    version = found[0].removeprefix("Blender ")
    if (int(found[1]), int(found[2])) < OLDEST:
        oldest = ".".join(map(str, OLDEST))
        raise BlenderError(f"{program}: Blender {version} is too old: want {oldest} or later")
    if not is_python:
        _refuse_without_parts(program, version)
    return Blender(program, is_python, version)


def _refuse_without_parts(program: str, version: str) -> None:
    """Raise BlenderError for an executable that was built, or installed, without something that our scripts use."""
    said = _ask([program, "--background", "--factory-startup", "--python-expr", _ASK_BLENDER])
    found = re.search(r"^pegbar:lacks(.*)", said, re.MULTILINE)
    if found is None:
        raise BlenderError(f"{program}: Blender {version} runs no scripts: it says {_short(said)}")
    if lacks := found[1].split():
        helps = [_HELP.get(name, "take a build from blender.org") for name in lacks]
        raise BlenderError(
            f"{program}: Blender {version} is without {', '.join(lacks)}: {'; '.join(dict.fromkeys(helps))}"
        )


def _program(named: str, base: Path) -> str:
    path = base / Path(named).expanduser()
    if path.is_dir():
        raise BlenderError(f"{path}: this is a folder: name the executable, or a Python that has bpy")
    if path.is_file():
        return str(path.absolute())
    if found := shutil.which(named):
        return found
    raise BlenderError(f"{named}: no such Blender: name an executable, or a Python that has bpy")


def _ask(command: list[str]) -> str:
    """What a program says to a question about itself."""
    try:
        answer = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=_PATIENCE
        )
    except subprocess.TimeoutExpired:
        raise BlenderError(f"{command[0]}: no answer within {_PATIENCE:g} s") from None
    except OSError as error:
        raise BlenderError(f"{command[0]}: it cannot be started: {error.strerror or error}") from None
    said = answer.stdout.decode(errors="replace").strip()
    if answer.returncode:
        raise BlenderError(f"{command[0]}: this is no Blender: exit code {answer.returncode}, it says {_short(said)}")
    return said


def _short(text: str) -> str:
    last = text.splitlines()[-1][:200] if text else "nothing"
    return repr(last)
