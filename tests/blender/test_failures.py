"""Blender's own ways to fail."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from pegbar.errors import BlenderError
from pegbar.simulate.blender.locate import OLDEST, Blender
from pegbar.simulate.blender.process import run_blender


def test_the_version_is_blenders_own(blender: Blender, tmp_path: Path) -> None:
    script, said = tmp_path / "script.py", tmp_path / "said"
    script.write_text("import bpy, sys\nopen(sys.argv[1], 'w').write(bpy.app.version_string)")
    run_blender(blender, script, [str(said)], outputs=[said])
    assert said.read_text().split()[0] == blender.version
    assert tuple(map(int, blender.version.split(".")[:2])) >= OLDEST


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ("bpy.context.scene.render.engine = 'NO SUCH'", r"exit code 1(?s:.)*enum \"NO SUCH\" not found"),
        ("bpy.ops.wm.open_mainfile(filepath='nowhere.blend')", r"exit code 1(?s:.)*RuntimeError"),
        ("import ctypes; ctypes.string_at(0)", rf"signal {int(signal.SIGSEGV)}, SIGSEGV|exit code"),
    ],
)
def test_a_failure_inside_is_an_error_here(blender: Blender, tmp_path: Path, body: str, problem: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(f"import bpy\n{body}\n")
    with pytest.raises(BlenderError, match=problem):
        run_blender(blender, script, patience=60)
