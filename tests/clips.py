"""Small motion files for tests: a person of `tests.skeletons` as BVH text, in any unit, axes and names."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tests.skeletons import person


def bvh(
    frames: np.ndarray | None = None,
    *,
    unit: float = 1.0,
    turn: np.ndarray | None = None,
    rename: Callable[[str], str] = lambda name: name.replace(" ", "_"),
    rate: float = 30.0,
) -> str:
    """A person walking along its front: ``frames`` (F, 3) are the root's places in metres, the arms turned down.

    ``turn`` takes the person's axes (Y up, Z ahead) to the file's; lengths are divided by ``unit``.
    """
    names, parents, rest = person()
    frames = np.linspace([0, 0.95, 0], [0, 0.95, 2], 30) if frames is None else frames
    turn = np.eye(3) if turn is None else turn
    lines: list[str] = ["HIERARCHY"]

    def offset(vector: np.ndarray) -> str:
        return "OFFSET " + " ".join(f"{value:.6f}" for value in turn @ vector / unit)

    def joint(index: int) -> None:
        root = parents[index] < 0
        lines.append(f"{'ROOT' if root else 'JOINT'} {rename(names[index])}\n{{")
        lines.append(offset(np.zeros(3) if root else rest[index] - rest[parents[index]]))
        lines.append("CHANNELS 3 Xposition Yposition Zposition" if root else "CHANNELS 3 Zrotation Xrotation Yrotation")
        children = [child for child, parent in enumerate(parents) if parent == index]
        for child in children:
            joint(child)
        if not children:
            lines.append(f"End Site\n{{\n{offset(np.array([0, 0.18 if names[index] == 'head' else 0.02, 0]))}\n}}")
        lines.append("}")

    joint(0)
    lines.append(f"MOTION\nFrames: {len(frames)}\nFrame Time: {1 / rate:.8f}")
    still = " 0" * 3 * (len(names) - 1)
    lines += [" ".join(f"{value:.6f}" for value in turn @ place / unit) + still for place in frames]
    return "\n".join(lines) + "\n"
