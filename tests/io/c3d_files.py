"""Makes C3D files in memory, byte by byte, for every processor and number kind."""

import struct

import numpy as np

ORDERS = {84: "<", 85: "<", 86: ">"}


def dec_bytes(values):
    """DEC F floats: four times the IEEE value, its halves swapped."""
    words = (np.asarray(values, "<f4") * np.float32(4)).view("<u4")
    return ((words << np.uint32(16)) | (words >> np.uint32(16))).astype("<u4").tobytes()


class Writer:
    """Packs numbers as one processor does."""

    def __init__(self, processor=84):
        self.processor, self.order = processor, ORDERS[processor]

    def floats(self, values):
        values = np.asarray(values, np.float32)
        return dec_bytes(values) if self.processor == 85 else values.astype(f"{self.order}f4").tobytes()

    def record(self, name, group, body):
        return struct.pack("bb", len(name), group) + name.encode() + struct.pack(self.order + "H", 2 + len(body)) + body

    def parameter(self, name, group, value):
        if isinstance(value, list) and value and isinstance(value[0], str):
            width = max(map(len, value))
            raw = "".join(word.ljust(width) for word in value).encode("latin-1")
            body = struct.pack("bBBB", -1, 2, width, len(value)) + raw
        elif isinstance(value, str):
            body = struct.pack("bBB", -1, 1, len(value)) + value.encode()
        elif isinstance(value, float):
            body = struct.pack("bB", 4, 0) + self.floats([value])
        else:
            values = value if isinstance(value, list) else [value]
            body = struct.pack("bBB", 2, 1, len(values)) + struct.pack(f"{self.order}{len(values)}h", *values)
        return self.record(name, group, body + b"\0")


def make_c3d(points, labels, *, processor=84, scale=-1.0, rate=100.0, analog=0, point=None, trial=None, first=1):
    """A file of ``points`` (F, N, 4): x, y, z and the residual; ``scale`` above 0 stores integers of that unit.

    ``point`` holds further parameters of POINT, or replaces the usual ones; a value of None leaves one out.
    """
    writer, frames, count = Writer(processor), *np.shape(points)[:2]
    values = {"USED": count, "FRAMES": min(frames, 32767), "SCALE": float(scale), "RATE": float(rate), "UNITS": "mm"}
    for start in range(0, len(labels), 255):
        values["LABELS" if start == 0 else f"LABELS{start // 255 + 1}"] = list(labels[start : start + 255])
    values |= point or {}
    chain = writer.record("POINT", -1, b"\0") + writer.record("TRIAL", -2, b"\0")
    chain += b"".join(writer.parameter(name, 1, value) for name, value in values.items() if value is not None)
    chain += b"".join(writer.parameter(name, 2, value) for name, value in (trial or {}).items())
    blocks = -(-(len(chain) + 6) // 512)
    section = (struct.pack("4B", 1, 0x50, blocks & 255, processor) + chain).ljust(512 * blocks, b"\0")
    last = min(first + frames - 1, 65535)
    head = struct.pack(writer.order + "BBHHHHH", 2, 0x50, count, analog, first, last, 10) + writer.floats([scale])
    head += struct.pack(writer.order + "HH", 2 + blocks, 1) + writer.floats([rate])
    table = np.concatenate([np.reshape(points, (frames, -1)), np.full((frames, analog), 7.0)], axis=1)
    if scale > 0:
        table[:, : 4 * count].reshape(frames, count, 4)[..., :3] /= scale
        body = np.rint(table).astype(f"{writer.order}i2").tobytes()
    else:
        body = writer.floats(table.ravel())
    return head.ljust(512, b"\0") + section + body + b"\0" * (-len(body) % 512)
