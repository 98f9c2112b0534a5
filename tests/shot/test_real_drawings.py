"""The two annotated walks with a hoop round the waist and a ball on an orbit, through the whole of `composite`.

At every crossing the order must be the known 3D order, and no fringe may stand round the figure. The camera and the
markers' depths are the assumed ones of the annotations.
"""

import json

import numpy as np
import pytest

from pegbar import read_annotations
from pegbar.io.exr import write_exr
from pegbar.io.frames import read_picture
from pegbar.shot.batch import run_frames
from pegbar.shot.drawn import read_drawn
from pegbar.shot.plan import open_shot
from pegbar.shot.stages import CompositeStage
from pegbar.simulate.passes import render_passes
from tests.elements import ball, hoop

WALKS = {"morevna_side_walk": (24, "###.png", 2), "kenney_male_person_walk": (8, "malePerson_walk#.png", 4)}
HOOP, BALL = 1, 2


@pytest.fixture(scope="module", params=WALKS)
def walk(request, test_data, tmp_path_factory):
    """The finished shot of one walk, its marks, and what was rendered for each frame."""
    count, pattern, samples = WALKS[request.param]
    source = test_data / "annotated" / request.param
    folder = tmp_path_factory.mktemp(request.param)
    marks = read_annotations(source / "annotation.json")
    write_shot(folder, source, marks.images[0].parent / pattern, count)
    rendered = []
    for frame in range(count):
        passes = render_passes(elements(marks, frame, count), marks.camera, samples=samples)
        write_exr(folder / f"passes.{frame:04d}.exr", {"": passes.beauty, "Z": passes.depth}, compression="none")
        rendered.append(witnesses(passes))
    shot = open_shot(folder / "shot.toml")
    results = list(run_frames(CompositeStage(shot), list(shot.frames), jobs=1))
    assert [result.error for result in results] == [None] * count
    return shot, marks, rendered


def write_shot(folder, source, drawings, count):
    text = f"""
[shot]
frames = "0-{count - 1}"
[drawing]
frames = {json.dumps(str(drawings))}
labels = {json.dumps(str(source / "seg" / "###.png"))}
annotations = {json.dumps(str(source / "annotation.json"))}
[passes]
beauty = "passes.####.exr"
[output]
frames = "final.####.png"
"""
    (folder / "shot.toml").write_text(text)


def elements(marks, frame, count):
    """A hoop round the waist, and a ball whose orbit takes it round the whole figure once a cycle."""
    place = dict(zip(marks.names, marks.camera.unproject(marks.markers[frame], depths(marks, frame)), strict=True))
    height = np.linalg.norm(place["pelvis"] - place["neck"])
    waist = place["pelvis"] + 0.35 * (place["neck"] - place["pelvis"])
    turn = 2 * np.pi * frame / count
    orbit = waist + 1.3 * height * np.array([np.cos(turn), 0.25 * np.sin(2 * turn), np.sin(turn)])
    return [
        hoop(waist, 0.9 * height, 0.06 * height, axis=(0.15, 1, 0.2), object_id=HOOP),
        ball(orbit, 0.16 * height, object_id=BALL),
    ]


def depths(marks, frame):
    return marks.depths[frame]


def test_at_every_crossing_the_order_is_the_3d_order(walk):
    shot, marks, rendered = walk
    met = {True: 0, False: 0}
    for frame in shot.frames:
        drawn, final = read_drawn(shot, frame), read_picture(shot.output("frames", frame)).astype(int)
        beauty, near, far = rendered[frame]
        solid = (drawn.alpha == 1) & (beauty[..., 3] == 1)
        nearest, farthest = limb_range(shot, marks, frame)
        in_front, behind = solid & (far < nearest), solid & (near > farthest)
        # Colours tell which layer is seen: the render's where it is nearer than its limb's nearest end, and so on.
        assert np.abs(final[in_front][:, :3] - display(beauty[in_front])).max(initial=0) <= 1
        assert np.array_equal(final[behind][:, :3], drawn.color[..., :3][behind])
        met[True] += in_front.sum()
        met[False] += behind.sum()
    area = shot.frames and marks.image_size[0] * marks.image_size[1]
    assert min(met.values()) > 0.001 * area * len(shot.frames)


def test_no_fringe_stands_round_the_figure(walk):
    shot, _, rendered = walk
    for frame in shot.frames:
        drawn, final = read_drawn(shot, frame), read_picture(shot.output("frames", frame)).astype(int)
        beauty, near, _ = rendered[frame]
        soft = (drawn.alpha > 0) & (drawn.alpha < 1)
        assert soft.any()
        over = soft & (beauty[..., 3] == 1) & (near > drawn.depth)
        want = drawn.alpha[over, None] * drawn.color[..., :3][over] + (1 - drawn.alpha[over, None]) * display(
            beauty[over]
        )
        assert np.abs(final[over][:, :3] - want).max(initial=0) <= 1.5
        alone = soft & (beauty[..., 3] == 0)
        assert np.array_equal(final[alone][:, :3], drawn.color[..., :3][alone])
        assert np.abs(final[alone][:, 3] - 255 * drawn.alpha[alone]).max(initial=0) <= 0.5
        lost = soft & (drawn.alpha > 0.5) & ~np.isfinite(drawn.depth)
        assert not lost.any()


def witnesses(passes):
    """Mean colour of a pixel's samples, and its nearest and farthest depth; pixels of mixed samples get alpha 0.5."""
    k = passes.samples
    beauty, depth = (
        np.stack([image[i::k, j::k] for i in range(k) for j in range(k)]) for image in (passes.beauty, passes.depth)
    )
    mean = beauty.mean(axis=0)
    mean[(beauty != beauty[0]).any(axis=(0, 3)), 3] = 0.5
    return mean, depth.min(axis=0), depth.max(axis=0)


def limb_range(shot, marks, frame):
    """Nearest and farthest depth that the limb under each pixel can have."""
    painted = read_picture(shot.labels.path(frame))
    near, far = (np.full(painted.shape[:2], value) for value in (-np.inf, np.inf))
    for limb, (start, end) in zip(marks.limbs, marks.limb_markers, strict=True):
        here = (painted[..., :3] == limb.color).all(axis=-1)
        ends = depths(marks, frame)[[start, end]]
        near[here], far[here] = ends.min() - 1e-5, ends.max() + 1e-5
    return near, far


def display(beauty):
    straight = np.clip(beauty[..., :3] / beauty[..., 3:], 0, 1)
    return 255 * np.where(straight <= 0.0031308, 12.92 * straight, 1.055 * straight ** (1 / 2.4) - 0.055)
