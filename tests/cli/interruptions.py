"""Runs `pegbar composite` in a process of its own and disturbs it."""

import os
import resource
import signal
import subprocess
import sys
import time


def start(shot, *options, limit=None):
    """Start the command; ``limit`` is the largest file that it may write, as a disk that is full would have it."""

    def restrict():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    command = [sys.executable, "-m", "pegbar", "composite", str(shot), *map(str, options)]
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=os.path.dirname(shot),
        preexec_fn=restrict if limit else None,
        start_new_session=True,
    )


def wait_for(folder, count, process, seconds=60.0):
    """Wait until ``count`` finished frames stand in ``folder``, or the process has ended."""
    end = time.monotonic() + seconds
    while len(list(folder.glob("f.*.png"))) < count and process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.002)


def contents(folder):
    """The finished frames and their bytes; hidden files must all be records."""
    strange = [path.name for path in folder.iterdir() if path.name.startswith(".") and path.name != ".pegbar"]
    assert strange == []
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.png"))}
