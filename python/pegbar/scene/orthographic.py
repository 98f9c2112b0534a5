"""The orthographic camera: parallel rays from a direction given by azimuth and elevation (2009 paper, section 3.3)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays

Floats = NDArray[np.float64]


class OrthographicCamera:
    """A camera with parallel rays that looks at the origin of the world.

    Parameters
    ----------
    rotation : (3, 3) float
        Takes world directions to camera axes: x right, y down, z forward.
    scale : float
        Picture units per metre (1: the picture is in metres), positive.
    center : (2,) float
        Where the world's origin is seen, in picture units.

    Raises
    ------
    ValueError
        For a matrix that is no rotation, or a scale that is not positive and finite.
    """

    def __init__(self, rotation: ArrayLike, scale: float = 1.0, center: ArrayLike = (0, 0)) -> None:
        self.rotation: Floats = arrays.floats("rotation", rotation, (3, 3)).copy()
        if not np.allclose(self.rotation @ self.rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(self.rotation) < 0:
            raise ValueError("rotation: want a rotation matrix (orthonormal, determinant 1)")
        if not (math.isfinite(scale) and scale > 0):
            raise ValueError(f"scale: want a positive number, got {scale}")
        self.scale: float = float(scale)
        self.center: Floats = arrays.floats("center", center, (2,)).copy()
        self.rotation.flags.writeable = self.center.flags.writeable = False

    @classmethod
    def from_angles(
        cls, azimuth: float, elevation: float, scale: float = 1.0, center: ArrayLike = (0, 0)
    ) -> OrthographicCamera:
        """Return the camera that stands in direction (sin a cos e, sin e, cos a cos e) and looks at the origin.

        ``azimuth`` and ``elevation`` are in degrees, the elevation from -90 to 90; y is up in the picture's world.

        Examples
        --------
        >>> camera = OrthographicCamera.from_angles(0, 0, scale=100, center=(320, 240))
        >>> camera.project([1.0, 1.0, 0.0]).tolist()
        [420.0, 140.0]
        """
        if not -90 <= elevation <= 90:
            raise ValueError(f"elevation: want -90 to 90 degrees, got {elevation}")
        if not math.isfinite(azimuth):
            raise ValueError(f"azimuth: want a finite angle in degrees, got {azimuth}")
        a, e = math.radians(azimuth), math.radians(elevation)
        right = [math.cos(a), 0.0, -math.sin(a)]
        forward = [-math.sin(a) * math.cos(e), -math.sin(e), -math.cos(a) * math.cos(e)]
        return cls(np.stack([right, np.cross(forward, right), forward]), scale, center)

    def project(self, points: ArrayLike) -> Floats:
        """Return the picture points (..., 2) of world ``points`` (..., 3): center + scale * plane coordinates."""
        points = arrays.floats("points", points, (..., 3), allow="nan")
        seen: Floats = self.center + self.scale * (points @ self.rotation[:2].T)
        return seen

    def depth(self, points: ArrayLike) -> Floats:
        """Return the depths (...) in metres of world ``points`` (..., 3): 0 at the origin, farther is larger."""
        points = arrays.floats("points", points, (..., 3), allow="nan")
        depths: Floats = points @ self.rotation[2]
        return depths

    def unproject(self, pixels: ArrayLike, depths: ArrayLike) -> Floats:
        """Return the world points (..., 3) at picture points ``pixels`` (..., 2) with ``depths`` (...) in metres."""
        pixels = arrays.floats("pixels", pixels, (..., 2), allow="nan")
        depths = arrays.floats("depths", depths, pixels.shape[:-1], allow="nan")[..., None]
        points: Floats = np.concatenate([(pixels - self.center) / self.scale, depths], axis=-1) @ self.rotation
        return points

    @property
    def azimuth(self) -> float:
        """The direction of the camera about the vertical, in degrees: 0 along +z, 90 along +x."""
        back = -self.rotation[2]
        return math.degrees(math.atan2(back[0], back[2]))

    @property
    def elevation(self) -> float:
        """The height of the camera over the horizon, in degrees."""
        return math.degrees(math.asin(float(np.clip(-self.rotation[2, 1], -1, 1))))

    def __repr__(self) -> str:
        return f"OrthographicCamera(azimuth={self.azimuth:.1f}, elevation={self.elevation:.1f}, scale={self.scale:g})"
