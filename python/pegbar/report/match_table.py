"""What a search found, as a table and in words."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence

from pegbar.align.match import Match, Matches
from pegbar.io.clip_folder import ClipFolder
from pegbar.io.numbers import format_frames
from pegbar.scene.clip import Clip

_VERDICTS = {"fits": "fits", "doubtful": "doubtful", "no": "does not fit"}
_COLORS = {"fits": "green", "doubtful": "yellow", "no": "red"}


def describe_match(rank: int, match: Match, clip: Clip) -> tuple[str, ...]:
    """Return lines of words for a contact sheet."""
    return (
        f"{rank}  {match.clip.rsplit('/', 1)[-1]}",
        f"frames {_span(match)}, {_seconds(match, clip)} s",
        f"from {match.seen_from} ({match.azimuth:.0f}, {match.elevation:.0f})",
        match.sides,
        f"{match.cost:.1f} degrees: {_VERDICTS[match.verdict]}",
    )


def report_matches(folder: ClipFolder, found: Matches, timing: str, drawings: Sequence[int]) -> None:
    """Print the matches, the best first, and what to say of the best.

    ``timing`` says which frame rate they were found with, ``drawings`` are the drawings' numbers.
    """
    from rich.console import Console
    from rich.table import Table

    clips = {clip.name: clip for clip in folder.clips}
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in (
        "",
        "clip",
        "frames",
        "seconds",
        "azimuth",
        "elevation",
        "seen from",
        "left and right",
        "degrees",
        "verdict",
    ):
        numeric = name in ("", "frames", "seconds", "azimuth", "elevation", "degrees")
        table.add_column(name, justify="right" if numeric else "left", no_wrap=True)
    for rank, match in enumerate(found.matches, 1):
        view = (f"{match.azimuth:.0f}", f"{match.elevation:.0f}", match.seen_from, match.sides)
        verdict = f"[{_COLORS[match.verdict]}]{_VERDICTS[match.verdict]}[/]"
        seconds = _seconds(match, clips[match.clip])
        table.add_row(str(rank), match.clip, _span(match), seconds, *view, f"{match.cost:.1f}", verdict)
    console = Console(highlight=False) if sys.stdout.isatty() else Console(highlight=False, width=160)
    console.print(table)
    console.print(f"\n{_summary(found, drawings)}\n{timing}".rstrip(), soft_wrap=True)


def report_left_out(broken: Mapping[str, str], skipped: Mapping[str, str]) -> None:
    """Name the files that cannot be read and the clips that cannot be searched."""
    for name, reason in sorted(broken.items()):
        print(f"pegbar: warning: {name} cannot be read: {reason}", file=sys.stderr)
    for name, reason in sorted(skipped.items()):
        print(f"pegbar: warning: {name} is left out: {reason}", file=sys.stderr)


def _summary(found: Matches, drawings: Sequence[int]) -> str:
    limits = f"up to {found.fits:.1f} degrees fits, up to {found.doubtful:.1f} is doubtful"
    if not found.matches:
        return "Nothing fits: no clip is long enough."
    best = found.matches[0]
    if best.verdict == "no":
        return f"Nothing fits: the nearest clip is {best.cost:.1f} degrees away ({limits})."
    words = [f"{best.clip} {'may fit' if best.verdict == 'doubtful' else 'fits'} best ({limits})."]
    if best.swapped and best.mirrored:
        words.append("The picture seems to be mirrored: left and right marks are those of the other side.")
    elif best.swapped:
        words.append("Left and right seem to be exchanged in the drawing" + _unsure(best) + ".")
    elif best.mirrored:
        otherwise = "" if best.sides_told else ", or left and right are exchanged in it"
        words.append(f"The drawing is like the clip's mirror image{otherwise}.")
    for group, frames in best.mixed.items():
        numbers = format_frames(drawings[frame] for frame in frames)
        words.append(f"In drawing {numbers} the {group} seem to be marked on the wrong sides.")
    return " ".join(words)


def _unsure(match: Match) -> str:
    return "" if match.sides_told else ", or it is the clip's mirror image; marks that are covered would tell"


def _span(match: Match) -> str:
    return f"{match.start}-{match.stop}"


def _seconds(match: Match, clip: Clip) -> str:
    start, last = (frame / clip.frame_rate for frame in (match.start, match.stop))
    return f"{start:.2f}-{last:.2f}"
