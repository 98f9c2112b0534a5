"""A simulation's cache on disk: a folder an element, an ``.npz`` file a frame, each complete or absent."""

from __future__ import annotations

import os
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError
from pegbar.io import atomic

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
_FRAME = re.compile(r"(\d+)\.npz")


class DiskCache:
    """The cache of a simulation in ``folder``, which is made when the first frame is written.

    Frames are files ``ELEMENT/0000.npz`` with the element's arrays, counted from 0 as in the scene. Any program that
    reads numpy's files can take them up.

    Examples
    --------
    >>> import tempfile
    >>> cache = DiskCache(Path(tempfile.mkdtemp()) / "cache")
    >>> cache.write("skirt", 0, {"positions": np.zeros((2, 3))})
    >>> cache.frames("skirt"), cache.read("skirt", 0)["positions"].shape
    ([0], (2, 3))
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)

    def write(self, group: str, frame: int, state: Mapping[str, NDArray[Any]]) -> None:
        """Write a frame's arrays, complete or not at all; OSError when it cannot be written."""
        path = self._path(group, frame)
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic.complete_file(path) as part, part.open("wb") as file:
            arrays: dict[str, Any] = {name: np.asarray(array) for name, array in state.items()}
            np.savez(file, **arrays)

    def read(self, group: str, frame: int) -> Mapping[str, NDArray[Any]]:
        """Return a frame's arrays; KeyError where there is none, FormatError for a file that is damaged."""
        path = self._path(group, frame)
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                return {name: file[name] for name in file.files}
        except FileNotFoundError:
            raise KeyError(f"{group}: frame {frame} is not in the cache {self.folder}") from None
        except (ValueError, EOFError, KeyError, OSError, zipfile.BadZipFile) as error:
            raise FormatError(path, f"the cache's frame is damaged: {error}") from None

    def frames(self, group: str) -> list[int]:
        """Return the frames that are there, in order."""
        folder = self._path(group, 0).parent
        if not folder.is_dir():
            return []
        found = (_FRAME.fullmatch(file.name) for file in folder.iterdir())
        return sorted(int(match[1]) for match in found if match)

    def clear(self, group: str, start: int) -> None:
        """Remove the frames from ``start`` on."""
        for frame in self.frames(group):
            if frame >= start:
                self._path(group, frame).unlink(missing_ok=True)

    def _path(self, group: str, frame: int) -> Path:
        if not _NAME.fullmatch(group):
            raise ValueError(f"group: want letters, digits, '_', '-' and '.' as a file's name, got {group!r}")
        return self.folder / group / f"{frame:04d}.npz"
