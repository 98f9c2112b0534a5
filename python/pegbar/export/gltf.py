"""A motion as binary glTF: a skinned figure of capsules that viewers, Blender and game engines play."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pygltflib as gltf
from numpy.typing import ArrayLike, NDArray

from pegbar.export.gltf_writer import GltfWriter
from pegbar.export.rig import Rig, frame_seconds, rig
from pegbar.scene.motion import Motion


def glb(
    motion: Motion,
    *,
    times: ArrayLike | None = None,
    interpolation: Literal["linear", "step"] = "linear",
    name: str = "motion",
) -> bytes:
    """Return ``motion`` as a .glb file: joints, animation, and a skinned figure of capsules; metres, Y up.

    Joints keep the motion's names. A bone that changes its length moves its child joint and stretches its capsule.

    Parameters
    ----------
    motion : Motion
        A skeleton in motion.
    times : (F,) float, optional
        When each frame is shown, in seconds, rising. None: ``motion.frame_rate``.
    interpolation : {"linear", "step"}
        What happens between frames: "step" holds the pose, as drawings on twos do.
    name : str
        Of the animation and the figure.

    Returns
    -------
    bytes
        The file.

    Raises
    ------
    ValueError
        For a motion without skeleton or frames, or times that do not rise.
    """
    bones = rig(motion)
    writer = GltfWriter(interpolation.upper(), name)
    _joints(writer, bones, frame_seconds(motion, times).astype(np.float32))
    _skin(writer, bones)
    document, roots = writer.document, [joint for joint, parent in enumerate(bones.parents) if parent < 0]
    document.nodes.append(gltf.Node(name=name, mesh=0, skin=0))
    document.scenes.append(gltf.Scene(name=name, nodes=[*roots, len(document.nodes) - 1]))
    document.scene = 0
    return writer.finish()


def _joints(writer: GltfWriter, bones: Rig, seconds: NDArray[np.float32]) -> None:
    """Add a node a joint and let it move."""
    clock = writer.array(seconds, bounds=True)
    for joint, label in enumerate(bones.names):
        offset, turn, scale = bones.translations[:, joint], bones.quaternions[:, joint], bones.scales[:, joint]
        children = [child for child, parent in enumerate(bones.parents) if parent == joint]
        node = gltf.Node(name=label, translation=offset[0].tolist(), rotation=turn[0].tolist(), children=children)
        writer.document.nodes.append(node)
        writer.animate(joint, "rotation", clock, turn)
        if bones.moves[joint]:
            writer.animate(joint, "translation", clock, offset)
        if bones.scaled[joint]:
            writer.animate(joint, "scale", clock, scale)


def _skin(writer: GltfWriter, bones: Rig) -> None:
    """Add mesh and skin: every vertex hangs on one joint alone."""
    document, figure = writer.document, bones.figure
    slots = np.zeros((len(figure.vertices), 4), np.uint16)
    slots[:, 0] = bones.carrier
    attributes = gltf.Attributes(
        POSITION=writer.array(figure.vertices.astype(np.float32), bounds=True),
        NORMAL=writer.array(figure.normals.astype(np.float32)),
        JOINTS_0=writer.array(slots),
        WEIGHTS_0=writer.array(np.tile(np.array([1, 0, 0, 0], np.float32), (len(slots), 1))),
    )
    indices = writer.array(figure.triangles.astype(np.uint32).reshape(-1))
    # glTF stores matrices column by column.
    inverse = np.linalg.inv(bones.bind).transpose(0, 2, 1).astype(np.float32)
    document.skins.append(gltf.Skin(joints=list(range(len(bones.names))), inverseBindMatrices=writer.array(inverse)))
    paint = gltf.PbrMetallicRoughness(baseColorFactor=[0.8, 0.75, 0.7, 1.0], metallicFactor=0.0, roughnessFactor=0.8)
    document.materials.append(gltf.Material(name="figure", pbrMetallicRoughness=paint))
    primitive = gltf.Primitive(attributes=attributes, indices=indices, material=0)
    document.meshes.append(gltf.Mesh(name="figure", primitives=[primitive]))
