"""A binary glTF file in the making: arrays in one buffer, channels in one animation."""

from __future__ import annotations

import numpy as np
import pygltflib as gltf
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_KINDS = {
    np.dtype(np.float32): gltf.FLOAT,
    np.dtype(np.uint16): gltf.UNSIGNED_SHORT,
    np.dtype(np.uint32): gltf.UNSIGNED_INT,
}
_SHAPES = {(): gltf.SCALAR, (3,): gltf.VEC3, (4,): gltf.VEC4, (4, 4): gltf.MAT4}


class GltfWriter:
    """Collects arrays into one buffer and channels into one animation, in ``document``."""

    def __init__(self, interpolation: str, name: str) -> None:
        self.document = gltf.GLTF2(asset=gltf.Asset(version="2.0", generator="pegbar"))
        self.document.animations.append(gltf.Animation(name=name))
        self.interpolation = interpolation
        self._data = bytearray()

    def array(self, values: NDArray[np.generic], *, bounds: bool = False) -> int:
        """Store ``values`` (n, ...) and return the index of its accessor."""
        document, values = self.document, np.ascontiguousarray(values)
        document.bufferViews.append(gltf.BufferView(buffer=0, byteOffset=len(self._data), byteLength=values.nbytes))
        accessor = gltf.Accessor(
            bufferView=len(document.bufferViews) - 1,
            componentType=_KINDS[values.dtype],
            count=len(values),
            type=_SHAPES[values.shape[1:]],
        )
        if bounds:
            flat = values.reshape(len(values), -1)
            accessor.min, accessor.max = flat.min(0).tolist(), flat.max(0).tolist()
        document.accessors.append(accessor)
        self._data += values.tobytes()
        self._data += b"\0" * (-len(self._data) % 4)
        return len(document.accessors) - 1

    def animate(self, node: int, path: str, seconds: int, values: Floats) -> None:
        """Let ``path`` of ``node`` follow ``values`` (F, ...) at the times of accessor ``seconds``."""
        animation = self.document.animations[0]
        output = self.array(values.astype(np.float32))
        sampler = gltf.AnimationSampler(input=seconds, output=output, interpolation=self.interpolation)
        target = gltf.AnimationChannelTarget(node=node, path=path)
        animation.samplers.append(sampler)
        animation.channels.append(gltf.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))

    def finish(self) -> bytes:
        """Return the file."""
        if not self.document.animations[0].channels:
            self.document.animations.clear()
        self.document.buffers.append(gltf.Buffer(byteLength=len(self._data)))
        self.document.set_binary_blob(bytes(self._data))
        return b"".join(self.document.save_to_bytes())
