"""Tasks for the batch tests: worker processes must be able to import them."""

import os
import signal
import stat
import time
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Square:
    def __call__(self, frame):
        if frame == 13:
            raise ValueError("frame 13:\n  is unlucky")
        return frame * frame


@dataclass(frozen=True)
class Die:
    def __call__(self, frame):
        if frame == 3:
            os.kill(os.getpid(), signal.SIGKILL)
        return frame


@dataclass(frozen=True)
class Threads:
    def __call__(self, frame):
        import cv2

        return os.getpid(), os.environ.get("RAYON_NUM_THREADS"), cv2.getNumThreads()


@dataclass(frozen=True)
class Slow:
    folder: Path

    def __call__(self, frame):
        (self.folder / f"{os.getpid()}").touch()
        time.sleep(0.05)
        return frame


@dataclass(frozen=True)
class Large:
    data: bytes

    def __call__(self, frame):
        return len(self.data) + frame


class Fragile:
    """Frame 2 dies in the middle of its answer: a part of the message is in the pipe."""

    def __call__(self, frame):
        if frame == 2:
            for descriptor in range(3, 64):
                try:
                    if stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                        os.write(descriptor, (1000).to_bytes(4, "big") + b"half")
                except OSError:
                    continue
            os.kill(os.getpid(), signal.SIGKILL)
        return frame


class Blocked:
    """The signals that are held back in the worker."""

    def __call__(self, frame):
        return signal.pthread_sigmask(signal.SIG_BLOCK, ())
