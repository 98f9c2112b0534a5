"""Finding and running Blender, with programs that pretend to be it."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import IO

import pytest

from pegbar.errors import BlenderError
from pegbar.simulate.blender import process
from pegbar.simulate.blender.locate import VARIABLE, Blender, find_blender
from pegbar.simulate.blender.process import PATIENCE_VARIABLE, run_blender
from tests.blenders import fake_blender

pytestmark = pytest.mark.skipif(os.name == "nt", reason="the pretended programs are scripts")


@pytest.fixture(autouse=True)
def _nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No Blender is to be found but the test's own."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    (tmp_path / "bin").mkdir()


def run(folder: Path, body: str, **options: object) -> None:
    run_blender(find_blender(fake_blender(folder, body)), "script.py", ["one", "two"], **options)  # type: ignore[arg-type]


def test_no_blender_says_how_to_install_it() -> None:
    with pytest.raises(BlenderError, match=r"no Blender: install 3\.4 or later.*PATH.*pip install bpy.*PEGBAR_BLENDER"):
        find_blender()


def test_the_setting_is_preferred_then_the_variable_then_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = {}
    for name, version in (("bin", "Blender 4.5.3 LTS"), ("variable", "Blender 5.0.1"), ("shot", "Blender 5.1.0 Alpha")):
        (tmp_path / name).mkdir(exist_ok=True)
        places[name] = fake_blender(tmp_path / name, says=version)
    (tmp_path / "bin" / "blender").symlink_to(places["bin"])
    assert find_blender() == Blender(str(tmp_path / "bin" / "blender"), False, "4.5.3")
    monkeypatch.setenv(VARIABLE, places["variable"])
    assert find_blender().version == "5.0.1"
    found = find_blender("fake-blender", folder=tmp_path / "shot")
    assert (found.version, found.program) == ("5.1.0", places["shot"])
    # A name that is no file here is looked for on PATH.
    assert find_blender("blender", folder=tmp_path / "shot").version == "4.5.3"


@pytest.mark.parametrize("version", ["3.3.9", "2.93.0"])
def test_an_old_blender_is_refused(tmp_path: Path, version: str) -> None:
    with pytest.raises(BlenderError, match=rf"Blender {version} is too old: want 3\.4"):
        find_blender(fake_blender(tmp_path, says=f"Blender {version}"))


def test_a_blender_without_what_is_needed_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BlenderError, match=r"Blender 3\.4\.1 is without numpy: .*python3-numpy\)$"):
        find_blender(fake_blender(tmp_path, says="Blender 3.4.1", answers="noise\npegbar:lacks numpy\nBlender quit"))
    with pytest.raises(BlenderError, match=r"without cycles, freestyle: take a build from blender\.org$"):
        find_blender(fake_blender(tmp_path, answers="pegbar:lacks cycles freestyle"))
    with pytest.raises(BlenderError, match="runs no scripts: it says 'Error: no Python'"):
        find_blender(fake_blender(tmp_path, answers="Error: no Python"))


def test_what_is_no_blender_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BlenderError, match="no such Blender"):
        find_blender("nowhere/blender")
    with pytest.raises(BlenderError, match="is a folder"):
        find_blender(str(tmp_path))
    with pytest.raises(BlenderError, match="this is no Blender: it says 'GNU coreutils'"):
        find_blender(fake_blender(tmp_path, says="GNU coreutils"))
    with pytest.raises(BlenderError, match="exit code 3"):
        find_blender(fake_blender(tmp_path, code=3))
    plain = tmp_path / "notes.txt"
    plain.write_text("Blender 5.0.1")
    with pytest.raises(BlenderError, match="cannot be started"):
        find_blender(str(plain))
    with pytest.raises(BlenderError, match="no module bpy"):
        find_blender(sys.executable)


def test_an_executable_gets_script_and_arguments_and_no_start_up_file(tmp_path: Path) -> None:
    body = "print('pegbar:progress:1:2'); print('pegbar:progress:2:2'); print('noise'); "
    body += f"open({str(tmp_path / 'said')!r}, 'w').write(repr(sys.argv[1:])); print('pegbar:done')"
    told: list[tuple[int, int]] = []
    run(tmp_path, body, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 2), (2, 2)]
    said = eval((tmp_path / "said").read_text())
    assert said[:4] == ["--background", "--factory-startup", "--python-exit-code", "1"]
    assert said[-3:] == [str(Path("script.py").absolute()), "one", "two"]


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ("print('out of memory'); sys.exit(7)", r"exit code 7; its last lines:\n  out of memory"),
        ("print('pegbar:done'); sys.exit(2)", "exit code 2; it wrote nothing"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", r"signal 11, SIGSEGV\); it wrote nothing"),
        ("print('bye')", r"ended before its script did; its last lines:\n  bye"),
        ("sys.stdout.buffer.write(bytes(range(256)) * 100)", "ended before its script did; its last lines"),
        ("print('pegbar:done')", "did not write frame.exr; it wrote nothing"),
    ],
)
def test_a_failure_is_an_error_with_the_last_lines(tmp_path: Path, body: str, problem: str) -> None:
    with pytest.raises(BlenderError, match=problem):
        run(tmp_path, body, outputs=[tmp_path / "frame.exr"])


def test_only_the_last_lines_are_told(tmp_path: Path) -> None:
    with pytest.raises(BlenderError) as caught:
        run(tmp_path, "for i in range(1000): print('line', i)\nsys.exit(1)")
    lines = str(caught.value).splitlines()
    assert lines[1:] == [f"  line {i}" for i in range(992, 1000)]


def test_last_lines_that_come_late_are_not_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # As on a busy machine, where it has ended before its lines are read.
    def slow(stream: IO[bytes], lines: queue.SimpleQueue[bytes | None]) -> None:
        time.sleep(0.8)
        read(stream, lines)

    read = process._read
    monkeypatch.setattr(process, "_read", slow)
    with pytest.raises(BlenderError, match=r"exit code 7; its last lines:\n  boom"):
        run(tmp_path, "print('boom', flush=True); os._exit(7)")


def test_silence_ends_it_and_what_it_started(tmp_path: Path) -> None:
    body = f"""
