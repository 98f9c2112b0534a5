from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["convert_srgb", "depth_composite", "limb_depth", "matte"]

def convert_srgb(pixels: NDArray[np.float32], encode: bool) -> NDArray[np.float32]: ...
def depth_composite(
    drawing: NDArray[np.uint8],
    alpha: NDArray[np.float32],
    drawing_depth: NDArray[np.float32],
    rendered: NDArray[Any],
    rendered_depth: NDArray[np.float32],
    scale: int,
    linear: list[bool],
    out: NDArray[Any],
) -> None: ...
def limb_depth(
    labels: NDArray[np.uint8], ends: NDArray[np.float64], end_depths: NDArray[np.float64], perspective: bool
) -> NDArray[np.float32]: ...
def matte(
    alpha: NDArray[np.float32],
    drawing_depth: NDArray[np.float32],
    rendered_alpha: NDArray[np.float32] | None,
    rendered_depth: NDArray[np.float32],
    scale: int,
) -> NDArray[np.float32]: ...
