"""One run at a time works in a folder: an advisory lock that ends with its process, however that ends."""

from __future__ import annotations

import errno
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pegbar.errors import PegbarError
from pegbar.io.atomic import clean_leftovers

try:
    import fcntl
except ImportError:  # Windows has no flock: runs are then not kept apart
    fcntl = None  # type: ignore[assignment]

_NAME = Path(".pegbar") / "run.lock"
# File systems without locks, and shares that do not offer them.
_WITHOUT = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL)
_held: set[Path] = set()


class BusyError(PegbarError, OSError):
    """Another run is working in the folder; the message names its process."""


@contextmanager
def hold(folder: Path) -> Iterator[None]:
    """Keep other runs out of ``folder``, which is made, until the block ends; clear what killed runs left in it.

    A run may hold a folder several times over. Where the file system has no locks nothing is kept out.

    Raises
    ------
    BusyError
        Where another run holds it.
    OSError
        Where the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with hold(Path(tempfile.mkdtemp()) / "results"):
    ...     pass
    """
    place = folder.absolute() / _NAME
    if fcntl is None or place in _held:
        yield
        return
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        # Read and write without truncation: the holder's name stands in the file.
        opened = os.open(place, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(folder)) from None
    try:
        _lock(opened, folder)
        _held.add(place)
        clean_leftovers(folder)
        yield
    finally:
        _held.discard(place)
        os.close(opened)


def _lock(opened: int, folder: Path) -> None:
    """Lock the open file and write into it who holds it."""
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        who = os.read(opened, 200).decode(errors="replace") or "another process"
        raise BusyError(f"{folder}: another pegbar is at work here ({who}): wait until it is done") from None
    except OSError as error:
        if error.errno not in _WITHOUT:
            raise
    # Where the disk is full, the name is missing and the lock holds all the same.
    with suppress(OSError):
        os.truncate(opened, 0)
        os.write(opened, f"process {os.getpid()} on {platform.node()}".encode())
