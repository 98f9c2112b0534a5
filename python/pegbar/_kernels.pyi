import numpy as np
from numpy.typing import NDArray

__all__ = [
    "fill_matte",
    "grow_labels",
    "has_alpha",
    "ink_alpha",
    "limb_depth",
    "matte",
    "palette_labels",
    "segment_stick_figure",
]

def limb_depth(
    labels: NDArray[np.uint8], ends: NDArray[np.float64], end_depths: NDArray[np.float64], perspective: bool
) -> NDArray[np.float32]: ...
def segment_stick_figure(
    gray: NDArray[np.uint8], ends: NDArray[np.float64], half_widths: NDArray[np.float64], threshold: int
) -> NDArray[np.uint8]: ...
def palette_labels(
    segmentation: NDArray[np.uint8], colors: NDArray[np.uint8], labels: NDArray[np.uint8], tolerance: float
) -> tuple[NDArray[np.uint8], int, list[int] | None]: ...
def grow_labels(labels: NDArray[np.uint8], figure: NDArray[np.uint8], reach: float | None) -> NDArray[np.uint8]: ...
def ink_alpha(image: NDArray[np.uint8]) -> NDArray[np.float32]: ...
def has_alpha(image: NDArray[np.uint8]) -> bool: ...
def matte(image: NDArray[np.uint8], mode: str) -> tuple[NDArray[np.uint8], NDArray[np.float32]]: ...
def fill_matte(
    image: NDArray[np.uint8], labels: NDArray[np.uint8]
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]: ...
