import numpy as np
from numpy.typing import NDArray

__all__ = ["fill_polygon", "limb_depth", "stroke_polyline", "unpremultiply"]

def limb_depth(
    labels: NDArray[np.uint8], ends: NDArray[np.float64], end_depths: NDArray[np.float64], perspective: bool
) -> NDArray[np.float32]: ...
def fill_polygon(
    pixels: NDArray[np.uint8], points: NDArray[np.float64], color: tuple[int, int, int, int], antialias: bool
) -> None: ...
def stroke_polyline(
    pixels: NDArray[np.uint8],
    points: NDArray[np.float64],
    widths: NDArray[np.float64],
    closed: bool,
    color: tuple[int, int, int, int],
    antialias: bool,
) -> None: ...
def unpremultiply(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]: ...
