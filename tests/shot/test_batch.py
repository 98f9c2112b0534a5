import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pegbar.shot.batch import run_frames
from tests.shot.tasks import Blocked, Die, Fragile, Slow, Square, Threads


@pytest.mark.parametrize("jobs", [1, 3])
def test_every_frame_comes_once_and_a_failure_is_one_line(jobs):
    results = sorted(run_frames(Square(), [1, 2, 13, 5], jobs=jobs), key=lambda r: r.frame)
    assert [(r.frame, r.value) for r in results] == [(1, 1), (2, 4), (5, 25), (13, None)]
    assert [r.error for r in results] == [None, None, None, "frame 13: is unlucky"]


def test_a_worker_that_is_killed_fails_its_frame_only():
    results = {r.frame: r for r in run_frames(Die(), [1, 2, 3, 4, 5, 6], jobs=2)}
    assert "worker process ended" in results[3].error
    assert [results[f].value for f in (1, 2, 4, 5, 6)] == [1, 2, 4, 5, 6]


def test_workers_keep_to_one_thread_and_leave_our_environment_alone():
    before = dict(os.environ)
    values = [r.value for r in run_frames(Threads(), [1, 2, 3, 4], jobs=2)]
    assert {threads for _, *threads_ in values for threads in [tuple(threads_)]} == {("1", 1)}
    assert os.getpid() not in {pid for pid, *_ in values}
    assert dict(os.environ) == before


def test_closing_early_ends_the_workers(tmp_path):
    results = run_frames(Slow(tmp_path), list(range(100)), jobs=2)
    next(results)
    results.close()
    assert_gone(int(path.name) for path in tmp_path.iterdir())


def test_workers_end_when_the_parent_is_killed(tmp_path):
    code = f"""
from pathlib import Path
from pegbar.shot.batch import run_frames
from tests.shot.tasks import Slow
if __name__ == "__main__":
    for _ in run_frames(Slow(Path({str(tmp_path)!r})), list(range(500)), jobs=2):
        print(1, flush=True)
"""
    script = tmp_path.with_suffix(".py")
    script.write_text(code)
    environment = {**os.environ, "PYTHONPATH": os.getcwd()}
    parent = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, env=environment)
    parent.stdout.readline()
    parent.kill()
    parent.wait()
    parent.stdout.close()
    assert_gone(int(path.name) for path in tmp_path.iterdir())


def run_script(path, code):
    """Run a script of its own, which fails the test where it hangs."""
    path.write_text(code)
    environment = {**os.environ, "PYTHONPATH": os.getcwd()}
    return subprocess.run([sys.executable, path], capture_output=True, text=True, env=environment, timeout=60)


# More than a pipe holds.
LARGE = "Large(bytes(300_000)), [1, 2, 3, 4, 5], jobs=2"


def test_a_script_without_a_guard_is_told_what_to_do_and_does_not_hang(tmp_path):
    code = f"""
from pegbar.shot.batch import run_frames
from tests.shot.tasks import Large
print(sorted(r.value for r in run_frames({LARGE})))
"""
    done = run_script(tmp_path / "bare.py", code)
    assert done.returncode == 1
    assert "ChildProcessError: the worker processes cannot start (exit code 1)" in done.stderr
    assert 'if __name__ == "__main__":' in done.stderr.splitlines()[-1]
    assert done.stderr.count("Traceback") == 1
    guarded = code.replace("print", 'if __name__ == "__main__":\n    print')
    assert run_script(tmp_path / "guarded.py", guarded).stdout == "[300001, 300002, 300003, 300004, 300005]\n"


def test_workers_that_are_killed_before_they_read_a_large_task_fail_their_frames_only(tmp_path):
    code = f"""
import os, signal
from pegbar.shot.batch import run_frames
from tests.shot.tasks import Large
if __name__ == "__main__":
    for r in run_frames({LARGE}):
        print(r.frame, r.error or r.value)
else:
    for ticket in ("{tmp_path}/one", "{tmp_path}/two"):
        try:
            os.rmdir(ticket)
        except FileNotFoundError:
            continue
        os.kill(os.getpid(), signal.SIGKILL)
"""
    for ticket in ("one", "two"):
        (tmp_path / ticket).mkdir()
    lines = run_script(tmp_path / "killed.py", code).stdout.splitlines()
    dead = [line for line in lines if "the worker process ended (exit code -9): is the memory full?" in line]
    assert len(dead) == 2
    assert {line for line in lines if line not in dead} < {f"{n} {300_000 + n}" for n in range(1, 6)}
    assert len(lines) == 5


def test_a_worker_that_is_killed_while_it_answers_fails_its_frame_only():
    results = {r.frame: r for r in run_frames(Fragile(), [1, 2, 3, 4], jobs=2)}
    assert "worker process ended" in results[2].error
    assert [results[f].value for f in (1, 3, 4)] == [1, 3, 4]


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="no signal masks here")
def test_workers_begin_with_ctrl_c_held_back_and_the_parent_keeps_it():
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    masks = [r.value for r in run_frames(Blocked(), [1, 2, 3], jobs=2)]
    assert all(signal.SIGINT in mask for mask in masks)
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before


def assert_gone(processes, seconds=5.0):
    end = time.monotonic() + seconds
    for process in processes:
        while is_running(process):
            assert time.monotonic() < end, f"process {process} is still running"
            time.sleep(0.02)


def is_running(process):
    try:
        os.kill(process, signal.SIG_DFL)
        return Path(f"/proc/{process}/stat").read_text().split()[2] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
