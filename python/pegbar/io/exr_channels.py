"""Which channels of an EXR file are the beauty and which is the depth, by the names that renderers give them."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable

from pegbar.errors import FormatError

_Path = str | os.PathLike[str]
_BEAUTY = {"combined", "beauty", "rgba", "rgb", "color", "colour", "image", "composite", "main"}
_DEPTH = {"depth", "z", "zdepth", "zbuffer", "depthz"}


def find_beauty(path: _Path, names: Collection[str], layer: str | None = None) -> list[str]:
    """Return the channels R, G, B (, A), or Y (, A), of the beauty pass, in this order."""
    candidates: dict[str, list[str]] = {}
    for prefix, letters in _layers(_in_layer(names, layer)).items():
        if _last_word(prefix) in _DEPTH:
            continue
        for wanted in ("rgba", "rgb", "ya", "y"):
            if all(letter in letters for letter in wanted) and ("x" not in letters or wanted[0] == "r"):
                candidates[prefix] = [letters[letter] for letter in wanted]
                break
    return candidates[_choose(path, "beauty", candidates, names, layer, _BEAUTY)]


def find_depth(path: _Path, names: Collection[str], layer: str | None = None) -> str:
    """Return the depth channel; a layer without one falls back to the file's only one."""
    candidates = _depths(_in_layer(names, layer)) or _depths(names)
    return candidates[_choose(path, "depth", candidates, names, layer, _DEPTH)]


def _depths(names: Iterable[str]) -> dict[str, str]:
    """Depth channels by prefix: a Z without X and Y, a V, Y or R in a layer called depth, or one called depth."""
    candidates: dict[str, str] = {}
    for prefix, letters in _layers(names).items():
        called = _last_word(prefix) in _DEPTH
        wanted = [letter for letter in (("z", "v", "y", "r") if called else ("z",)) if letter in letters]
        if wanted and (called or "x" not in letters):
            candidates[prefix] = letters[wanted[0]]
        for word in letters:
            if word in _DEPTH - {"z"}:
                candidates[f"{prefix}.{word}" if prefix else word] = letters[word]
    return candidates


def _layers(names: Iterable[str]) -> dict[str, dict[str, str]]:
    """Full names by layer and by last word in lower case."""
    layers: dict[str, dict[str, str]] = {}
    for name in names:
        prefix, _, word = name.rpartition(".")
        layers.setdefault(prefix, {}).setdefault(word.lower(), name)
    return layers


def _in_layer(names: Collection[str], layer: str | None) -> list[str]:
    if layer is None:
        return list(names)
    return [name for name in names if name.startswith(f"{layer}.") or layer in name.split(".")[:-1]]


def _last_word(prefix: str) -> str:
    return prefix.rpartition(".")[2].lower()


def _choose(
    path: _Path, what: str, candidates: Collection[str], names: Collection[str], layer: str | None, usual: set[str]
) -> str:
    """The file's own channels, else the layer with a usual name, else the only one."""
    ranks: dict[int, list[str]] = {}
    for prefix in candidates:
        rank = 0 if not prefix else 1 if _last_word(prefix) in usual else 2
        ranks.setdefault(rank, []).append(prefix)
    where = "" if layer is None else f" in layer {layer!r}"
    if not ranks:
        raise FormatError(path, f"no {what} pass{where}; its channels: {', '.join(sorted(names))}")
    best = ranks[min(ranks)]
    if len(best) > 1:
        raise FormatError(path, f"several {what} passes{where}, name a layer: {', '.join(sorted(best))}")
    return best[0]
