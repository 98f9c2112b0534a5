"""A small RGBA canvas for overlays, contact sheets and the sample shot: polygons, pens, discs, pictures and words."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays

Color = Sequence[int]


class Canvas:
    """A picture that is painted on, later strokes over earlier ones.

    Points are (x, y) pixels, pixel centres at integers, at most 16000 pixels from the origin. Colours are straight
    RGB or RGBA in 0..255. Inside, pixels are premultiplied; `image` returns them with straight alpha.

    Parameters
    ----------
    width, height : int
        Size in pixels.
    background : (4,) int
        Straight RGBA, transparent by default.
    antialias : bool
        Soft rims. Without, a pixel is painted wholly where its centre is inside: for label pictures.

    Raises
    ------
    ValueError
        From the constructor and every method, naming the argument that is wrong.

    Examples
    --------
    >>> canvas = Canvas(4, 1)
    >>> canvas.polygon([(0.5, -1), (2, -1), (2, 2), (0.5, 2)], (255, 0, 0))
    >>> canvas.image()[0, :, 3].tolist()
    [0, 255, 128, 0]
    """

    def __init__(self, width: int, height: int, background: Color = (0, 0, 0, 0), *, antialias: bool = True) -> None:
        size = arrays.integers("size", (height, width), (2,), low=1, high=2**15)
        red, green, blue, alpha = _rgba("background", background)
        fill = [(value * alpha + 127) // 255 for value in (red, green, blue)]
        self.antialias = antialias
        one = np.array([*fill, alpha], np.uint8).view(np.uint32)
        self._pixels: NDArray[np.uint8] = np.full((*size.tolist(), 1), one).view(np.uint8)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._pixels.shape[1], self._pixels.shape[0]

    def polygon(self, points: ArrayLike, color: Color) -> None:
        """Fill the closed polygon through ``points`` (n, 2); where it overlaps itself it is filled once."""
        points = arrays.floats("points", points, ("n", 2))
        _kernels.fill_polygon(self._pixels, points, _rgba("color", color), self.antialias)

    def polyline(self, points: ArrayLike, width: ArrayLike, color: Color, *, closed: bool = False) -> None:
        """Draw a round pen along ``points`` (n, 2); ``width`` in pixels is one number or one for each point."""
        points = arrays.floats("points", points, ("n", 2))
        width = arrays.floats("width", width, (...,))
        if width.shape not in ((), (len(points),)):
            raise ValueError(f"width: want one number or {len(points)}, got shape {width.shape}")
        widths = np.ascontiguousarray(np.broadcast_to(width, len(points)))
        _kernels.stroke_polyline(self._pixels, points, widths, closed, _rgba("color", color), self.antialias)

    def circle(self, center: ArrayLike, radius: float, color: Color, *, width: float | None = None) -> None:
        """Fill the disc about ``center`` (2,), or draw only its rim with a pen of ``width`` pixels."""
        center = arrays.floats("center", center, (2,))
        radius = float(arrays.floats("radius", radius, ()))
        if radius < 0:
            raise ValueError(f"radius: want zero or more, got {radius}")
        if width is None:
            self.polyline(center[None], 2 * radius, color)
            return
        turn = np.linspace(0, 2 * np.pi, max(12, int(4 * np.sqrt(radius)) * 3), endpoint=False)
        self.polyline(center + radius * np.column_stack([np.cos(turn), np.sin(turn)]), width, color, closed=True)

    def paste(self, image: ArrayLike, x: int, y: int) -> None:
        """Put ``image`` (h, w, 3 or 4) uint8, straight alpha, over the canvas with its corner at column x, row y."""
        picture = arrays.image("image", image)
        left, top = max(x, 0), max(y, 0)
        target = self._pixels[top : max(y + picture.shape[0], 0), left : max(x + picture.shape[1], 0)]
        source = picture[top - y :, left - x :][: target.shape[0], : target.shape[1]]
        if source.shape[2] == 3:
            target[..., :3], target[..., 3] = source, 255
        else:
            _over(source[..., :3].astype(np.uint16), source[..., 3:].astype(np.uint16), target)

    def text(self, xy: ArrayLike, string: str, size: float, color: Color) -> None:
        """Write ``string`` with its first capital's bottom left corner at ``xy``, capitals ``size`` pixels high.

        The letters are OpenCV's plain strokes: other than ASCII characters become question marks.
        """
        place = arrays.floats("xy", xy, (2,))
        letters = string.encode("ascii", "replace").decode()
        red, green, blue, alpha = _rgba("color", color)
        # Hershey capitals are 21 units high at scale 1 in this face.
        scale, thickness = size / 21, max(1, round(size / 9))
        (width, height), below = cv2.getTextSize(letters, cv2.FONT_HERSHEY_SIMPLEX, scale, thickness)
        rim = thickness + 1
        mask = np.zeros((height + below + 2 * rim, width + 2 * rim), np.uint8)
        cv2.putText(mask, letters, (rim, height + rim), cv2.FONT_HERSHEY_SIMPLEX, scale, 255, thickness, cv2.LINE_AA)
        left, top = round(float(place[0])) - rim, round(float(place[1])) - height - rim
        mask = mask[max(-top, 0) :, max(-left, 0) :]
        target = self._pixels[max(top, 0) :, max(left, 0) :][: mask.shape[0], : mask.shape[1]]
        mask = mask[: target.shape[0], : target.shape[1]]
        cover = (mask[..., None].astype(np.uint16) * alpha + 127) // 255
        _over(np.array([red, green, blue], np.uint16), cover, target)

    def image(self) -> NDArray[np.uint8]:
        """Return the picture (H, W, 4) uint8 with straight alpha; transparent pixels are all zero."""
        return _kernels.unpremultiply(self._pixels)


def _over(color: NDArray[np.uint16], cover: NDArray[np.uint16], target: NDArray[np.uint8]) -> None:
    """Put a straight colour with coverage 0..255 over premultiplied pixels, in place."""
    added = np.concatenate([color * cover, np.broadcast_to(cover * 255, (*cover.shape[:2], 1))], axis=2)
    target[:] = (added + target * (255 - cover) + 127) // 255


def _rgba(name: str, color: Color) -> tuple[int, int, int, int]:
    values = arrays.integers(name, color, ((3, 4),), low=0, high=255).tolist()
    red, green, blue, alpha = (*values, 255)[:4]
    return red, green, blue, alpha
