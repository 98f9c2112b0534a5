"""Labels and mattes of the annotated walks: real drawn art with exact limb colours and soft borders."""

import json
import os
import subprocess
import sys

import cv2
import numpy as np
import pytest
from scipy import ndimage

from pegbar import grow_labels, matte, palette_labels


def read(path):
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    return cv2.cvtColor(picture, cv2.COLOR_BGRA2RGBA if picture.shape[2] == 4 else cv2.COLOR_BGR2RGB)


@pytest.fixture(params=["morevna_side_walk", "kenney_male_person_walk"])
def walk(request, test_data):
    """Every sixth frame (every one of a short cycle): segmentation, drawing and labels; and the palette."""
    folder = test_data / "annotated" / request.param
    notes = json.loads((folder / "annotation.json").read_text())
    colors = np.array([limb["color"] for limb in notes["limbs"]], np.uint8)
    labels = np.arange(1, len(colors) + 1, dtype=np.uint8)
    frames = notes["frames"] if len(notes["frames"]) < 10 else notes["frames"][::6]
    pictures = [(read(folder / frame["segmentation"]), read(folder / frame["image"])) for frame in frames]
    return pictures, colors, labels


def test_exact_colours_leave_nothing_unmatched_and_grow_over_the_whole_figure(walk):
    pictures, colors, labels = walk
    for painted, drawn in pictures:
        found = palette_labels(painted, colors, labels)
        assert (found.unmatched, found.first_unmatched) == (0, None)
        assert np.array_equal(found.labels > 0, painted[..., :3].any(axis=2))
        figure = drawn[..., 3] > 0
        grown = grow_labels(found.labels, figure)
        assert np.array_equal(grown > 0, figure | (found.labels > 0))
        away = ndimage.distance_transform_edt(found.labels == 0)
        for label in labels:
            mine = (grown == label) & (found.labels == 0)
            assert np.array_equal(ndimage.distance_transform_edt(found.labels != label)[mine], away[mine])


def test_a_tolerance_reads_soft_colours_back(walk):
    pictures, colors, labels = walk
    wrong = unmatched = third = total = 0
    for painted, _ in pictures:
        truth = palette_labels(painted, colors, labels).labels
        soft = palette_labels(cv2.GaussianBlur(painted[..., :3], (0, 0), 0.7), colors, labels, tolerance=30)
        changed = soft.labels != truth
        near = ndimage.maximum_filter(truth, 3) != ndimage.minimum_filter(truth, 3)
        assert not (changed & ~near).any()
        for label in labels:
            third += ((soft.labels == label) & ~ndimage.binary_dilation(truth == label, iterations=3)).sum()
        wrong, unmatched, total = wrong + changed.sum(), unmatched + soft.unmatched, total + (truth > 0).sum()
    assert wrong < 0.002 * total
    assert unmatched < 0.001 * total
    assert third < 1e-4 * total


def test_fill_gives_drawings_on_paper_their_soft_rim_back(walk):
    pictures, colors, labels = walk
    plate, errors, hard = np.array([20.0, 20.0, 30.0]), [], []
    for painted, drawn in pictures[:2]:
        alpha = drawn[..., 3:] / 255
        paper = np.rint(drawn[..., :3] * alpha + 255 * (1 - alpha)).astype(np.uint8)
        figure = drawn[..., 3] > 0
        grown = grow_labels(palette_labels(painted, colors, labels).labels, figure)
        got = matte(paper, labels=grown)
        want = drawn[..., :3] * alpha + plate * (1 - alpha)
        rim = ndimage.binary_dilation(figure) & ~ndimage.binary_erosion(drawn[..., 3] == 255, iterations=2)
        over = got.color * got.alpha[..., None] + plate * (1 - got.alpha[..., None])
        errors.append(abs(over - want).max(axis=2)[rim].mean())
        hard.append(abs(np.where(grown[..., None] > 0, paper, plate) - want).max(axis=2)[rim].mean())
        assert (got.alpha[ndimage.binary_erosion(grown > 0, np.ones((3, 3)))] == 1).all()
    assert np.mean(errors) < 6
    assert np.mean(errors) < 0.25 * np.mean(hard)


HASHES = """
import hashlib, numpy as np, pegbar
chance = np.random.default_rng(3)
labels = np.kron(chance.integers(0, 5, (30, 40)), np.ones((9, 9))).astype(np.uint8)
soft = np.kron(chance.integers(0, 2, (27, 36, 3)) * 255, np.ones((10, 10, 1)))
soft = (soft + chance.integers(-4, 5, soft.shape)).clip(0, 255).astype(np.uint8)
ends = chance.uniform(0, 270, (9, 2, 2))
found = pegbar.palette_labels(soft, [[255, 0, 0], [255, 255, 0], [0, 255, 0]], [1, 2, 3], tolerance=20)
made = [found.labels, np.array([found.unmatched, *found.first_unmatched]), pegbar.ink_alpha(soft)]
made += [pegbar.grow_labels(labels, np.ones_like(labels)), pegbar.segment_stick_figure(soft[..., 0].copy(), ends, 9.5)]
for mode in ("ink", "unmix", "fill"):
    got = pegbar.matte(soft, mode, labels=labels)
    made += [got.color, got.alpha]
print(hashlib.sha256(b"".join(array.tobytes() for array in made)).hexdigest())
"""


def test_results_do_not_depend_on_the_number_of_threads():
    runs = []
    for threads in "135":
        environment = {**os.environ, "RAYON_NUM_THREADS": threads}
        command = [sys.executable, "-c", HASHES]
        runs.append(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)
    assert len(set(runs)) == 1
    assert len(runs[0]) == 65
