"""Runs a script in Blender, in a process of its own: progress comes in, and every kind of failure is an error."""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import subprocess
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import IO

from pegbar.errors import BlenderError
from pegbar.simulate.blender.locate import Blender

Progress = Callable[[int, int], None]
#: Sets how many seconds Blender may say nothing before it is ended.
PATIENCE_VARIABLE = "PEGBAR_BLENDER_PATIENCE"
PATIENCE = 900.0
INSIDE = Path(__file__).parent / "inside"
_PROGRESS, _DONE = b"pegbar:progress:", b"pegbar:done"
_LAST_LINES, _LONGEST_LINE = 8, 4096
# Seconds after its end in which what it wrote last is waited for.
_LAST_WORDS = 2.0


def run_blender(
    blender: Blender,
    script: str | Path,
    arguments: Sequence[str] = (),
    *,
    outputs: Iterable[Path] = (),
    progress: Progress | None = None,
    patience: float | None = None,
) -> None:
    """Run ``script`` in Blender and wait for its end.

    Parameters
    ----------
    blender : Blender
        From ``find_blender``.
    script : path
        Runs as ``__main__`` in Blender's Python, with ``arguments`` in ``sys.argv[1:]``. It reports progress by
        printing lines ``pegbar:progress:DONE:TOTAL``, flushed.
    outputs : paths
        Files that the script must have written.
    progress : callable, optional
        Called with DONE and TOTAL. What it raises ends Blender.
    patience : float, optional
        Seconds without a line from Blender after which it is ended; None: PEGBAR_BLENDER_PATIENCE, else 900.

    Raises
    ------
    BlenderError
        When Blender cannot be started, crashes, is killed, raises in the script, says nothing for too long, or ends
        without an output; with the last lines that it wrote. Blender never outlives this call, nor this process.
    """
    wait = _patience() if patience is None else patience
    with tempfile.TemporaryDirectory(prefix="pegbar-blender-") as folder:
        command = blender.command(INSIDE / "start.py", (str(Path(script).absolute()), *arguments))
        environment = os.environ | {"TMPDIR": folder, "TEMP": folder, "TMP": folder, "PYTHONUNBUFFERED": "1"}
        try:
            process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )
        except OSError as error:
            raise BlenderError(f"{blender.program}: it cannot be started: {error.strerror or error}") from None
        last: deque[str] = deque(maxlen=_LAST_LINES)
        try:
            is_done = _listen(process, last, progress, wait)
        finally:
            _end(process)
    name = f"Blender {blender.version} ({blender.program})"
    if is_done is None:
        raise _failure(f"{name} said nothing for {wait:g} s and was ended", last)
    if process.returncode or not is_done:
        raise _failure(f"{name} {_ended(process.returncode)}", last)
    if missing := [path for path in outputs if not path.is_file()]:
        raise _failure(f"{name} did not write {missing[0].name}", last)


def _patience() -> float:
    text = os.environ.get(PATIENCE_VARIABLE, "")
    try:
        value = float(text) if text else PATIENCE
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise ValueError(f"{PATIENCE_VARIABLE}: want a number of seconds above zero, got {text!r}")
    return value


def _listen(
    process: subprocess.Popen[bytes], last: deque[str], progress: Progress | None, patience: float
) -> bool | None:
    """Read what Blender writes until it ends; whether its script came to its end, None after too long a silence."""
    lines: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    assert process.stdout is not None
    threading.Thread(target=_read, args=(process.stdout, lines), daemon=True).start()
    is_done, heard, ended = False, time.monotonic(), 0.0
    while True:
        try:
            line = lines.get(timeout=0.2)
        except queue.Empty:
            now = time.monotonic()
            if process.poll() is not None:
                # Its last lines may still come; but a process that it started may hold the pipe for ever.
                ended = ended or now
                if now - ended > _LAST_WORDS:
                    return is_done
            elif now - heard > patience:
                return None
            continue
        if line is None:
            break
        heard = time.monotonic()
        if line.startswith(_PROGRESS):
            _tell(line, progress)
        elif line.startswith(_DONE):
            is_done = True
        elif text := line.decode(errors="replace").rstrip():
            last.append("".join(letter if letter.isprintable() else " " for letter in text))
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(timeout=patience)
    return is_done


def _read(stream: IO[bytes], lines: queue.SimpleQueue[bytes | None]) -> None:
    """Hand on line by line; a line without an end comes in pieces."""
    with stream, contextlib.suppress(ValueError, OSError):
        while line := stream.readline(_LONGEST_LINE):
            lines.put(line)
    lines.put(None)


def _tell(line: bytes, progress: Progress | None) -> None:
    done, _, total = line.removeprefix(_PROGRESS).strip().partition(b":")
    if progress is not None and done.isdigit() and total.isdigit():
        progress(int(done), int(total))


def _end(process: subprocess.Popen[bytes]) -> None:
    """End Blender and what it started, which else would keep the pipe that is read."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
    process.wait()
    assert process.stdin is not None
    with contextlib.suppress(OSError):
        process.stdin.close()


def _ended(code: int) -> str:
    if code < 0:
        names = {number.value: number.name for number in signal.Signals}
        return f"crashed or was killed (signal {-code}, {names.get(-code, 'unknown')})"
    return f"failed with exit code {code}" if code else "ended before its script did"


def _failure(what: str, last: Iterable[str]) -> BlenderError:
    said = "\n".join(f"  {line[:300]}" for line in last)
    return BlenderError(f"{what}; its last lines:\n{said}" if said else f"{what}; it wrote nothing")
