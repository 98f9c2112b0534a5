import json

import numpy as np
import pytest

from pegbar.errors import FormatError
from pegbar.io.frames import write_image
from pegbar.io.puppet_input import find_joints, read_puppet_input
from pegbar.scene.body import MARKERS
from tests.figures import SIZE, marks, painted


def written(folder, alpha=True, **changes):
    """A drawn person and its annotation."""
    image, mask = painted(marks(), alpha)
    write_image(folder / "ann.png", image)
    write_image(folder / "mask.png", mask.astype(np.uint8) * 255)
    value = {
        "markers": list(MARKERS),
        "image_size": list(SIZE),
        "frames": [{"image": "ann.png", "xy": marks().round(3).tolist()}],
    }
    (folder / "annotation.json").write_text(json.dumps(value | changes))
    return folder / "ann.png"


def test_a_picture_with_its_joints_beside_it(tmp_path):
    picture = written(tmp_path)
    found = read_puppet_input(picture)
    assert found.names[0] == "pelvis"
    np.testing.assert_array_equal(found.mask, painted(marks())[1])
    np.testing.assert_allclose(found.marks, [marks()[MARKERS.index(name)] for name in found.names], atol=1e-3)
    assert set(found.files) == {picture, tmp_path / "annotation.json"}
    same = read_puppet_input(tmp_path / "annotation.json")
    np.testing.assert_array_equal(same.image, found.image)


def test_a_mask_file_is_taken_before_alpha(tmp_path):
    picture = written(tmp_path)
    half = np.zeros((SIZE[1], SIZE[0]), np.uint8)
    half[:, 100:] = 255
    write_image(tmp_path / "half.png", half)
    found = read_puppet_input(picture, mask=tmp_path / "half.png")
    np.testing.assert_array_equal(found.mask, half > 0)
    assert read_puppet_input(written(tmp_path, alpha=False)).mask is None
    write_image(tmp_path / "small.png", half[:50])
    with pytest.raises(FormatError, match="small.png: the mask is 260 x 50 pixels; want 260 x 320 as ann.png"):
        read_puppet_input(picture, mask=tmp_path / "small.png")


def test_coco_and_animated_drawings_are_read(tmp_path, test_data):
    picture = written(tmp_path)
    points = dict(zip(MARKERS, marks().tolist(), strict=True))
    order = ["head"] * 5
    order += [
        f"{side}_{joint}"
        for joint in ("shoulder", "elbow", "hand", "hip", "knee", "foot")
        for side in ("left", "right")
    ]
    keypoints = [value for name in order for value in (*points[name], 2)]
    coco = {
        "images": [{"id": 1, "file_name": "ann.png", "width": SIZE[0], "height": SIZE[1]}],
        "annotations": [{"image_id": 1, "keypoints": keypoints}],
    }
    (tmp_path / "ann.json").write_text(json.dumps(coco))
    assert find_joints(picture) == tmp_path / "ann.json"
    found = read_puppet_input(picture)
    np.testing.assert_allclose(found.marks[found.names.index("left_hand")], points["left_hand"])
    folder = test_data / "drawings" / "animated_drawings" / "char6"
    pig = read_puppet_input(folder / "texture.png")
    assert pig.drives["right_foot_f"] == "right_hand"
    assert pig.mask.any()
    assert len(pig.files) == 3


def test_problems_name_the_file(tmp_path):
    picture = written(tmp_path, image_size=[100, 90])
    with pytest.raises(FormatError, match=r"ann.png: is 260 x 320 pixels; its joints are of 100 x 90"):
        read_puppet_input(picture)
    frames = [{"image": "ann.png", "xy": [[40, 50]]}]
    picture = written(tmp_path, markers=["head"], frames=frames)
    with pytest.raises(FormatError, match=r"annotation.json: joints: want a pelvis, or a left_hip and a right_hip"):
        read_puppet_input(picture)
    with pytest.raises(ValueError, match="frame: want 0 to 0, got 3"):
        read_puppet_input(picture, frame=3)
    with pytest.raises(ValueError, match="map: the figure has no joint 'paw'"):
        read_puppet_input(written(tmp_path), map={"paw": "left_hand"})
    (tmp_path / "annotation.json").unlink()
    with pytest.raises(FileNotFoundError, match="no joints are marked beside the picture"):
        read_puppet_input(picture)
    with pytest.raises(FileNotFoundError, match="no such file"):
        read_puppet_input(tmp_path / "missing.png")
    value = {"markers": ["head"], "image_size": [9, 9], "frames": [{"xy": [[4, 5]]}]}
    (tmp_path / "annotation.json").write_text(json.dumps(value))
    with pytest.raises(FormatError, match="names no picture: give the picture as well"):
        read_puppet_input(tmp_path / "annotation.json")
