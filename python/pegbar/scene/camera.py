"""The perspective camera: a 3x4 matrix whose third row gives the depth in metres.

OpenCV axes (x right, y down, z forward), ``M = K [R | t]``, pixel centres at integers, origin top left.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.errors import DegenerateError

Floats = NDArray[np.float64]


def metric(matrices: Floats) -> Floats:
    """Return cameras ``matrices`` (F, 3, 4) scaled so that their third rows give the depth in metres, none mirrored.

    Raises DegenerateError, naming the frame, where the left 3x3 block is singular.
    """
    determinants = np.linalg.det(matrices[:, :, :3])
    lengths = np.linalg.norm(matrices[:, :, :3], axis=2)
    singular = ~(np.abs(determinants) > 1e-12 * np.prod(lengths, axis=1))
    if singular.any():
        frame = int(np.argmax(singular))
        raise DegenerateError(f"matrices: frame {frame}: the left 3x3 block is singular, so it is no finite camera")
    scaled: Floats = matrices * (np.sign(determinants) / lengths[:, 2])[:, None, None]
    return scaled


class PerspectiveCamera:
    """A pinhole camera with a picture size.

    Parameters
    ----------
    matrix : (3, 4) float
        Maps homogeneous world points (metres) to homogeneous pixels. It is rescaled so that its third row's first
        three numbers have length 1 and the camera is not mirrored: ``matrix[2] @ X`` is then the depth in metres.
    image_size : (width, height)
        Size of the picture in pixels.

    Raises
    ------
    ValueError
        For a wrong shape or a size that is not two positive whole numbers.
    DegenerateError
        For a matrix whose left 3x3 block is singular: no finite camera.
    """

    def __init__(self, matrix: ArrayLike, image_size: ArrayLike) -> None:
        raw = arrays.floats("matrix", matrix, (3, 4))
        size = arrays.integers("image_size", image_size, (2,), low=1)
        try:
            self.matrix: Floats = metric(raw[None])[0]
        except DegenerateError:
            raise DegenerateError("matrix: its left 3x3 block is singular, so it is no finite camera") from None
        self.matrix.flags.writeable = False
        self.image_size: tuple[int, int] = (int(size[0]), int(size[1]))

    @classmethod
    def look_at(
        cls,
        position: ArrayLike,
        target: ArrayLike,
        image_size: ArrayLike,
        field_of_view: float,
        *,
        up: ArrayLike = (0, 1, 0),
    ) -> PerspectiveCamera:
        """Return the camera at ``position`` that sees ``target`` in the picture's middle, with ``up`` upwards.

        ``field_of_view`` is horizontal, in radians; points are world metres. A ``target`` at the position or straight
        above or below it raises DegenerateError.
        """
        position = arrays.floats("position", position, (3,))
        forward = arrays.floats("target", target, (3,)) - position
        right = np.cross(forward, arrays.floats("up", up, (3,)))
        if not np.linalg.norm(right) > 1e-9 * np.linalg.norm(forward):
            raise DegenerateError("target: lies at the camera or along its up direction")
        forward, right = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        return cls.from_parts(rotation, position, image_size, field_of_view)

    @classmethod
    def from_parts(
        cls, rotation: ArrayLike, position: ArrayLike, image_size: ArrayLike, field_of_view: float
    ) -> PerspectiveCamera:
        """Return the camera with square pixels and a centred principal point.

        ``rotation`` (3, 3) takes world directions to camera axes (x right, y down, z forward), ``position`` (3,) is
        in metres, ``field_of_view`` horizontal in radians, between 0 and pi.
        """
        if not 0 < field_of_view < math.pi:
            raise ValueError(f"field_of_view: want radians between 0 and pi, got {field_of_view}")
        width, height = arrays.integers("image_size", image_size, (2,), low=1).tolist()
        focal = width / 2 / math.tan(field_of_view / 2)
        intrinsic = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
        rotation = arrays.floats("rotation", rotation, (3, 3))
        position = arrays.floats("position", position, (3,))
        return cls(intrinsic @ np.column_stack([rotation, -rotation @ position]), (width, height))

    def project(self, points: ArrayLike) -> Floats:
        """Return the pixels (..., 2) of world ``points`` (..., 3); a point at the camera's plane gives inf or NaN."""
        points = arrays.floats("points", points, (..., 3), allow="nan")
        image = points @ self.matrix[:, :3].T + self.matrix[:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels: Floats = image[..., :2] / image[..., 2:]
        return pixels

    def depth(self, points: ArrayLike) -> Floats:
        """Return the planar depths (...) in metres of world ``points`` (..., 3); behind the camera is negative."""
        points = arrays.floats("points", points, (..., 3), allow="nan")
        depths: Floats = points @ self.matrix[2, :3] + self.matrix[2, 3]
        return depths

    def unproject(self, pixels: ArrayLike, depths: ArrayLike) -> Floats:
        """Return the world points (..., 3) at ``pixels`` (..., 2) with planar ``depths`` (...) in metres."""
        pixels = arrays.floats("pixels", pixels, (..., 2), allow="nan")
        depths = arrays.floats("depths", depths, pixels.shape[:-1], allow="nan")[..., None]
        image = np.concatenate([pixels * depths, depths], axis=-1)
        points: Floats = (image - self.matrix[:, 3]) @ np.linalg.inv(self.matrix[:, :3]).T
        return points

    def scaled(self, factor: float) -> PerspectiveCamera:
        """Return the same camera for a picture ``factor`` times larger (principal point k p + (k - 1) / 2)."""
        shift = (factor - 1) / 2
        enlarge = np.array([[factor, 0, shift], [0, factor, shift], [0, 0, 1]])
        return PerspectiveCamera(enlarge @ self.matrix, np.rint(np.multiply(self.image_size, factor)).astype(int))

    @cached_property
    def _parts(self) -> tuple[Floats, Floats]:
        """Intrinsic matrix and rotation, by the RQ decomposition of the left 3x3 block."""
        flipped_q, flipped_r = np.linalg.qr(self.matrix[::-1, :3].T)
        intrinsic, rotation = flipped_r.T[::-1, ::-1], flipped_q.T[::-1]
        signs = np.where(np.diag(intrinsic) < 0, -1.0, 1.0)
        return np.asarray(intrinsic * signs, np.float64), np.asarray(rotation * signs[:, None], np.float64)

    @property
    def intrinsic(self) -> Floats:
        """The (3, 3) matrix of focal lengths, skew and principal point, in pixels."""
        return self._parts[0]

    @property
    def rotation(self) -> Floats:
        """The (3, 3) rotation from world directions to camera axes."""
        return self._parts[1]

    @property
    def position(self) -> Floats:
        """The camera's centre (3,) in world metres."""
        centre: Floats = np.linalg.inv(self.matrix[:, :3]) @ -self.matrix[:, 3]
        return centre

    @property
    def focal_length(self) -> float:
        """Horizontal focal length in pixels."""
        return float(self.intrinsic[0, 0])

    @property
    def field_of_view(self) -> float:
        """Horizontal field of view in radians."""
        return 2 * math.atan(self.image_size[0] / 2 / self.focal_length)

    def __eq__(self, other: Any) -> bool:
        if not isinstance(other, PerspectiveCamera):
            return NotImplemented
        return self.image_size == other.image_size and np.array_equal(self.matrix, other.matrix)

    def __hash__(self) -> int:
        return hash((self.matrix.tobytes(), self.image_size))

    def __repr__(self) -> str:
        degrees, place = math.degrees(self.field_of_view), np.round(self.position, 3).tolist()
        return f"PerspectiveCamera(position={place}, field_of_view={degrees:.1f} deg, image_size={self.image_size})"
