"""A file is complete or absent: it is written under a hidden name beside its target, then renamed.

The hidden name is ``.STEM.PID-COUNT@HOST.part.SUFFIX``, so that what a killed run leaves behind can be told from what
a living one is writing.
"""

from __future__ import annotations

import itertools
import os
import platform
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_LEFTOVER = re.compile(r"\..*\.(?P<pid>\d+)-\d+@(?P<host>[^/]*)\.part(\.[^.]*)?", re.DOTALL)
# A process on another computer cannot be asked; no single frame takes a day to write.
_OLD = 86400.0
_counter = itertools.count()
_open: set[Path] = set()


@contextmanager
def complete_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside ``path``; rename it to ``path`` when the block ends well, else remove it.

    Parameters
    ----------
    path : path
        The file to make or replace. Its folder must exist.

    Yields
    ------
    Path
        Where to write. It has the suffix of ``path``, so that libraries that choose a format by suffix are content.

    Raises
    ------
    OSError
        When the folder cannot be written or the disk is full; it names ``path``, not the temporary file.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> with complete_file(folder / "note.txt") as part:
    ...     _ = part.write_text("whole")
    >>> [file.name for file in folder.iterdir()]
    ['note.txt']
    """
    target = Path(path)
    # A name may have 255 bytes and a letter up to four: the stem is cut so that the rest still fits.
    mark = f"{os.getpid()}-{next(_counter)}@{_host()}"
    part = target.with_name(f".{target.stem[:32]}.{mark}.part{target.suffix}")
    _open.add(part)
    try:
        yield part
        os.replace(part, target)
    except OSError as error:
        if error.filename in (None, "", str(part), part):
            raise OSError(error.errno, error.strerror or str(error), str(target)) from error
        raise
    finally:
        _open.discard(part)
        # The error that broke the block matters more than one from tidying up after it.
        _remove(part)


def write_bytes(path: str | os.PathLike[str], data: bytes | bytearray | memoryview) -> None:
    """Write ``data`` as the whole of file ``path``, complete or not at all."""
    with complete_file(path) as part, open(part, "wb") as file:
        file.write(data)


def clean_leftovers(folder: str | os.PathLike[str]) -> list[Path]:
    """Remove the temporary files in ``folder`` whose process is gone and return them.

    Files of another computer are removed when they are older than a day.
    """
    removed = []
    for file in sorted(Path(folder).iterdir()):
        match = _LEFTOVER.fullmatch(file.name)
        if match and file not in _open and not _in_use(file, int(match["pid"]), match["host"]) and _remove(file):
            removed.append(file)
    return removed


def _in_use(file: Path, pid: int, host: str) -> bool:
    if host != _host() or os.name == "nt":
        try:
            return time.time() - file.stat().st_mtime < _OLD
        except OSError:
            return True
    if pid == os.getpid():
        return False
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _remove(file: Path) -> bool:
    try:
        file.unlink()
    except OSError:
        return False
    return True


def _host() -> str:
    return re.sub(r"[^A-Za-z0-9-]", "", platform.node())[:24]
