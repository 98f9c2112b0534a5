"""A simulation's cache in a folder: a .npz file for every element and frame, complete or absent."""

from __future__ import annotations

import os
import re
import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError
from pegbar.io.atomic import clean_leftovers, complete_file

State = Mapping[str, NDArray[Any]]
_NAME = re.compile(r"(\d{6,})\.npz")


class FolderCache:
    """Keeps states (arrays by name) by group and frame below ``folder``; see `pegbar.simulate.cache.Cache`.

    Examples
    --------
    >>> import tempfile
    >>> cache = FolderCache(tempfile.mkdtemp())
    >>> cache.write("skirt", 3, {"positions": np.zeros((2, 3))})
    >>> cache.frames("skirt"), cache.read("skirt", 3)["positions"].shape
    ([3], (2, 3))
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)

    def path(self, group: str, frame: int) -> Path:
        """Return the file of a group's frame."""
        return self._place(group) / f"{frame:06d}.npz"

    def write(self, group: str, frame: int, state: State) -> None:
        """Keep ``state``, complete or not at all; OSError where that cannot be."""
        path = self.path(group, frame)
        path.parent.mkdir(parents=True, exist_ok=True)
        with complete_file(path) as part, part.open("wb") as file:
            np.savez(file, **state)

    def read(self, group: str, frame: int) -> State:
        """Return the state of a frame; KeyError where there is none, FormatError for a broken file."""
        path = self.path(group, frame)
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as held:
                return {name: held[name] for name in held.files}
        except FileNotFoundError:
            raise KeyError(f"{group}, frame {frame}") from None
        except (zipfile.BadZipFile, ValueError, EOFError) as error:
            raise FormatError(path, f"no simulated frame: {error}") from None

    def frames(self, group: str) -> list[int]:
        """Return the frames that are there, in order."""
        try:
            names = os.listdir(self._place(group))
        except FileNotFoundError:
            return []
        return sorted(int(found[1]) for name in names if (found := _NAME.fullmatch(name)))

    def clear(self, group: str, start: int) -> None:
        """Forget the frames from ``start`` on."""
        for frame in self.frames(group):
            if frame >= start:
                self.path(group, frame).unlink()

    def keep_only(self, groups: list[str]) -> None:
        """Forget every group but ``groups``, and clear what killed runs left."""
        kept = {self._place(group).name for group in groups}
        if self.folder.is_dir():
            for place in self.folder.iterdir():
                if place.is_dir() and not place.name.startswith("."):
                    clean_leftovers(place)
                    if place.name not in kept:
                        shutil.rmtree(place)

    def _place(self, group: str) -> Path:
        """The group's folder; what a file name may not hold is written in hexadecimal."""
        return self.folder / quote(group, safe=" ").replace(".", "%2E")
