"""What was made of what: one small record a finished frame, so that a second run does only what has changed.

A frame is up to date when its recipe (settings and version) is the same, its outputs are there, and every input has
the same size and time, or at least the same contents.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import xxhash

from pegbar.io.atomic import complete_file

FOLDER = ".pegbar"
_BLOCK = 1 << 20


def fingerprint(path: Path) -> list[Any]:
    """Return ``[path, size, modification time in ns, contents' hash]`` of the file at ``path``."""
    before = path.stat()
    digest = xxhash.xxh3_128()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return [str(path), before.st_size, before.st_mtime_ns, digest.hexdigest()]


def record_path(output: Path) -> Path:
    """Return where the record of the frame ``output`` is kept: in a hidden folder beside it."""
    return output.parent / FOLDER / f"{output.name}.json"


def write_record(outputs: list[Path], recipe: str, inputs: Iterable[list[Any]]) -> None:
    """Keep that ``outputs`` were made by ``recipe`` of inputs with these fingerprints."""
    made = [[path.name, path.stat().st_size] for path in outputs]
    place = record_path(outputs[0])
    place.parent.mkdir(exist_ok=True)
    with complete_file(place) as part:
        part.write_text(json.dumps({"recipe": recipe, "inputs": list(inputs), "outputs": made}), encoding="utf-8")


def forget(outputs: list[Path]) -> None:
    """Take back that ``outputs`` are as recorded, before they are written: a run that is killed leaves some of them."""
    record_path(outputs[0]).unlink(missing_ok=True)


def is_up_to_date(outputs: list[Path], recipe: str, inputs: Iterable[Path]) -> bool:
    """Whether ``outputs`` stand as ``recipe`` made them, of ``inputs`` that have not changed since."""
    try:
        record = json.loads(record_path(outputs[0]).read_text(encoding="utf-8"))
        if record["recipe"] != recipe or record["outputs"] != [[p.name, p.stat().st_size] for p in outputs]:
            return False
        known = {entry[0]: entry for entry in record["inputs"]}
        paths = [str(path) for path in inputs]
        return set(paths) == set(known) and all(_unchanged(known[path]) for path in paths)
    except (OSError, ValueError, KeyError, TypeError, IndexError):
        return False


def _unchanged(entry: list[Any]) -> bool:
    path = Path(entry[0])
    now = path.stat()
    if now.st_size != entry[1]:
        return False
    return bool(now.st_mtime_ns == entry[2] or fingerprint(path)[3] == entry[3])
