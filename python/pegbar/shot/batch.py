"""Runs one task over many frames, in worker processes, with bounded memory.

Each worker holds one frame at a time and talks through a pipe of its own, so that it ends by itself when the parent
is killed, and the parent notices a worker that dies. Processes, not threads: a codec that crashes or is killed fails
its own frame only, and what runs in Python between the codecs does not wait for the other frames.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Protocol

from pegbar.errors import describe

_ONE_THREAD = {"RAYON_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


class Task(Protocol):
    """What is done for one frame. It is pickled once for each worker."""

    def __call__(self, frame: int, /) -> Any:
        """Do the work of ``frame``; what it returns is handed on, what it raises is the frame's failure."""


@dataclass(frozen=True)
class FrameResult:
    """What became of one frame: ``value`` from the task, or ``error`` as one line."""

    frame: int
    value: Any = None
    error: str | None = None


def run_frames(
    task: Task, frames: list[int], *, jobs: int | None = None, go_on: Callable[[], bool] = lambda: True
) -> Generator[FrameResult]:
    """Yield a result a frame, as they are finished.

    ``jobs`` is the number of worker processes (None: one a core); with one job or one frame the work is done here.
    When ``go_on`` says no, no further frame is begun and those in work are finished. Closing the iterator ends the
    workers at once; a frame in work is then left as it was before.
    """
    count = min(jobs or available_cores(), len(frames))
    if count <= 1:
        _keep_memory()
        for frame in frames:
            if go_on():
                yield attempt(task, frame)
        return
    pool = _Pool(task, count)
    try:
        yield from pool.run(deque(frames), go_on)
    finally:
        pool.close()


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def attempt(task: Task, frame: int) -> FrameResult:
    """Run ``task`` for one frame; what users can mend becomes the result's error, one line."""
    try:
        return FrameResult(frame, task(frame))
    except (ValueError, OSError, MemoryError) as error:
        return FrameResult(frame, error=describe(error))


class _Pool:
    """Worker processes, each behind its own pipe."""

    def __init__(self, task: Task, count: int) -> None:
        self.context = multiprocessing.get_context("spawn")
        self.task = task
        self.workers: dict[Connection, Any] = {}
        with _environment(_ONE_THREAD):
            for _ in range(count):
                self._start()

    def _start(self) -> Connection:
        ours, theirs = self.context.Pipe()
        worker = self.context.Process(target=_work, args=(theirs, self.task), daemon=True)
        worker.start()
        theirs.close()
        self.workers[ours] = worker
        return ours

    def run(self, frames: deque[int], go_on: Callable[[], bool]) -> Iterator[FrameResult]:
        busy: dict[Connection, int] = {}
        idle = list(self.workers)
        while busy or (frames and go_on()):
            while idle and frames and go_on():
                pipe = idle.pop()
                busy[pipe] = frames.popleft()
                with suppress(ConnectionError):
                    pipe.send(busy[pipe])
            for ready in wait(list(busy)):
                assert isinstance(ready, Connection)
                pipe, frame = ready, busy.pop(ready)
                try:
                    result = pipe.recv()
                except (EOFError, ConnectionError):
                    result, pipe = self._replace(pipe, frame)
                idle.append(pipe)
                yield result

    def _replace(self, pipe: Connection, frame: int) -> tuple[FrameResult, Connection]:
        worker = self.workers.pop(pipe)
        worker.join()
        with _environment(_ONE_THREAD):
            fresh = self._start()
        return FrameResult(frame, error=f"the worker process ended (exit code {worker.exitcode})"), fresh

    def close(self) -> None:
        for pipe in self.workers:
            pipe.close()
        for worker in self.workers.values():
            worker.join(timeout=0.2)
            if worker.is_alive():
                worker.terminate()
            worker.join()


def _work(pipe: Connection, task: Task) -> None:
    """Serve frames until the parent closes the pipe or is gone. Ctrl-C is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    _single_thread()
    _keep_memory()
    try:
        while True:
            pipe.send(attempt(task, pipe.recv()))
    except (EOFError, ConnectionError):
        return


def _single_thread() -> None:
    """The frames are what is parallel: keep the codecs of one worker to one thread."""
    import cv2

    cv2.setNumThreads(1)


def _keep_memory() -> None:
    """Let glibc keep what a frame frees for the next one, which needs as much again.

    By default it hands large blocks back to the system at once, and every frame pays for the pages anew: 13 of 182 ms
    at 1080p. Elsewhere than on glibc nothing is done.
    """
    import ctypes

    trim_threshold, mmap_threshold, most = -1, -3, 2**31 - 1
    try:
        set_option = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return
    set_option(trim_threshold, most)
    set_option(mmap_threshold, most)


class _environment:
    """Environment variables that the processes started inside inherit."""

    def __init__(self, values: dict[str, str]) -> None:
        self.values = values

    def __enter__(self) -> None:
        self.before = {name: os.environ.get(name) for name in self.values}
        os.environ.update(self.values)

    def __exit__(self, *_: object) -> None:
        for name, value in self.before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
