"""What presets make and what their settings are, in words: told from their classes."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

from pegbar.simulate.presets import PRESETS


def effect_line(preset: str) -> str:
    """Return what a preset makes, and its own settings with their defaults."""
    own = [field for field in dataclasses.fields(PRESETS[preset]) if field.name in _own(preset)]
    shown = ", ".join(f"{field.name} {_shown(field.default)}" for field in own)
    return f"{preset:<12} {_summary(preset)}\n{'':<12} {shown}"


def effect_settings(preset: str) -> str:
    """Return what a preset makes, what its settings mean, and all of them with their defaults."""
    kind = PRESETS[preset]
    words = [_plain(part.__doc__ or "") for part in kind.__mro__ if dataclasses.is_dataclass(part)]
    fields = dataclasses.fields(kind)
    widest = max(len(field.name) for field in fields)
    lines = [f"{field.name:<{widest}} = {_shown(field.default)}" for field in fields]
    return "\n".join([f'elements = [{{ preset = "{preset}" }}]', "", "\n\n".join(words), "", *lines])


def _own(preset: str) -> set[str]:
    """The settings that a preset does not share with others of its kind: those of its own class."""
    shared = {
        field.name
        for part in PRESETS[preset].__mro__[1:]
        if dataclasses.is_dataclass(part)
        for field in dataclasses.fields(part)
    }
    return {field.name for field in dataclasses.fields(PRESETS[preset])} - shared


def _summary(preset: str) -> str:
    """The first sentence of a preset's description."""
    first = re.split(r"(?<=[.:])\s", _plain(PRESETS[preset].__doc__ or ""), maxsplit=1)[0]
    return first.rstrip(".:")


def _plain(docstring: str) -> str:
    return "\n".join(line.strip() for line in docstring.strip().splitlines()).replace("``", "")


def _shown(value: Any) -> str:
    """A default as TOML has it; linear colours as #rrggbb."""
    if value is None:
        return "(from the character)"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        if len(value) == 4 and all(isinstance(part, float) for part in value) and value[3] == 1:
            return f'"#{"".join(f"{round(255 * _display(part)):02x}" for part in value[:3])}"'
        return f"[{', '.join(_shown(part) for part in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _display(value: float) -> float:
    """Linear light to sRGB."""
    return 12.92 * value if value <= 0.0031308 else 1.055 * float(value) ** (1 / 2.4) - 0.055
