"""Slow reading of BVH text and of Acclaim's bones: one joint, one frame and one rotation at a time."""

import numpy as np
from scipy.spatial.transform import Rotation


def bvh_places(text):
    """Names, world positions (F, J, 3) and rotations (F, J, 3, 3) of a well-formed BVH with one word a name."""
    head, _, body = text.partition("MOTION")
    joints = _hierarchy(head.replace("{", " { ").replace("}", " } ").split())
    words = body.split()
    frames, rows = int(words[1]), np.array(words[5:], float)
    rows = rows.reshape(frames, -1)
    positions, rotations = np.zeros((frames, len(joints), 3)), np.zeros((frames, len(joints), 3, 3))
    for frame in range(frames):
        values = iter(rows[frame])
        for index, (_, parent, offset, channels) in enumerate(joints):
            shift, turn = np.array(offset, float), Rotation.identity()
            for channel in channels:
                axis = "xyz".index(channel[0].lower())
                if channel.lower().endswith("position"):
                    shift[axis] = next(values)
                else:
                    turn = turn * Rotation.from_rotvec(np.eye(3)[axis] * next(values), degrees=True)
            base = np.zeros(3) if parent < 0 else positions[frame, parent]
            axes = np.eye(3) if parent < 0 else rotations[frame, parent]
            positions[frame, index] = base + axes @ shift
            rotations[frame, index] = axes @ turn.as_matrix()
    return [joint[0] for joint in joints], positions, rotations


def _hierarchy(words):
    joints, stack, words = [], [], iter(words)
    for word in words:
        match word:
            case "ROOT" | "JOINT":
                joints.append([next(words), stack[-1] if stack else -1, None, []])
                waiting = len(joints) - 1
            case "End":
                waiting = None
            case "{":
                stack.append(waiting)
            case "}":
                stack.pop()
            case "OFFSET":
                offset = [float(next(words)) for _ in range(3)]
                if stack[-1] is not None:
                    joints[stack[-1]][2] = offset
            case "CHANNELS":
                joints[stack[-1]][3] = [next(words) for _ in range(int(next(words)))]
    return joints


def acclaim_turn(axis_angles, dof, values):
    """A bone's turn C M C^T (3, 3): ``axis_angles`` about fixed x, y, z; ``dof`` as "rx rz", degrees."""
    rest = Rotation.from_euler("xyz", axis_angles, degrees=True).as_matrix()
    motion = np.eye(3)
    for name, value in zip(dof.split(), values, strict=True):
        motion = Rotation.from_euler(name[1], value, degrees=True).as_matrix() @ motion
    return rest @ motion @ rest.T
