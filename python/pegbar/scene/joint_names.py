"""What people call joints: the words for each canonical marker, and how a file's names are taken apart.

A name is compared without case, separators and namespace; its side is a word or letter before or after the joint's
word ("LeftUpLeg", "thigh.L", "Bip01 R Calf", "lfemur"), and what all names of a file begin with is left out.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence

#: Words for joints in the middle of the body, the best first.
MIDDLE = {
    "pelvis": ("hips", "pelvis", "hip", "root", "hipcentre", "hipcenter", "cog", "sacr"),
    "chest": (
        *("thorax", "upperchest", "chestupper", "chest4", "chest3", "chest2", "chest1", "chest"),
        *("ribcage", "ribs", "spineupper", "upperback", "torso", "t8", "strn", "t10"),
    ),
    "neck": (
        *("lowerneck", "necklower", "neck", "neck01", "necktwist01", "neck1", "neckbase", "neckupper", "upperneck"),
        *("c7", "clav"),
    ),
    "head": ("head",),
}
#: Words for joints with a side, the best first.
SIDED = {
    "shoulder": (
        *("upperarm", "uparm", "uarm", "upperarm01", "arm", "humerus", "shldr", "shldrbend", "shoulder", "sho"),
    ),
    "elbow": ("elbow", "forearm", "lowerarm", "lowarm", "loarm", "lowerarm01", "farm", "radius", "forearmbend", "elb"),
    "hand": ("hand", "palm", "wrist", "fin", "wra"),
    "hip": (
        *("thigh", "upleg", "upperleg", "upperleg01", "uleg", "femur", "thighbend", "hip"),
        *("asi", "asis", "fwt"),
    ),
    "knee": ("knee", "lowerleg", "lowleg", "loleg", "lowerleg01", "shin", "calf", "tibia", "leg", "kne"),
    "foot": ("ankle", "foot", "ank"),
    "toe": ("toebase", "toe", "toes", "ball", "toe0", "toe1", "foot"),
    "collar": ("clavicle", "collar", "shoulder"),
    "wrist": ("wrist",),
}
#: Where a file has none of a marker's words: these with a number, counted upwards from the pelvis.
SPINE = ("spine", "back", "abdomen", "torso", "chest")
_SIDES = {"left": ("left", "l"), "right": ("right", "r")}
_CENTRE = ("", "c", "m", "mid", "center", "centre")


def _forms() -> dict[str, tuple[str, str]]:
    """Every compact form of a known name -> its side ("" in the middle) and word."""
    forms: dict[str, tuple[str, str]] = {}
    words = {word for several in MIDDLE.values() for word in several}
    words |= {f"{word}{number}" for word in SPINE for number in ("", *range(10), *(f"{n:02}" for n in range(10)))}
    words |= {f"spine{number:03}" for number in range(10)}
    for word in sorted(words):
        for centre in _CENTRE:
            forms[centre + word] = ("", word)
    for word in sorted({word for several in SIDED.values() for word in several} | {"hipjoint", "fhd", "psi", "bwt"}):
        for side, marks in _SIDES.items():
            for mark in marks:
                forms[mark + word] = forms[word + mark] = (side, word)
    return forms


FORMS = _forms()


def compact(name: str) -> str:
    """Return ``name`` without namespace, separators and case."""
    return re.sub(r"[\W_]+", "", re.split(r"[:|]", name)[-1]).lower()


def words(names: Sequence[str]) -> dict[tuple[str, str], int]:
    """Return (side, word) -> the place in ``names`` of the first joint of that name."""
    short = [compact(name) for name in names]
    prefix = _prefix(short)
    found: dict[tuple[str, str], int] = {}
    for place, name in enumerate(short):
        known = FORMS.get(name[len(prefix) :]) if name.startswith(prefix) else None
        if known is not None:
            found.setdefault(known, place)
    return found


def _prefix(short: Sequence[str]) -> str:
    """What the names begin with before the known part: the one that makes most of them known, the shortest of those."""
    counts = Counter({"": 0})
    for name in set(short):
        counts.update(_beginnings(name))
    return max(counts, key=lambda prefix: (counts[prefix], -len(prefix), prefix))


def _beginnings(name: str) -> Iterator[str]:
    for start in range(len(name)):
        if name[start:] in FORMS:
            yield name[:start]
