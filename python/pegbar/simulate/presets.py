"""Presets: elements that a shot file names in a line and tunes by field terms, with sizes taken from the character."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any

from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.elements import Element
from pegbar.simulate.falling import Rain, Snow
from pegbar.simulate.holding import Balloon, PomPoms, Rope, Tuft
from pegbar.simulate.lying import FootPuddle, LyingSnow, Snowfall
from pegbar.simulate.scene import Character
from pegbar.simulate.standing import Clothesline, FloorBalls
from pegbar.simulate.umbrella import Umbrella
from pegbar.simulate.wearing import Scarves, Skirt

Preset = (
    Scarves
    | Skirt
    | Clothesline
    | FloorBalls
    | Snow
    | Rain
    | Umbrella
    | LyingSnow
    | FootPuddle
    | Rope
    | Balloon
    | PomPoms
    | Tuft
)
#: Presets that ask what the cameras see.
SEEN = (Clothesline, Snow, Rain, LyingSnow)
PRESETS: Mapping[str, type[Preset]] = {
    "scarves": Scarves,
    "skirt": Skirt,
    "clothesline": Clothesline,
    "balls": FloorBalls,
    "snow": Snowfall,
    "snow_field": LyingSnow,
    "rain": Rain,
    "umbrella": Umbrella,
    "puddle": FootPuddle,
    "balloon": Balloon,
    "pompoms": PomPoms,
    "rope": Rope,
    "strands": Tuft,
}


def preset_elements(
    kind: str,
    character: Character,
    *,
    name: str | None = None,
    ground: float | None = None,
    seed: int = 0,
    cameras: Sequence[PerspectiveCamera] = (),
    **settings: Any,
) -> tuple[Element, ...]:
    """Make the elements of a preset for a character.

    Parameters
    ----------
    kind : str
        One of ``PRESETS``: "scarves", "skirt", "balloon" and so on.
    character : Character
        Whose sizes are taken and who wears what is worn.
    name : str, optional
        Name of the element, or what the names of several begin with; None: ``kind``.
    ground : float, optional
        Height of the ground in metres; balls need one.
    seed : int
        Makes every choice by chance repeatable.
    cameras : sequence of PerspectiveCamera
        What snow and rain fill is what these see; none: what is near the character.
    **settings
        The preset's fields, see its class in ``PRESETS``. Colours may be "#rrggbb" (sRGB).

    Returns
    -------
    tuple of elements
        For ``SimulationScene.elements``.

    Raises
    ------
    ValueError
        For a preset or field that there is not (the message lists what there is), a value that is out of range, and a
        character without the markers or limbs that the preset needs.

    Examples
    --------
    >>> from pegbar.scene.volumes import TaperedCylinders
    >>> import numpy as np
    >>> names = ("pelvis", "neck", "head", "left_hip", "left_knee", "left_foot", "right_foot")
    >>> heights = np.array([0.95, 1.45, 1.6, 0.9, 0.5, 0.1, 0.1])
    >>> markers = np.stack([0 * heights, heights, 0 * heights], axis=1)[None]
    >>> none = TaperedCylinders(np.empty((1, 0, 3)), np.empty((1, 0, 3)), np.empty((1, 0)), np.empty((1, 0)))
    >>> boy = Character("boy", names, markers, (), none)
    >>> balls, = preset_elements("balls", boy, ground=0.0, count=5, size=0.1)
    >>> balls.name, len(balls.radii)
    ('balls', 5)
    """
    check_preset(kind, settings)
    values = {field: _value(kind, field, value) for field, value in settings.items()}
    preset = PRESETS[kind](**values)
    if isinstance(preset, SEEN):
        return preset.build(name or kind, character, ground, seed, cameras)
    return preset.build(name or kind, character, ground, seed)


def check_preset(kind: str, settings: Mapping[str, Any]) -> None:
    """Raise ValueError for a preset or setting that there is not (naming those) or a value of a wrong kind."""
    if kind not in PRESETS:
        raise ValueError(f"no preset {kind!r}: there are {', '.join(PRESETS)}{_near(kind, PRESETS)}")
    known = {field.name: field.default for field in fields(PRESETS[kind])}
    for field, value in settings.items():
        if field not in known:
            raise ValueError(f"{kind}: no setting {field!r}: there are {', '.join(known)}{_near(field, known)}")
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if isinstance(known[field], int | float) and not isinstance(known[field], bool) and not is_number:
            raise ValueError(f"{kind}: {field}: want a number, got {value!r}")
        if isinstance(known[field], str) and not isinstance(value, str):
            raise ValueError(f"{kind}: {field}: want a text in quotes, got {value!r}")


def _near(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, list(known), 1)
    return f" (did you mean {near[0]!r}?)" if near else ""


def _value(kind: str, field: str, value: Any) -> Any:
    """Colours as linear RGBA, lists as tuples."""
    if field in ("color", "second"):
        return _color(kind, field, value)
    if field == "colors":
        return tuple(_color(kind, field, color) for color in value)
    return tuple(value) if isinstance(value, list) else value


def _color(kind: str, field: str, value: Any) -> tuple[float, ...]:
    if isinstance(value, str):
        digits = re.fullmatch(r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})", value)
        if digits is None:
            raise ValueError(f"{kind}: {field}: want #rrggbb, got {value!r}")
        return (*(_linear(int(pair, 16) / 255) for pair in digits.groups()), 1.0)
    return tuple(value)


def _linear(value: float) -> float:
    """sRGB to linear light."""
    return value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)
