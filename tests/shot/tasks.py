"""Tasks for the batch tests: worker processes must be able to import them."""

import os
import signal
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
