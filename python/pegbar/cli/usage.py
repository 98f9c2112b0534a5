"""Wrong usage in plain words: what the command wants, what it got, and the help that lists the rest."""

from __future__ import annotations

import difflib
import inspect
import re
from collections.abc import Iterable
from typing import Any, Literal, get_args, get_origin

from cyclopts import (
    App,
    Argument,
    CoercionError,
    CycloptsError,
    MissingArgumentError,
    RepeatArgumentError,
    UnknownCommandError,
    UnknownOptionError,
    UnusedCliTokensError,
)

#: So many options are listed where none is like the one that was given.
_FEW = 6
#: How like a name has to be to be suggested; `motion` is not what `nothing` was to be.
_ALIKE = 0.65
_KINDS = {int: "a whole number", float: "a number"}


def describe_usage(error: CycloptsError, app: App) -> str:
    """Return one line: the command, what is wrong, and the ``--help`` of that very command."""
    chain = list(error.command_chain or ())
    command = " ".join(["pegbar", *chain])
    # The program's own name stands before every message.
    name = f"{' '.join(chain)}: " if chain else ""
    return f"{name}{_problem(error, app, chain)} (see {command} --help)"


def _problem(error: CycloptsError, app: App, chain: list[str]) -> str:
    if isinstance(error, MissingArgumentError) and error.argument is not None:
        return _missing(error, error.argument)
    if isinstance(error, UnknownOptionError):
        return _unknown_option(error)
    if isinstance(error, UnknownCommandError):
        return _unknown_command(error, app, chain)
    if isinstance(error, CoercionError) and error.token is not None:
        return _unfit(error, error.token.keyword or "", error.token.value)
    if isinstance(error, UnusedCliTokensError):
        extra = ", ".join(repr(token) for token in error.unused_tokens or ())
        return f"too much is given: {extra}; a path with spaces wants quotes"
    if isinstance(error, RepeatArgumentError):
        return f"{error.token.keyword} is given twice"
    return str(error)


def _missing(error: MissingArgumentError, argument: Argument) -> str:
    """What of the arguments is not there, or which option has no value."""
    what = _what(error.target, argument)
    if error.keyword is not None or argument.tokens:
        return f"{error.keyword or argument.name} wants a value{what}"
    if argument.index is not None:
        return f"{argument.name.lstrip('-').upper()} is missing{what}"
    return f"{argument.name} is missing{what}"


def _what(target: Any, argument: Argument) -> str:
    """What the argument is, as its help says."""
    text = argument.parameter.help or ""
    if not text and target is not None:
        found = re.search(rf"^{argument.field_info.name}\n +(.+)$", inspect.getdoc(target) or "", re.MULTILINE)
        text = found[1] if found else ""
    # Not GIF or BVH.
    is_word = text[1:2].islower() or text[1:2] == " "
    return f": {text[0].lower() if is_word else text[0]}{text[1:].rstrip('.')}" if text else ""


def _unknown_option(error: UnknownOptionError) -> str:
    given = (error.token.keyword or error.token.value).partition("=")[0]
    names = [argument.name for argument in error.argument_collection if argument.name.startswith("--")]
    spelt = [name for argument in error.argument_collection for name in argument.names if name.startswith("-")]
    near = [name for name in spelt if given.startswith("--") and name.startswith(given)][:1]
    near = near or (difflib.get_close_matches(given, spelt, n=1, cutoff=_ALIKE) if given.startswith("--") else [])
    if near:
        return f"no option {given}: did you mean {near[0]}?"
    return f"no option {given}" + (f"; its options: {', '.join(names)}" if 0 < len(names) <= _FEW else "")


def _unknown_command(error: UnknownCommandError, app: App, chain: list[str]) -> str:
    given = (error.unused_tokens or [""])[0]
    for part in chain:
        app = app[part]
    names = [name for name in app if not name.startswith("-")]
    near = difflib.get_close_matches(given, names, n=1, cutoff=_ALIKE)
    if near:
        return f"no command {given!r}: did you mean {near[0]}?"
    return f"no command {given!r}" + (f"; there are {', '.join(names)}" if len(names) <= _FEW else "")


def _unfit(error: CoercionError, option: str, given: str) -> str:
    """A value that is not of the option's kind."""
    prefix, wanted = (f"{option}: " if option else ""), error.target_type
    if get_origin(wanted) is Literal:
        choices = [str(choice) for choice in get_args(wanted)]
        return f"{prefix}want {_either(choices)}, got {given!r}"
    kind = next((name for kind, name in _KINDS.items() if wanted is kind), None)
    return f"{prefix}want {kind}, got {given!r}" if kind else str(error)


def _either(choices: Iterable[str]) -> str:
    *first, last = choices
    return f"{', '.join(first)} or {last}" if first else last
