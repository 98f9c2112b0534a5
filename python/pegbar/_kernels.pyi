import numpy as np
from numpy.typing import NDArray

__all__ = ["limb_depth"]

def limb_depth(
    labels: NDArray[np.uint8], ends: NDArray[np.float64], end_depths: NDArray[np.float64], perspective: bool
) -> NDArray[np.float32]: ...
