"""Which drawing each film frame shows: on ones, on twos, by an exposure sheet, or held until the next drawing."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

Spec = int | Literal["sparse"] | Sequence[int]


@dataclass(frozen=True)
class Exposure:
    """A map from frame numbers to drawing numbers.

    ``starts`` (rising) are the frames on which a new drawing comes up, ``drawings`` the drawing of each or None for
    none, ``end`` the first frame after the last drawing, or None when it is held for ever.
    """

    starts: tuple[int, ...]
    drawings: tuple[int | None, ...]
    end: int | None = None

    @classmethod
    def of(cls, spec: Spec, drawings: Iterable[int], *, first_frame: int | None = None) -> Exposure:
        """Return the exposure that a shot file's entry means.

        Parameters
        ----------
        spec : int, "sparse" or list of int
            A number of frames for which each drawing is held (1: ones, 2: twos): the drawings from the lowest to the
            highest number follow each other. "sparse": a drawing's number is the frame on which it comes up. A list:
            the exposure sheet, the drawing of every frame from ``first_frame`` on.
        drawings : iterable of int
            The numbers of the drawings there are.
        first_frame : int, optional
            The frame of the first drawing, or of the list's first entry. None: the lowest drawing's number, and 1
            for a list.

        Raises
        ------
        ValueError
            For no drawings, a hold below 1, an empty list, or another word.

        Examples
        --------
        >>> twos = Exposure.of(2, [1, 2, 3])
        >>> [twos.drawing(frame) for frame in twos.frames]
        [1, 1, 2, 2, 3, 3]
        """
        there = sorted(set(drawings))
        if isinstance(spec, str):
            if spec != "sparse":
                raise ValueError(f'hold: want a number of frames, "sparse" or a list of drawings, got {spec!r}')
            _need(there, "drawings")
            shift = 0 if first_frame is None else first_frame - there[0]
            return cls(tuple(number + shift for number in there), tuple(there))
        if isinstance(spec, int):
            _need(there, "drawings")
            if spec < 1:
                raise ValueError(f"hold: want at least 1 frame, got {spec}")
            first = there[0] if first_frame is None else first_frame
            shown = range(there[0], there[-1] + 1)
            starts = tuple(first + spec * index for index in range(len(shown)))
            return cls(starts, tuple(shown), first + spec * len(shown))
        _need(spec, "hold")
        first = 1 if first_frame is None else first_frame
        return cls(tuple(range(first, first + len(spec))), tuple(map(int, spec)), first + len(spec))

    @classmethod
    def of_cells(cls, cells: Sequence[int | None], first_frame: int = 1) -> Exposure:
        """Return the exposure of a sheet: the drawing of every frame from ``first_frame`` on, None for none.

        Examples
        --------
        >>> list(Exposure.of_cells([1, None, 4, 4]).frames)
        [1, 3, 4]
        """
        _need([cell for cell in cells if cell is not None], "exposure")
        return cls(tuple(range(first_frame, first_frame + len(cells))), tuple(cells), first_frame + len(cells))

    @property
    def frames(self) -> Sequence[int]:
        """The frames with a drawing; for a last drawing held for ever, up to its first frame."""
        every = range(self.starts[0], self.starts[-1] + 1 if self.end is None else self.end)
        return [frame for frame in every if self._at(frame) is not None] if None in self.drawings else every

    def drawing(self, frame: int) -> int:
        """Return the number of the drawing that ``frame`` shows; ValueError before the first and after the last."""
        if frame < self.starts[0] or (self.end is not None and frame >= self.end):
            last = "" if self.end is None else self.end - 1
            raise ValueError(f"frame {frame}: has no drawing, the drawings cover {self.starts[0]}-{last}")
        shown = self._at(frame)
        if shown is None:
            raise ValueError(f"frame {frame}: the exposure sheet shows no drawing there")
        return shown

    def _at(self, frame: int) -> int | None:
        return self.drawings[bisect_right(self.starts, frame) - 1]


def _need(values: Sequence[int], name: str) -> None:
    if not values:
        raise ValueError(f"{name}: want at least one drawing")
