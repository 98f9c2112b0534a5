"""What stages have assumed and what looks wrong; what a stage has told is not told again by those that build on it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(eq=False)
class Remarks:
    """All ``notes`` (what was assumed) and ``warnings`` (what looks wrong) once each, and which of them are ``new``."""

    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    new: set[str] = field(default_factory=set)

    def add(self, notes: Iterable[str] = (), warnings: Iterable[str] = (), *, made: bool) -> None:
        """Take the remarks of a stage, which are new where it has ``made`` something just now."""
        for known, given in ((self.notes, notes), (self.warnings, warnings)):
            for remark in given:
                if made:
                    self.new.add(remark)
                if remark not in known:
                    known.append(remark)

    def lines(self, shot: Path) -> list[str]:
        """Return what to tell the user of the ``shot`` file: what is new; of older warnings only how many there are."""
        told = [f"note: {note}" for note in self.notes if note in self.new]
        told += [f"warning: {warning}" for warning in self.warnings if warning in self.new]
        if older := sum(warning not in self.new for warning in self.warnings):
            stand = "1 warning of before still stands" if older == 1 else f"{older} warnings of before still stand"
            told.append(f"warning: {stand}: pegbar report {shot} shows {'it' if older == 1 else 'them'}")
        return told
