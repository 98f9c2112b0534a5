"""The sample's layer of coloured dots, as an artist would put it over the drawings, and a shot file that reads it."""

from __future__ import annotations

from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.sample.figure import LABELS, PALETTE
from pegbar.sample.skeleton import NAMES
from pegbar.scene.body import limbs_between

#: Radius of a dot in a picture 960 pixels wide.
RADIUS = 4.0
# Three levels a channel keep colours 127 apart; greys, which paper and ink have, are no dots.
_LEVELS = [(red, green, blue) for red, green, blue in product((255, 128, 0), repeat=3) if len({red, green, blue}) > 1]
#: The colour of every joint.
COLORS: dict[str, tuple[int, ...]] = dict(zip(NAMES, _LEVELS, strict=False))
_ENDS = {"hand": "forearm", "foot": "shin"}

_SHOT = """\
# The same drawings with the joints as an artist marks them: pegbar dots reads the dots into dots.json.
[shot]
name = "sample with dots"
frames = "1-{frames}"
frame_rate = {rate:g}
size = [{width}, {height}]

[drawing]
frames = "drawings/dancer.####.png"
labels = "labels/labels.####.png"
annotations = "dots.json"

[drawing.palette]
{palette}

[dots]
frames = "dots/dots.####.png"

[dots.joints]
{joints}

[dots.limbs]
{limbs}

[clip]
path = "clip.bvh"

[align]
output = "dots/align"
"""


def dots_layer(marks: NDArray[np.float64], visible: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a transparent picture (H, W, 4) of ``size`` (width, height) with a dot on every visible one of ``marks``.

    Parameters
    ----------
    marks : (N, 2) float
        The joints, as the sample's skeleton names them, in pixels.
    visible : (N,) bool
        Which of them the drawing shows.
    size : (width, height)
        Of the picture, in pixels.
    """
    layer = np.zeros((size[1], size[0], 4), np.uint8)
    radius = max(1.5, RADIUS * size[0] / 960)
    for mark, color in zip(marks[visible], np.array(list(COLORS.values()))[visible], strict=True):
        # OpenCV takes places and radii in sixteenths of a pixel.
        place = np.rint(16 * mark).astype(int).tolist()
        cv2.circle(layer, place, round(16 * radius), (*color.tolist(), 255), cv2.FILLED, cv2.LINE_8, 4)
    return layer


def dots_shot(frames: int, rate: float, size: tuple[int, int]) -> str:
    """Return the text of a shot file for the sample's drawings with dots in place of annotations."""
    known = [limb.name for limb in limbs_between(NAMES)]
    limbs = "\n".join(f'{limb} = "{_hex(LABELS[limb])}"' for limb in known)
    joints = "\n".join(f'"{_hex(color)}" = "{name}"' for name, color in COLORS.items())
    # Hands and feet are no limbs between dots: their colours belong to what they hang on.
    further = {LABELS[f"{side}_{end}"]: f"{side}_{limb}" for side in ("left", "right") for end, limb in _ENDS.items()}
    palette = "\n".join(f'"{_hex(color)}" = "{limb}"' for color, limb in (PALETTE | further).items())
    width, height = size
    return _SHOT.format(
        frames=frames, rate=rate, width=width, height=height, palette=palette, joints=joints, limbs=limbs
    )


def _hex(color: tuple[int, ...]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*color)