import subprocess
child = subprocess.Popen(["/bin/sleep", "1000"])
open({str(tmp_path / "child")!r}, "w").write(str(child.pid))
print("working", flush=True)
time.sleep(1000)
"""
    with pytest.raises(BlenderError, match=r"said nothing for 0\.5 s and was ended; its last lines:\n  working"):
        run(tmp_path, body, patience=0.5)
    assert is_gone(int((tmp_path / "child").read_text()))


def test_a_child_that_keeps_the_pipe_does_not_hold_us_up(tmp_path: Path) -> None:
    body = "import subprocess\nchild = subprocess.Popen(['/bin/sleep', '1000'])\nprint('pegbar:done', flush=True)\n"
    body += f"open({str(tmp_path / 'child')!r}, 'w').write(str(child.pid)); os._exit(0)"
    run(tmp_path, body, patience=10)
    assert is_gone(int((tmp_path / "child").read_text()))


def test_an_interruption_ends_it(tmp_path: Path) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    pid = f"open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))"
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, f"{pid}; print('pegbar:progress:1:9', flush=True); time.sleep(1000)", progress=interrupt)
    assert is_gone(int((tmp_path / "pid").read_text()))


@pytest.mark.parametrize("text", ["soon", "0", "-1", "inf", "nan"])
def test_a_wrong_patience_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setenv(PATIENCE_VARIABLE, text)
    with pytest.raises(ValueError, match=PATIENCE_VARIABLE):
        run(tmp_path, "")


def test_the_starter_runs_a_script_to_its_end_and_tells_an_exception(tmp_path: Path) -> None:
    # The starter needs nothing of bpy: any Python can stand in.
    python, script = Blender(sys.executable, True, "5.0.1"), tmp_path / "script.py"
    script.write_text("import sys\nopen(sys.argv[1], 'w').write(sys.argv[0])")
    run_blender(python, script, [str(tmp_path / "out")], outputs=[tmp_path / "out"])
    assert (tmp_path / "out").read_text() == str(script)
    script.write_text("raise KeyError('no such thing')")
    with pytest.raises(BlenderError, match=r"exit code 1(?s:.)*KeyError: 'no such thing'"):
        run_blender(python, script)
    script.write_text("raise SystemExit('cannot')")
    with pytest.raises(BlenderError, match=r"exit code 1; its last lines:\n  cannot"):
        run_blender(python, script)


def test_blender_ends_when_its_starter_is_killed(tmp_path: Path) -> None:
    script, pid = tmp_path / "script.py", tmp_path / "pid"
    script.write_text(f"import os, time\nopen({str(pid)!r}, 'w').write(str(os.getpid()))\ntime.sleep(1000)")
    code = "from pegbar.simulate.blender.process import *; import sys; "
    code += f"run_blender(Blender(sys.executable, True, '5.0.1'), {str(script)!r})"
    starter = subprocess.Popen([sys.executable, "-c", code])
    until = time.monotonic() + 30
    while not (pid.is_file() and pid.read_text()) and time.monotonic() < until:
        time.sleep(0.02)
    starter.send_signal(signal.SIGKILL)
    starter.wait()
    assert is_gone(int(pid.read_text()))


def is_gone(pid: int) -> bool:
    """Whether the process ends within a few seconds."""
    until = time.monotonic() + 10
    while time.monotonic() < until:
        try:
            os.kill(pid, 0)
            state = Path(f"/proc/{pid}/stat")
            if state.is_file() and state.read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.02)
    return False
