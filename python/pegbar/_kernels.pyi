import numpy as np
from numpy.typing import NDArray

from typing import Any

__all__ = ["depth_composite", "limb_depth"]

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
