import numpy as np
from numpy.typing import NDArray

__all__ = ["fill_polygon", "limb_depth", "render_passes", "resolve_passes", "stroke_polyline", "unpremultiply"]

_Floats = NDArray[np.float32]
_Doubles = NDArray[np.float64]
_Pictures = tuple[_Floats, _Floats, _Floats, NDArray[np.uint16]]

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
def render_passes(
    geometry: tuple[_Doubles, NDArray[np.uint32], _Floats, _Doubles, NDArray[np.uint16]],
    camera: tuple[list[list[float]], int, int],
    near: float,
    toon: tuple[tuple[float, float, float], _Floats],
    ink: tuple[float, tuple[float, float, float, float], float, float],
) -> _Pictures: ...
def resolve_passes(
    beauty: _Floats, depth: _Floats, coverage: _Floats, object_id: NDArray[np.uint16], factor: int
) -> _Pictures: ...
