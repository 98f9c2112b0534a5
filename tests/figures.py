"""A person drawn with plain shapes, a clip in which that person stands, and an animal with four legs."""

import cv2
import numpy as np

from pegbar.scene.body import MARKERS, bones_between
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.drawn_skeleton import drawn_skeleton
from pegbar.scene.motion import Motion
from pegbar.scene.puppet_input import PuppetInput

SIZE = (260, 320)
#: Metres, the left on +x: a person who faces +z.
STANDING = {
    "pelvis": (0, 0.95, 0),
    "chest": (0, 1.2, 0),
    "neck": (0, 1.45, 0),
    "head": (0, 1.62, 0.02),
    "left_shoulder": (0.19, 1.42, 0),
    "left_elbow": (0.4, 1.25, 0),
    "left_hand": (0.58, 1.02, 0.03),
    "left_hip": (0.1, 0.93, 0),
    "left_knee": (0.16, 0.5, 0.03),
    "left_foot": (0.2, 0.08, 0),
}
STANDING |= {name.replace("left", "right"): (-x, y, z) for name, (x, y, z) in STANDING.items() if "left" in name}
COLORS = {"torso": (200, 60, 60), "head": (240, 200, 160), "left": (60, 160, 60), "right": (60, 60, 200)}
WIDTHS = {"torso": 44, "head": 40, "arm": 15, "leg": 22}


def camera(azimuth=0.0, distance=5.0):
    """A camera that sees the person from ``azimuth`` degrees to its left."""
    angle = np.radians(azimuth)
    place = (distance * np.sin(angle), 0.9, distance * np.cos(angle))
    return PerspectiveCamera.look_at(place, (0, 0.86, 0), SIZE, np.radians(24))


