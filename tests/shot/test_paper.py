"""The annotated walk on paper that is not white, as PNG and as JPEG, through `read_drawn`."""

import json

import cv2
import numpy as np
import pytest
from scipy import ndimage

from pegbar.shot.drawn import read_drawn
from pegbar.shot.plan import open_shot

PLATE = np.array([30.0, 30.0, 30.0])


def papers(folder, source, *, paper, white_point, suffix):
    """The shot of every sixth frame of a walk flattened onto ``paper``, and the true RGBA pictures."""
    notes = json.loads((source / "annotation.json").read_text())
    pictures = {}
    for frame in range(0, len(notes["frames"]), 6):
        picture = cv2.imread(str(source / notes["frames"][frame]["image"]), cv2.IMREAD_UNCHANGED)
        pictures[frame] = cv2.cvtColor(picture, cv2.COLOR_BGRA2RGBA)
        alpha = picture[..., 3:] / 255
        flat = np.rint(picture[..., :3] * alpha + paper * (1 - alpha)).astype(np.uint8)
        assert cv2.imwrite(str(folder / f"d.{frame:04d}.{suffix}"), flat, [cv2.IMWRITE_JPEG_QUALITY, 88])
    (folder / "shot.toml").write_text(f"""
[shot]
frames = "0-{frame}x6"
[drawing]
frames = "d.####.{suffix}"
labels = {json.dumps(str(source / "seg" / "###.png"))}
annotations = {json.dumps(str(source / "annotation.json"))}
white_point = {white_point}
first_marked = 0
""")
    return open_shot(folder / "shot.toml"), pictures


@pytest.mark.parametrize(("paper", "white_point"), [(255, 255), (250, 245)])
def test_rims_are_neither_too_bright_nor_too_dark_over_a_dark_plate(test_data, tmp_path, paper, white_point):
    source = test_data / "annotated" / "morevna_side_walk"
    shot, pictures = papers(tmp_path, source, paper=paper, white_point=white_point, suffix="png")
    rims, brighter, darker = 0, np.zeros(2, int), np.zeros(2, int)
    for frame, picture in pictures.items():
        drawn, alpha = read_drawn(shot, frame), picture[..., 3:] / 255
        want = picture[..., :3] * alpha + PLATE * (1 - alpha)
        got = drawn.color * drawn.alpha[..., None] + PLATE * (1 - drawn.alpha[..., None])
        rim = ndimage.binary_dilation(alpha[..., 0] > 0) & ~ndimage.binary_erosion(alpha[..., 0] == 1, iterations=2)
        rims += rim.sum()
        for error, counts in ((got - want, brighter), (want - got, darker)):
            counts += [(error.max(axis=2)[rim] > limit).sum() for limit in (40, 20)]
    assert rims > 60_000
    assert brighter[0] <= 0.005 * rims
    assert brighter[1] <= 0.015 * rims
    assert darker[0] <= 0.0009 * rims
    assert darker[1] <= 0.004 * rims


@pytest.mark.parametrize(
    ("paper", "white_point", "suffix", "specks"), [(250, 245, "png", 0), (250, 235, "jpg", 3), (255, 255, "png", 0)]
)
def test_paper_leaves_no_veil_and_limbs_stay_opaque(test_data, tmp_path, paper, white_point, suffix, specks):
    source = test_data / "annotated" / "morevna_side_walk"
    shot, pictures = papers(tmp_path, source, paper=paper, white_point=white_point, suffix=suffix)
    found = 0
    for frame, picture in pictures.items():
        drawn = read_drawn(shot, frame)
        near = ndimage.binary_dilation(picture[..., 3] > 0, np.ones((3, 3)), iterations=4)
        inside = ndimage.binary_erosion(picture[..., 3] == 255, np.ones((3, 3)), iterations=2)
        found += (drawn.alpha[~near] > 0).sum()
        assert (drawn.alpha[inside] == 1).all()
    assert found <= specks
