"""A drawing as layers of one EXR file, under the names by which Nuke and Natron know them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.layer.color import decode_srgb
from pegbar.shot.drawn import Drawn

#: Depth where nothing is drawn: filters spread infinity as NaN. `pegbar.io.exr` reads it as background.
FAR = 1e10


def drawn_layers(drawn: Drawn, limbs: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Return the channels of ``drawn`` for ``write_exr``.

    They are R G B A (Nuke's rgba: linear, premultiplied by the drawing's matte), ``depth.Z`` (metres, 1e10 where
    nothing is drawn), and for every limb ``matte_NAME.A``: the part of the alpha that belongs to it. A layer has one
    channel of its own, since Natron's have four at most.
    """
    alpha = drawn.alpha.astype(np.float32)
    colors = drawn.color[..., :3].astype(np.float32) / np.float32(255) * alpha[..., None]
    channels: dict[str, NDArray[Any]] = {
        "": decode_srgb(np.concatenate([colors, alpha[..., None]], axis=2)),
        "depth.Z": np.where(np.isfinite(drawn.depth), drawn.depth, np.float32(FAR)),
    }
    if drawn.labels is not None:
        for label, name in enumerate(limbs, 1):
            channels[f"{matte_name(name)}.A"] = np.where(drawn.labels == label, alpha, np.float32(0))
    return channels


def matte_name(limb: str) -> str:
    """Return a limb's layer: letters, digits and underscores, as Nuke allows them."""
    return "matte_" + re.sub(r"\W", "_", limb, flags=re.ASCII)
