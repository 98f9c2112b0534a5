"""Programs that pretend to be Blender, well or badly."""

from __future__ import annotations

import sys
from pathlib import Path

_FAKE = """#!{python}
import os, signal, sys, time
if "--version" in sys.argv:
    print("{says}")
    raise SystemExit({code})
if "--python-expr" in sys.argv:
    print({answers!r})
    raise SystemExit
arguments = sys.argv[sys.argv.index("--") + 1:]
{body}
"""


def fake_blender(
    folder: Path, body: str = "", *, says: str = "Blender 5.0.1", code: int = 0, answers: str = "pegbar:lacks"
) -> str:
    """Write an executable that answers --version with ``says`` and else runs ``body``; return its path.

    Asked for what it lacks it says ``answers``.
    """
    path = folder / "fake-blender"
    path.write_text(_FAKE.format(python=sys.executable, body=body, says=says, code=code, answers=answers))
    path.chmod(0o755)
    return str(path)
