"""What pegbar raises besides the built-in TypeError, ValueError and OSError."""

from __future__ import annotations

from os import PathLike, fspath


def describe(error: BaseException) -> str:
    """Return ``error`` as one line for people: an OSError with its file first and no error number."""
    if isinstance(error, OSError) and error.strerror:
        reason = error.strerror[0].lower() + error.strerror[1:]
        text = f"{fspath(error.filename)}: {reason}" if error.filename is not None else reason
    else:
        text = str(error)
    return " ".join(text.split()) or type(error).__name__


class PegbarError(Exception):
    """Base of everything that pegbar raises on its own account."""


class FormatError(PegbarError, ValueError):
    """A file that is broken or not what it should be; the message begins with path and line (or byte)."""

    def __init__(
        self, path: str | PathLike[str], problem: str, *, line: int | None = None, byte: int | None = None
    ) -> None:
        self.path, self.problem, self.line, self.byte = fspath(path), problem, line, byte
        place = f":{line}" if line is not None else f" at byte {byte}" if byte is not None else ""
        super().__init__(f"{self.path}{place}: {problem}")

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuild_format_error, (self.path, self.problem, self.line, self.byte)


def _rebuild_format_error(path: str, problem: str, line: int | None, byte: int | None) -> FormatError:
    return FormatError(path, problem, line=line, byte=byte)


class DegenerateError(PegbarError, ValueError):
    """Geometry that has no answer; the message names frame and limb or joint."""


class MissingFrameError(PegbarError, FileNotFoundError):
    """A sequence that lacks frames; the message names the pattern and the missing numbers."""


class ShotError(PegbarError, ValueError):
    """A shot file with problems, one line each, every line with its place."""

    def __init__(self, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("\n".join(problems))


class MissingExtraError(PegbarError, ImportError):
    """A library that is not installed, since only some users want it; the message says how to install it."""

    def __init__(self, purpose: str, extra: str, otherwise: str = "") -> None:
        super().__init__(f'{purpose} needs a library that is not installed: pip install "pegbar[{extra}]"{otherwise}')


class BlenderError(PegbarError, ChildProcessError):
    """Blender cannot be run, or failed; the message ends with the last lines that it wrote."""


class SimulationError(PegbarError, RuntimeError):
    """A simulation that went wrong; the message names element and frame. Earlier frames stay in the cache."""

    def __init__(self, element: str, frame: int, problem: str) -> None:
        self.element, self.frame, self.problem = element, frame, problem
        super().__init__(f"{element}: frame {frame}: {problem}")

    def __reduce__(self) -> tuple[object, ...]:
        return SimulationError, (self.element, self.frame, self.problem)
