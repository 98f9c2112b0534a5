"""Runs one task over many frames, in worker processes, with bounded memory.

Each worker holds one frame at a time and talks through a pipe of its own, so that it ends by itself when the parent
is killed, and the parent notices a worker that dies. The task goes through that pipe too: what `Process.start` hands
over is written to a pipe whose reading end the parent keeps open, so that writing more than the pipe holds to a
worker that is dead would never end.

Processes, not threads: a codec that crashes or is killed fails its own frame only, and what runs in Python between the
codecs does not wait for the other frames.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from multiprocessing.reduction import ForkingPickler
from typing import Any, Protocol, cast

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
    Workers import the main module: a script that calls this does so under ``if __name__ == "__main__":``, else
    ChildProcessError is raised.
    When ``go_on`` says no, no further frame is begun and those in work are finished. Closing the iterator ends the
    workers at once; a frame in work is then left as it was before.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        # A worker that imports a script without a guard has come here: the parent says what is wrong.
        sys.exit(1)
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


@dataclass
class _Worker:
    """A worker process; it is ``ready`` when it has the task."""

    process: SpawnProcess
    ready: bool = False


class _Pool:
    """Worker processes, each behind its own pipe."""

    def __init__(self, task: Task, count: int) -> None:
        self.task = ForkingPickler.dumps(task)
        self.workers: dict[Connection, _Worker] = {}
        # All are started before the first one is waited for.
        for pipe in [self._start() for _ in range(count)]:
            self._hand_over(pipe)

    def _start(self) -> Connection:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs,), daemon=True)
        with _environment(_ONE_THREAD), _held_back(signal.SIGINT):
            process.start()
        # Without this end of ours, reading from or writing to a worker that is dead fails at once.
        theirs.close()
        self.workers[ours] = _Worker(process)
        return ours

    def _hand_over(self, pipe: Connection) -> None:
        with suppress(ConnectionError):
            pipe.send_bytes(self.task)

    def run(self, frames: deque[int], go_on: Callable[[], bool]) -> Iterator[FrameResult]:
        busy: dict[Connection, int] = {}
        idle = list(self.workers)
        while busy or (frames and go_on()):
            while idle and frames and go_on():
                pipe = idle.pop()
                busy[pipe] = frames.popleft()
                with suppress(ConnectionError):
                    pipe.send(busy[pipe])
            for pipe in cast(list[Connection], wait(list(busy))):
                result = self._receive(pipe, busy[pipe])
                if result is None:
                    continue
                del busy[pipe]
                if pipe not in self.workers:
                    pipe = self._start()
                    self._hand_over(pipe)
                idle.append(pipe)
                yield result

    def _receive(self, pipe: Connection, frame: int) -> FrameResult | None:
        """What a worker says: the result of ``frame``, or None when it is ready; a dead one is taken out."""
        try:
            result: FrameResult | None = pipe.recv()
        except (EOFError, OSError):
            return self._bury(pipe, frame)
        self.workers[pipe].ready = True
        return result

    def _bury(self, pipe: Connection, frame: int) -> FrameResult:
        """Take a dead worker out; raise ChildProcessError where the next one would end like this one."""
        worker = self.workers.pop(pipe)
        pipe.close()
        worker.process.join()
        code = worker.process.exitcode or 0
        if not worker.ready and code > 0:
            raise ChildProcessError(
                f"the worker processes cannot start (exit code {code}): a script that uses several jobs must do its "
                'work under if __name__ == "__main__":, since every worker imports the script; one job needs no workers'
            ) from None
        memory = ": is the memory full? fewer jobs take less" if code == -9 else ""
        return FrameResult(frame, error=f"the worker process ended (exit code {code}){memory}")

    def close(self) -> None:
        for pipe in self.workers:
            pipe.close()
        for worker in self.workers.values():
            worker.process.join(timeout=0.2)
            if worker.process.is_alive():
                worker.process.terminate()
            worker.process.join()


def _work(pipe: Connection) -> None:
    """Take the task, then serve frames until the parent closes the pipe or is gone. Ctrl-C is the parent's."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        task: Task = pipe.recv()
        _single_thread()
        _keep_memory()
        pipe.send(None)
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


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set environment variables, which the processes started inside inherit."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _held_back(number: signal.Signals) -> Iterator[None]:
    """Hold a signal back, also in the processes started inside: what a worker does with it, it says itself."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Starting the tracker, which the first worker does, would let the signal through again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {number})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
