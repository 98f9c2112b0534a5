"""A tiny shot with everything in it: a two-limb figure that moves, and a rendered bar between the limbs."""

import numpy as np

from pegbar import Drawing, Limb, read_annotations, write_annotations
from pegbar.io.exr import write_exr
from pegbar.io.frames import write_image

WIDTH, HEIGHT = 48, 32
BODY, ARM = (255, 255, 0), (0, 128, 255)
NEAR, MIDDLE, FAR = 3.0, 4.0, 5.0
SHOT = """\
[shot]
frames = "1-{count}"
size = [48, 32]

[drawing]
frames = "d.####.png"
labels = "l.####.png"
annotations = "marks.json"

[passes]
beauty = "p.####.exr"

[output]
frames = "final/f.####.png"
depth = "depth/z.####.exr"
depth_picture = "depth/z.####.png"
"""


def make_shot(folder, count=4, extra=""):
    """Write the shot into ``folder`` and return the path of its shot file.

    Frame f: the body (far) fills columns 4..19, the arm (near) columns 28..43, both shifted by f (by 1 again from
    frame 5 on, and so forth); the bar, rows 12..19, is rendered in the middle depth across the whole picture, so it
    covers the body and not the arm.
    """
    folder.mkdir(parents=True, exist_ok=True)
    markers = []
    for frame in range(1, count + 1):
        drawing, labels, ends = draw(frame)
        write_image(folder / f"d.{frame:04d}.png", drawing)
        write_image(folder / f"l.{frame:04d}.png", labels)
        write_exr(folder / f"p.{frame:04d}.exr", bar())
        markers.append(ends)
    marks = Drawing(
        ("pelvis", "neck", "left_elbow", "left_hand"),
        np.array(markers, float),
        np.ones((count, 4), bool),
        (WIDTH, HEIGHT),
        limbs=(Limb("body", "pelvis", "neck", BODY), Limb("arm", "left_elbow", "left_hand", ARM)),
        depths=np.tile([FAR, FAR, NEAR, NEAR], (count, 1)),
    )
    write_annotations(folder / "marks.json", marks)
    (folder / "shot.toml").write_text(SHOT.format(count=count) + extra)
    return folder / "shot.toml"


def move_mark(shot, frame, name, place):
    """Put one mark of ``frame`` somewhere else in the annotations beside ``shot``."""
    path = shot.parent / "marks.json"
    marks = read_annotations(path)
    marks.markers[frame - 1, marks.names.index(name)] = place
    write_annotations(path, marks)


def draw(frame):
    """Return the drawing (RGBA, a soft line round each limb), its labels, and the marks."""
    frame = (frame - 1) % 4 + 1
    drawing = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    labels = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    for left, color, paint in ((4 + frame, BODY, (200, 150, 100)), (28 + frame, ARM, (90, 160, 90))):
        drawing[3:29, left - 1 : left + 17] = (20, 20, 20, 128)
        drawing[4:28, left : left + 16] = (*paint, 255)
        labels[4:28, left : left + 16] = color
    return drawing, labels, [[12 + frame, 27], [12 + frame, 4], [36 + frame, 4], [36 + frame, 27]]


def bar():
    """Return the passes of the bar: opaque linear red in the middle depth."""
    beauty = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    depth = np.full((HEIGHT, WIDTH), np.inf, np.float32)
    beauty[12:20], depth[12:20] = (1, 0, 0, 1), MIDDLE
    return {"": beauty, "Z": depth}