def clip(sway=0.04, frames=7, names=MARKERS):
    """The person moves its arms a little, mirrored from frame to frame, and walks nowhere."""
    poses = np.repeat(np.array([STANDING[name] for name in names], float)[None], frames, axis=0)
    for frame in range(frames):
        for joint, name in enumerate(names):
            if name.endswith(("hand", "elbow")):
                poses[frame, joint, 1] += sway * (frame - frames // 2)
    turns = np.broadcast_to(np.eye(3), (*poses.shape[:2], 3, 3)).copy()
    return Motion(tuple(names), (-1,) * len(names), poses, turns, 30.0)


def marks(azimuth=0.0, changes=None):
    """Pixels (16, 2) of the standing person's joints; ``changes`` are other places in metres."""
    pose = STANDING | (changes or {})
    return camera(azimuth).project(np.array([pose[name] for name in MARKERS], float))


def painted(points, alpha=True):
    """The person as a picture (H, W, 4) and its mask."""
    at = dict(zip(MARKERS, points, strict=True))
    image = np.full((SIZE[1], SIZE[0], 3), 255, np.uint8)
    mask = np.zeros(image.shape[:2], np.uint8)

    def stroke(names, color, width):
        line = np.rint([at[name] for name in names]).astype(np.int32)
        for canvas, value in ((image, color), (mask, 1)):
            cv2.polylines(canvas, [line], False, value, width)

    for side in ("right", "left"):
        stroke([f"{side}_{joint}" for joint in ("hip", "knee", "foot")], COLORS[side], WIDTHS["leg"])
    stroke(("neck", "chest", "pelvis"), COLORS["torso"], WIDTHS["torso"])
    stroke(("neck", "head"), COLORS["head"], WIDTHS["head"])
    for side in ("right", "left"):
        stroke([f"{side}_{joint}" for joint in ("shoulder", "elbow", "hand")], COLORS[side], WIDTHS["arm"])
    picture = np.dstack([image, mask * 255]) if alpha else image
    return picture, mask.astype(bool)


def figure(azimuth=0.0, changes=None, hidden=(), **fields):
    """The drawn person as what a puppet is made from."""
    points = marks(azimuth, changes)
    image, mask = painted(points)
    bones = np.array(sorted(bones_between(MARKERS), key=lambda bone: MARKERS.index(MARKERS[bone[1]])), np.int64)
    order = ["pelvis"]
    ordered = []
    while len(ordered) < len(bones):
        for parent, child in bones:
            if MARKERS[parent] in order and MARKERS[child] not in order:
                order.append(MARKERS[child])
                ordered.append((parent, child))
    values = {
        "image": image,
        "mask": mask,
        "names": MARKERS,
        "marks": points,
        "visible": np.array([name not in hidden for name in MARKERS]),
        "bones": np.array(ordered, np.int64),
        "drives": {name: name for name in MARKERS},
    }
    return PuppetInput(**(values | fields))


def animal():
    """A four-legged figure that goes to the right, with a tail."""
    places = {"pelvis": (60, 120), "chest": (110, 118), "neck": (160, 110), "head": (195, 85), "tail": (25, 95)}
    for place, x in (("b", 62), ("f", 158)):
        for side, aside in (("left", -9), ("right", 9)):
            for joint, y in (("hip", 130), ("knee", 160), ("foot", 190)):
                places[f"{side}_{joint}_{place}"] = (x + aside, y)
    parents = {"tail": "pelvis"}
    for name in places:
        side, _, rest = name.partition("_")
        if side in ("left", "right"):
            joint, place = rest.split("_")
            above = {"hip": "pelvis", "knee": f"{side}_hip_{place}", "foot": f"{side}_knee_{place}"}
            parents[name] = above[joint]
    names = tuple(places)
    skeleton = drawn_skeleton(
        names, np.array([places[name] for name in names], float), np.ones(len(names), bool), parents
    )
    mask = np.zeros((220, 240), np.uint8)
    cv2.ellipse(mask, (110, 115), (75, 28), 0, 0, 360, 1, -1)
    cv2.circle(mask, (195, 85), 24, 1, -1)
    for name, place in places.items():
        if name in parents:
            cv2.line(mask, places[parents[name]], place, 1, 5 if name == "tail" else 13)
    cv2.line(mask, (160, 110), (195, 85), 1, 20)
    image = np.dstack([np.full((220, 240, 3), (230, 150, 150), np.uint8), mask * 255])
    return PuppetInput(
        image=image,
        mask=mask.astype(bool),
        names=skeleton.names,
        marks=skeleton.marks,
        visible=skeleton.visible,
        bones=skeleton.bones,
        drives=skeleton.drives,
    )


def six_armed():
    """The person with two more pairs of arms, lower on the trunk."""
    places = dict(zip(MARKERS, marks(), strict=True))
    parents = {}
    for pair, lower in ((2, 0.14), (3, 0.28)):
        for side in ("left", "right"):
            above = "chest"
            for joint in ("shoulder", "elbow", "hand"):
                x, y, z = STANDING[f"{side}_{joint}"]
                name = f"{side}_{joint}_{pair}"
                places[name] = camera().project(np.array([x, y - lower - 0.06 * (joint != "shoulder"), z]))
                parents[name], above = above, name
    names, points = tuple(places), np.array(list(places.values()))
    skeleton = drawn_skeleton(names, points, np.ones(len(names), bool), parents)
    image, mask = painted(points[: len(MARKERS)])
    mask, image = mask.astype(np.uint8), np.ascontiguousarray(image)
    for name, above in parents.items():
        if above != "chest":
            ends = [np.rint(places[joint]).astype(int).tolist() for joint in (above, name)]
            cv2.line(mask, *ends, 1, WIDTHS["arm"])
            cv2.line(image, *ends, (*COLORS[name.split("_")[0]], 255), WIDTHS["arm"])
    return PuppetInput(
        image=image,
        mask=mask.astype(bool),
        names=skeleton.names,
        marks=skeleton.marks,
        visible=skeleton.visible,
        bones=skeleton.bones,
        drives=skeleton.drives,
    )
