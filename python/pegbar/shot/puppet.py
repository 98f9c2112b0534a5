"""Puppets that are kept: what a picture needs once is found again when another clip is put on it."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import xxhash

from pegbar.errors import FormatError
from pegbar.io.puppet import read_figure, read_puppet, write_figure, write_puppet
from pegbar.io.puppet_input import read_puppet_input
from pegbar.puppet.alpha import Matting
from pegbar.puppet.check import Pieces
from pegbar.puppet.inpaint import Method
from pegbar.puppet.make import FigurePlan, build_puppet, plan_figure, pose_again, prepare_figure
from pegbar.puppet.view import View
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet
from pegbar.scene.puppet_input import PuppetInput
from pegbar.shot.record import fingerprint, is_up_to_date, write_record

_Path = str | os.PathLike[str]
#: Goes up when the same picture gives another puppet.
VERSION = 4


@dataclass(frozen=True)
class PuppetOptions:
    """What a user may say about a puppet: see `pegbar.puppet.make.make_puppet`."""

    view: View | None = None
    layer_order: Sequence[str] | None = None
    field_of_view: float | None = None
    completion: Method = "auto"
    background: bool = False
    pieces: Pieces = "join"
    matting: Matting = "auto"


def kept_puppet(
    picture: _Path,
    motion: Motion,
    *,
    clip: str = "",
    joints: _Path | None = None,
    mask: _Path | None = None,
    frame: int | None = None,
    map: Mapping[str, str] | None = None,
    options: PuppetOptions | None = None,
    keep: _Path | None = None,
) -> Puppet:
    """Make the puppet of a picture, or take what was kept of it in an earlier run.

    Parameters
    ----------
    picture, joints, mask, frame, map
        As `pegbar.io.puppet_input.read_puppet_input`.
    motion : Motion
        The clip that the figure is to perform; ``clip`` is what to call it.
    options : PuppetOptions, optional
    keep : path, optional
        The folder in which prepared figures and puppets are kept; it is made where it is not there. None: nothing is.

    Raises
    ------
    ValueError, OSError
        As `read_puppet_input` and `make_puppet`.
    """
    options = options or PuppetOptions()
    source = read_puppet_input(picture, joints=joints, mask=mask, frame=frame, map=map)
    folder = None if keep is None else Path(keep)
    figure = _figure(source, options, folder)
    plan = plan_figure(
        figure,
        motion,
        view=options.view,
        layer_order=options.layer_order,
        field_of_view=options.field_of_view,
    )
    return _puppet(source, figure, plan, clip, options, folder)


def _figure(source: PuppetInput, options: PuppetOptions, folder: Path | None) -> PuppetInput:
    recipe = [
        VERSION,
        options.pieces,
        options.matting,
        source.mask is None and options.view,
        source.names,
        source.bones.tolist(),
        source.marks.tolist(),
    ]
    place, text = _place(source, folder, recipe, "figure")
    if place is not None and is_up_to_date([place], text, source.files):
        try:
            figure = read_figure(place, source)
            return dataclasses.replace(figure, drives=source.drives, files=source.files)
        except FormatError:
            place.unlink(missing_ok=True)
    figure = prepare_figure(source, view=options.view, pieces=options.pieces, matting=options.matting)
    if place is not None:
        write_figure(place, figure)
        write_record([place], text, _fingerprints(source))
    return figure


def _puppet(
    source: PuppetInput, figure: PuppetInput, plan: FigurePlan, clip: str, options: PuppetOptions, folder: Path | None
) -> Puppet:
    layers = [plan.layers.names, plan.layers.bones, plan.layers.joints]
    recipe = [
        VERSION,
        options.pieces,
        options.matting,
        options.completion,
        options.background,
        figure.marks.tolist(),
        layers,
    ]
    place, text = _place(source, folder, recipe, "puppet")
    if place is not None and is_up_to_date([place], text, source.files):
        try:
            return pose_again(read_puppet(place), figure, plan, clip=clip)
        except FormatError:
            place.unlink(missing_ok=True)
    puppet = build_puppet(figure, plan, clip=clip, completion=options.completion, background=options.background)
    if place is not None:
        write_puppet(place, puppet)
        write_record([place], text, _fingerprints(source))
    return puppet


def _fingerprints(source: PuppetInput) -> list[list[object]]:
    return [fingerprint(path) for path in source.files]


def _place(source: PuppetInput, folder: Path | None, recipe: list[object], kind: str) -> tuple[Path | None, str]:
    """Where a figure or puppet of this recipe is kept, and the recipe as text."""
    text = json.dumps(recipe)
    if folder is None:
        return None, text
    folder.mkdir(parents=True, exist_ok=True)
    key = xxhash.xxh3_64_hexdigest("\0".join([text, *(str(path.absolute()) for path in source.files)]).encode())
    return folder / f"{Path(source.source).stem[:40]}-{key}.{kind}.npz", text
