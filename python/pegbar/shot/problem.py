"""One problem of a shot: what is wrong, where it stands, and how it is mended."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from pegbar.io.numbers import format_frames

# What a message says -> what mends it, for messages that other rooms raise; the first that fits counts.
_MENDS = (
    (r"no such key", "correct the key's name or take it out (docs: shot-file)"),
    (r"is missing$", "write the key into the shot file"),
    (r"no such file.*\.json|annotations:.*no such file", "name the joint marks' file; pegbar dots makes one of dots"),
    (r"no such file|no such folder|missing \d|: no frames", "put the file there, or correct the path"),
    (r"not a directory", "a file stands where the folder should be: name another place"),
    (r"permission denied", "give yourself the right to read the file"),
    (r"match no limb", "repaint them, name the colour in [drawing.palette], or allow for it with drawing.tolerance"),
    (r"is no limb of", "take a limb's name from the annotations"),
    (r"no limb is marked", "paint the limbs' colours into the label picture"),
    (r"no limb colours", "give the annotations' limbs colours, or name them in [drawing.palette]"),
    (r"same whole number of times", "render at the drawing's size, or at twice, three times it"),
    (r"want \d+ x \d+ pixels", "save the picture in that size, or correct shot.size"),
    (r"not a PNG, TIFF, JPEG or EXR|cannot decode|linear light, not", "save it as 8 or 16 bit PNG, TIFF or JPEG"),
    (r"frame -?\d+: (pan_[xy]|zoom|rotate|ease): ", "correct that cell of the sheet (docs: exposure-sheets)"),
    (r"no depth: the shot needs", "give drawing.labels, drawing.half_width or drawing.depth"),
    (r"give no depths", "name a clip in [clip] and run pegbar align, or give the marks depths"),
    (r"has no place or no depth", "mark the joint in that drawing, or take the limb's colour out of it"),
    (r"no marks for|name the pictures in", "mark the drawing, or tell drawing.first_marked"),
    (r"has no drawing", "correct shot.frames or drawing.hold"),
    (r"writing would replace it", "give the output another name"),
    (r"pattern with a frame number|name that ends in", "correct the pattern"),
    (r"not TOML|not UTF-8", "correct the line"),
    (r"run pegbar align", "pegbar align"),
    (r"annotations: .*\.(json|ya?ml)", "correct the file (docs: file-formats)"),
    (r"\.exr\b", "render or save the file again"),
    (r"\.(png|tiff?|jpe?g)\b", "save the picture again"),
)


@dataclass(frozen=True)
class Problem:
    """What is wrong; ``place`` is file and line, as far as they are known, ``frames`` are the film frames with it.

    A ``note`` is good to know, and nothing to mend before work goes on.
    """

    what: str
    mend: str = ""
    key: str = ""
    place: str = ""
    frames: tuple[int, ...] = ()
    note: bool = False

    @property
    def where(self) -> str:
        """Where it stands: frames, or place and key of the shot file."""
        if self.frames:
            return f"frame{'' if len(self.frames) == 1 else 's'} {format_frames(list(self.frames))}"
        return ": ".join(part for part in (self.place, self.key) if part)

    @property
    def line(self) -> str:
        """The problem as one line."""
        return f"{self.where}: {self.what}" + (f" -> {self.mend}" if self.mend else "")

    def record(self) -> Mapping[str, object]:
        """The problem as values that JSON holds."""
        file, _, line = self.place.rpartition(":") if re.search(r":\d+$", self.place) else (self.place, "", "")
        values = {"what": self.what, "mend": self.mend, "key": self.key, "file": file}
        return {**values, "line": int(line) if line else None, "frames": list(self.frames), "note": self.note}


def mend(what: str) -> str:
    """Return how what the message ``what`` says is usually mended."""
    return next((text for pattern, text in _MENDS if re.search(pattern, what, re.IGNORECASE)), "")


def merged(problems: Iterable[Problem]) -> list[Problem]:
    """Return ``problems``, those of frames that differ in numbers only as one with all the frames."""
    groups: dict[tuple[str, ...], Problem] = {}
    for index, problem in enumerate(problems):
        same = (re.sub(r"\d+", "#", problem.what), problem.key) if problem.frames else (str(index),)
        if (first := groups.get(same)) is None:
            groups[same] = problem
        else:
            groups[same] = replace(first, frames=(*first.frames, *problem.frames))
    return [
        replace(problem, what=f"{problem.what} (and so in {len(problem.frames)} frames)")
        if len(problem.frames) > 1
        else problem
        for problem in groups.values()
    ]


def of_message(line: str, source: str) -> Problem:
    """Return a line of a ShotError, ``source:line: key: what``, as a problem."""
    place = re.match(re.escape(source) + r"(?::\d+)?(?=: )", line)
    rest = line[place.end() + 2 :] if place else line
    key = re.match(r"[a-z_]+(?:\.[^\s:]+)*(?=: )", rest)
    what = rest[key.end() + 2 :] if key else rest
    named = mend(rest) or mend(what) or "correct the value (docs: shot-file)"
    return Problem(what, named, key[0] if key else "", place[0] if place else "")
