"""Blender's own ways to fail."""

from __future__ import annotations

import os
import signal
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from pegbar.errors import BlenderError
from pegbar.simulate.blender.engine import BlenderEngine
from pegbar.simulate.blender.locate import OLDEST, Blender
from pegbar.simulate.blender.process import run_blender
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Balls, Cloth, Pin
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.scene import PreRoll, SimulationScene


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
        ("import ctypes; ctypes.string_at(0)", r"signal 11, SIGSEGV|exit code"),
        ("import os; os.kill(os.getpid(), 9)", r"was killed \(signal 9, SIGKILL\); its last lines:(?s:.)*  at work"),
        ("import os; os.abort()", r"signal 6, SIGABRT"),
        ("raise SystemExit('no such shot')", r"exit code 1; its last lines:(?s:.)*  no such shot"),
        ("bpy.ops.wm.quit_blender()", r"ended before its script did|exit code|signal|did not write"),
        ("pass", r"did not write frame\.exr; its last lines:(?s:.)*  at work"),
        ("import time; time.sleep(100)", r"said nothing for 5 s and was ended; its last lines:(?s:.)*  at work"),
    ],
)
def test_a_failure_inside_is_an_error_here(blender: Blender, tmp_path: Path, body: str, problem: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(f"import bpy\nprint('at work', flush=True)\n{body}\n")
    with pytest.raises(BlenderError, match=problem) as caught:
        run_blender(blender, script, outputs=[tmp_path / "frame.exr"], patience=5 if "sleep" in body else 60)
    assert str(caught.value).startswith(f"Blender {blender.version} ({blender.program}) ")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks the system for children")
def test_a_blender_that_is_killed_at_work_leaves_whole_frames_and_another_run_mends_it(blender: Blender) -> None:
    balls = Balls("balls", np.array([[0, 1.0, 0]]), np.array([0.1]))
    flag = np.array([[x, 2 - y, 0] for y in (0, 0.1, 0.2) for x in (0, 0.1)])
    sides = np.array([[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]])
    cloth = Cloth("flag", flag, sides, (Pin("world", vertices=np.arange(2)),))
    scene = SimulationScene(24, 6, (balls, cloth), ground=0.0, pre_roll=PreRoll(2, 1))
    cache = MemoryCache()
    killed: list[int] = []

    def kill(_: str, done: int, total: int) -> None:
        if done > total / 2 and not killed:
            for child in Path(f"/proc/{os.getpid()}/task/{threading.get_native_id()}/children").read_text().split():
                killed.append(int(child))
                os.kill(int(child), signal.SIGKILL)

    with pytest.raises(BlenderError, match=r"signal 9, SIGKILL"):
        simulate_scene(scene, cache, [BlenderEngine(blender)], progress=kill)
    assert killed
    # Balls were finished before cloth began.
    assert (cache.frames("balls"), cache.frames("flag")) == ([0, 1, 2, 3, 4, 5], [])
    simulate_scene(scene, cache, [BlenderEngine(blender)])
    assert cache.frames("flag") == [0, 1, 2, 3, 4, 5]
