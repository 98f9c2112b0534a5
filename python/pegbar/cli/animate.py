"""`pegbar animate`: a drawn or photographed figure performs a clip."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from pegbar.errors import MissingExtraError, describe

if TYPE_CHECKING:
    from pegbar.puppet.performance import Direction
    from pegbar.puppet.staging import Setting
    from pegbar.shot.animating import Advance, Casting, Outcome, Part


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FigureOptions:
    """What is known of the figure better than its picture and joints say."""

    joints: Annotated[Path | None, Parameter(help="File of joint marks (default: the one beside the picture).")] = None
    mask: Annotated[Path | None, Parameter(help="Picture that is light or opaque where the figure is.")] = None
    map: Annotated[
        list[str] | None, Parameter(help="JOINT=MARKER: what moves a joint, like front_paw=left_hand; JOINT= for none.")
    ] = None
    view: Annotated[
        Literal["front", "half profile", "side", "half back", "back"] | None,
        Parameter(help="From where the figure is seen (default: found)."),
    ] = None
    layers: Annotated[str | None, Parameter(help="Layers front to back, with commas (default: found).")] = None
    field_of_view: Annotated[
        float | None, Parameter(help="Horizontal, in degrees: smaller is less perspective (default: found).")
    ] = None
    completion: Annotated[
        Literal["auto", "patch", "diffuse", "flat"], Parameter(help="How hidden parts are filled in.")
    ] = "auto"
    pieces: Annotated[
        Literal["join", "drop"], Parameter(help="What is done with pieces of the mask that no limb runs through.")
    ] = "join"
    matting: Annotated[
        Literal["auto", "closed form", "guided", "mask"], Parameter(help="How soft edges are found.")
    ] = "auto"
    mirror: Annotated[bool, Parameter(negative="", help="Perform the clip's mirror image.")] = False
    keep_puppets: Annotated[
        bool, Parameter(help="Keep what is found of a picture, in .pegbar beside the output, for its next clip.")
    ] = True

    def casting(self, folder: Path) -> Casting:
        """As values, checked; puppets are kept beside what is in ``folder``."""
        from pegbar.shot.animating import Casting
        from pegbar.shot.puppet import PuppetOptions

        wide = self.field_of_view
        if wide is not None and not 0 < wide < 180:
            raise ValueError(f"--field-of-view: want degrees between 0 and 180, got {wide}")
        pairs = [entry.partition("=") for entry in self.map or ()]
        if wrong := [entry for entry, (_, sign, _) in zip(self.map or (), pairs, strict=True) if not sign]:
            raise ValueError(f"--map: want JOINT=MARKER, got {wrong[0]!r}")
        return Casting(
            joints=self.joints,
            mask=self.mask,
            drives={joint.strip(): marker.strip() for joint, _, marker in pairs},
            options=PuppetOptions(
                view=self.view,
                layer_order=None if self.layers is None else tuple(name.strip() for name in self.layers.split(",")),
                field_of_view=None if wide is None else math.radians(wide),
                completion=self.completion,
                pieces=self.pieces,
                matting=self.matting,
            ),
            mirror=self.mirror,
            keep=folder / ".pegbar" / "puppets" if self.keep_puppets else None,
        )


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class MovementOptions:
    """How the clip is performed."""

    rate: Annotated[float | None, Parameter(help="Pictures a second (default: the clip's, 30 at most).")] = None
    frames: Annotated[str | None, Parameter(help="Frames of the clip, FIRST-LAST, counted from 1.")] = None
    travel: Annotated[
        Literal["auto", "in-place", "travelling"],
        Parameter(help="Whether the figure goes where the clip goes; auto: where that is less than a step."),
    ] = "auto"
    camera: Annotated[
        Literal["still", "following"], Parameter(help="A following camera goes along with the figure.")
    ] = "still"
    keep: Annotated[
        Literal["near", "always", "never"],
        Parameter(help="Whether limbs drawn otherwise than in the clip stay so: near keeps small differences."),
    ] = "near"
    feet: Annotated[
        Literal["locked", "free"], Parameter(help="Whether feet that stand in the clip keep their place on the ground.")
    ] = "locked"
    transition: Annotated[float, Parameter(help="Seconds from the drawn pose to the clip's first.")] = 0.0
    between: Annotated[float, Parameter(help="Seconds from one clip to the next.")] = 0.3
    loop: Annotated[bool, Parameter(negative="", help="Cut and blend so that it repeats without a jump.")] = False
    inflation: Annotated[float, Parameter(help="How round the figure is: 0 flat, 1 as deep as wide.")] = 0.5

    def direction(self) -> Direction:
        """As values, checked."""
        from pegbar.puppet.performance import Direction

        first, last = _range(self.frames)
        for name in ("transition", "between", "inflation"):
            if not 0 <= getattr(self, name) <= 60:
                raise ValueError(f"--{name}: want 0 to 60, got {getattr(self, name)}")
        return Direction(
            frame_rate=self.rate,
            first=first,
            last=last,
            keep=self.keep,
            feet=self.feet,
            travel=self.travel,
            camera=self.camera,
            transition=self.transition,
            between=self.between,
            loop=self.loop,
            inflation=self.inflation,
        )


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """How the pictures look."""

    size: Annotated[str | None, Parameter(help="WIDTHxHEIGHT of the pictures (default: the drawing's).")] = None
    background: Annotated[
        Literal["plain", "transparent", "completed", "picture"],
        Parameter(help="completed: the picture with the figure taken out."),
    ] = "plain"
    color: Annotated[str, Parameter(help="Of a plain background, like ffffff.")] = "ffffff"
    fit: Annotated[
        bool | None, Parameter(help="Zoom so that the figure fills the pictures (default: unless it has a background).")
    ] = None

    def setting(self) -> Setting:
        """As values, checked."""
        from pegbar.puppet.staging import Setting

        size = None if self.size is None else re.fullmatch(r"(\d{1,5})x(\d{1,5})", self.size)
        if self.size is not None and size is None:
            raise ValueError(f"--size: want WIDTHxHEIGHT, like 500x500, got {self.size!r}")
        color = re.fullmatch(r"#?([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})", self.color)
        if color is None:
            raise ValueError(f"--color: want six hexadecimal digits, like ffffff, got {self.color!r}")
        red, green, blue = (int(part, 16) for part in color.groups())
        sides = None if size is None else (int(size[1]), int(size[2]))
        return Setting(size=sides, background=self.background, color=(red, green, blue), fit=self.fit)


def animate(
    pictures: list[Path],
    /,
    *,
    clip: Annotated[list[Path], Parameter(help="BVH, AMC or C3D file, or a folder of them; may be repeated.")],
    output: Annotated[
        Path,
        Parameter(
            name=("--output", "-o"),
            help=".gif, .png, .apng, .webp, .mp4, .mov, .webm, frames as walk.####.png, or a folder for a batch.",
        ),
    ],
    format: Annotated[str, Parameter(help="What a batch writes into its folder.")] = "gif",
    keep_going: Annotated[bool, Parameter(negative="", help="Go on with a batch after one that fails.")] = False,
    figure: FigureOptions | None = None,
    movement: MovementOptions | None = None,
    look: PictureOptions | None = None,
) -> int:
    """Animate pictures; see `pegbar animate --help`.

    Parameters
    ----------
    pictures
        Pictures with their joints beside them, or folders of such.
    """
    from pegbar.io.film import check_film
    from pegbar.shot.animating import find_clips, find_pictures

    direction = (movement or MovementOptions()).direction()
    setting = (look or PictureOptions()).setting()
    cast = [picture for path in pictures for picture in find_pictures(path)]
    clips = [found for path in clip for found in find_clips(path)]
    if not cast or not clips:
        raise ValueError(f"want a picture with joints and a clip, found {len(cast)} and {len(clips)}")
    jobs = list(_jobs(cast, clips, output, format))
    for _, target in jobs:
        check_film(target, alpha=setting.background == "transparent")
    casting = (figure or FigureOptions()).casting(jobs[0][1].parent)
    return _perform(jobs, casting, direction, setting, keep_going)


def _perform(
    jobs: list[tuple[list[Part], Path]], casting: Casting, direction: Direction, setting: Setting, keep_going: bool
) -> int:
    """Write every scene, report, and return the exit code."""
    from pegbar.shot.animating import animate_parts

    failed = 0
    for parts, target in jobs:
        try:
            with _bar(target.name) as advance:
                outcome = animate_parts(
                    parts, target, casting=casting, direction=direction, setting=setting, progress=advance
                )
        except (OSError, ValueError, MissingExtraError) as error:
            if len(jobs) == 1:
                raise
            failed += 1
            print(f"pegbar: {target.name}: {describe(error)}", file=sys.stderr)
            if not keep_going:
                break
        else:
            _report(outcome, f"{target.name}: " if len(jobs) > 1 else "")
    return 1 if failed else 0


def _jobs(cast: list[Path], clips: list[Path], output: Path, format: str) -> Iterator[tuple[list[Part], Path]]:
    """Scenes and where they go: one scene in a file, every picture with every clip in a folder."""
    from pegbar.io.film import ANIMATIONS, check_film, is_sequence
    from pegbar.io.video import SUFFIXES
    from pegbar.shot.animating import Part, picture_name

    if output.suffix.lower() in (*ANIMATIONS, *SUFFIXES) or is_sequence(output):
        if len(cast) == 1:
            yield [Part(cast[0], tuple(clips))], output
            return
        if len(clips) not in (1, len(cast)):
            raise ValueError(f"--clip: want one clip, or one for each of {len(cast)} pictures, got {len(clips)}")
        own = clips * len(cast) if len(clips) == 1 else clips
        yield [Part(picture, (performed,)) for picture, performed in zip(cast, own, strict=True)], output
        return
    if output.suffix and not output.is_dir():
        check_film(output)
    output.mkdir(parents=True, exist_ok=True)
    for picture in cast:
        for performed in clips:
            name = f"{picture_name(picture)}_{performed.stem}.{format.removeprefix('.')}"
            yield [Part(picture, (performed,))], output / name


def _range(frames: str | None) -> tuple[int | None, int | None]:
    if frames is None:
        return None, None
    match = re.fullmatch(r"(\d+)-(\d+)", frames.strip())
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise ValueError(f"--frames: want FIRST-LAST, counted from 1, got {frames!r}")
    return int(match[1]) - 1, int(match[2]) - 1


@contextmanager
def _bar(name: str) -> Iterator[Advance | None]:
    """A progress bar on a terminal, nothing elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _report(outcome: Outcome, name: str) -> None:
    for note in outcome.notes:
        print(f"pegbar: warning: {name}{note}", file=sys.stderr)
    pace = outcome.frames / max(outcome.seconds - outcome.setup, 1e-9)
    print(
        f"animate: {outcome.output}: {outcome.frames} pictures, {outcome.setup:.1f} s to the first, "
        f"then {pace:.0f} a second"
    )
