"""All clips of a folder as the search wants them, kept in an index so that only what has changed is read again."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from pegbar.errors import describe
from pegbar.io.clip_index import Entry, load_index, save_index
from pegbar.io.fingerprint import File, fingerprint, stat_of
from pegbar.scene.clip import Clip

_Path = str | os.PathLike[str]
KINDS = (".bvh", ".amc", ".c3d")


@dataclass(frozen=True, eq=False)
class ClipFolder:
    """The clips of a folder.

    Attributes
    ----------
    clips : tuple of Clip
        Named by their path in the folder.
    broken : dict of str to str
        Files that cannot be read, and why.
    skipped : dict of str to str
        Clips that cannot be compared with a person, and why.
    read : int
        How many files were read now; the others were in the index.
    index : Path or None
        Where the index is kept; None where it could not be written.
    """

    clips: tuple[Clip, ...]
    broken: dict[str, str] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)
    read: int = 0
    index: Path | None = None


def read_clips(
    folder: _Path, *, use_index: bool = True, progress: Callable[[int, int], None] | None = None
) -> ClipFolder:
    """Read every BVH, AMC (with its ASF) and C3D file in ``folder`` and the folders below it.

    What was read is kept in ``.pegbar-clips.index`` in the folder, or in the user's cache where the folder cannot be
    written. A file whose size and time are those of the index, or else whose contents are, is not read again.

    Parameters
    ----------
    folder : path
        The folder.
    use_index : bool
        False: read everything, and leave the index alone.
    progress : callable, optional
        Called with the number of files read and to read.

    Raises
    ------
    NotADirectoryError
        Where there is no such folder.
    FileNotFoundError
        For a folder without a clip.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "cut.bvh").write_text("HIERARCHY")
    >>> found = read_clips(folder, use_index=False)
    >>> found.clips, list(found.broken)
    ((), ['cut.bvh'])
    """
    root = Path(folder)
    paths = clip_files(root)
    place, known = load_index(root) if use_index else (None, {})
    kept: dict[str, Entry] = {}
    fresh = True
    for path in paths:
        entry = known.get(_name(root, path))
        now = _unchanged(root, path, entry) if entry else None
        if entry and now is not None:
            fresh = fresh and now == entry.files
            kept[entry.name] = entry.with_files(now)
    new = _read_all(root, [path for path in paths if _name(root, path) not in kept], progress)
    entries = [{**kept, **new}[_name(root, path)] for path in paths]
    if use_index and (new or not fresh or set(known) != set(kept)):
        place = save_index(root, entries)
    return ClipFolder(
        clips=tuple(entry.clip for entry in entries if entry.clip is not None),
        broken={entry.name: entry.problem for entry in entries if entry.clip is None and entry.broken},
        skipped={entry.name: entry.problem for entry in entries if entry.clip is None and not entry.broken},
        read=len(new),
        index=place,
    )


def clip_files(folder: Path) -> list[Path]:
    """Return the clips in ``folder`` and the folders below it, in order; raises as `read_clips` does."""
    if not folder.is_dir():
        what = "a file, want a folder of clips" if folder.exists() else "no such folder"
        raise NotADirectoryError(f"{folder}: {what}")
    paths = sorted(_find(folder))
    if not paths:
        raise FileNotFoundError(f"{folder}: no {', '.join(KINDS)} file here or below")
    return paths


def _find(root: Path) -> Iterator[Path]:
    for base, folders, files in os.walk(root):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in files:
            if name.lower().endswith(KINDS) and not name.startswith("."):
                yield Path(base, name)


def _name(root: Path, path: Path) -> str:
    return path.relative_to(root).as_posix()


def _files_of(path: Path) -> list[Path]:
    """The files that say what the clip is: an AMC file's skeleton may be any ASF beside it."""
    beside = sorted(path.parent.glob("*.[aA][sS][fF]")) if path.suffix.lower() == ".amc" else []
    return [path, *beside]


def _unchanged(root: Path, path: Path, entry: Entry) -> tuple[File, ...] | None:
    """The files of an entry as they are now, or None where one of them has changed."""
    files = _files_of(path)
    if [_name(root, file) for file in files] != [file.name for file in entry.files]:
        return None
    now = []
    for file, before in zip(files, entry.files, strict=True):
        try:
            size, time = stat_of(file)
            if size != before.size or (time != before.time and fingerprint(file) != before.contents):
                return None
        except OSError:
            return None
        now.append(File(before.name, size, time, before.contents))
    return tuple(now)


def _read_all(root: Path, paths: list[Path], progress: Callable[[int, int], None] | None) -> dict[str, Entry]:
    entries: dict[str, Entry] = {}
    with ThreadPoolExecutor(min(len(paths), os.cpu_count() or 1) or 1) as pool:
        for entry in pool.map(lambda path: _read(root, path), paths):
            entries[entry.name] = entry
            if progress is not None:
                progress(len(entries), len(paths))
    return entries


def _read(root: Path, path: Path) -> Entry:
    from pegbar.io.motion import read_motion

    name = _name(root, path)
    # Taken before the clip is read: a file that changes meanwhile is read again next time.
    files = tuple(_fingerprints(root, _files_of(path)))
    try:
        motion = read_motion(path)
    except (ValueError, OSError, MemoryError) as error:
        return Entry(name, files, None, describe(error), True)
    try:
        return Entry(name, files, Clip.from_motion(name, motion), "", False)
    except ValueError as error:
        return Entry(name, files, None, str(error), False)


def _fingerprints(root: Path, files: Iterable[Path]) -> Iterator[File]:
    for file in files:
        try:
            size, time = stat_of(file)
            yield File(_name(root, file), size, time, fingerprint(file))
        except OSError:
            yield File(_name(root, file), -1, 0, "")
