import json

import numpy as np
import pytest

from pegbar import FormatError, read_annotations
from pegbar.io.coco import KEYPOINTS, read_coco_keypoints


def person(image, shift=0.0, *, flags=2, number=1, **others):
    """Keypoint i lies at (10 i + shift, i)."""
    flags = np.broadcast_to(flags, 17)
    points = [[10 * i + shift, i, int(flag)] if flag else [0, 0, 0] for i, flag in enumerate(flags)]
    return {"id": number, "image_id": image, "category_id": 1, "keypoints": np.ravel(points).tolist()} | others


def save(tmp_path, people, count=1, **others):
    pictures = [{"id": i, "file_name": f"pictures/{i}.jpg", "width": 640, "height": 480} for i in range(1, count + 1)]
    file = tmp_path / "person_keypoints.json"
    file.write_text(json.dumps({"images": pictures, "annotations": people} | others, indent=1))
    return file


def at(drawing, name, frame=0):
    return drawing.markers[frame, drawing.names.index(name)].tolist()


def test_the_seventeen_points_become_canonical_markers(tmp_path):
    drawing = read_annotations(save(tmp_path, [person(1)]))
    index = {name: i for i, name in enumerate(KEYPOINTS)}
    assert len(index) == 17
    for side in ("left", "right"):
        for marker, keypoint in {"shoulder": "shoulder", "hand": "wrist", "foot": "ankle", "knee": "knee"}.items():
            i = index[f"{side}_{keypoint}"]
            assert at(drawing, f"{side}_{marker}") == [10 * i, i]
    # COCO's order: shoulders 5 and 6, hips 11 and 12, ears 3 and 4.
    assert at(drawing, "neck") == [55, 5.5]
    assert at(drawing, "pelvis") == [115, 11.5]
    assert at(drawing, "chest") == [85, 8.5]
    assert at(drawing, "head") == [35, 3.5]
    assert drawing.visible.all()
    assert drawing.image_size == (640, 480)
    assert drawing.images == (tmp_path / "pictures" / "1.jpg",)
    assert [limb.name for limb in drawing.limbs][:2] == ["torso", "head"]
    assert len(drawing.limbs) == 10


def test_flags_are_visible_covered_and_missing(tmp_path):
    flags = np.full(17, 2)
    flags[KEYPOINTS.index("left_wrist")] = 1
    flags[KEYPOINTS.index("left_hip")] = 1
    flags[KEYPOINTS.index("right_ankle")] = 0
    flags[KEYPOINTS.index("left_ear")] = 0
    drawing = read_coco_keypoints(save(tmp_path, [person(1, flags=flags)]))
    visible = dict(zip(drawing.names, drawing.visible[0].tolist(), strict=True))
    assert not visible["left_hand"]
    assert at(drawing, "left_hand") == [90, 9]
    assert not visible["pelvis"]
    assert not visible["chest"]
    assert at(drawing, "pelvis") == [115, 11.5]
    assert not visible["right_foot"]
    assert np.isnan(at(drawing, "right_foot")).all()
    # An ear is missing: the eyes tell where the head is.
    assert at(drawing, "head") == [15, 1.5]
    flags[1:5] = 0
    assert at(read_coco_keypoints(save(tmp_path, [person(1, flags=flags)])), "head") == [0, 0]
    flags[0] = 0
    assert np.isnan(at(read_coco_keypoints(save(tmp_path, [person(1, flags=flags)])), "head")).all()


@pytest.mark.parametrize("size", [{"area": 5}, {"bbox": [0, 0, 1, 5]}, {}])
def test_the_largest_person_or_the_chosen_one(size, tmp_path):
    small = {key: 1 if key == "area" else [0, 0, 1, 1] for key in size}
    few = person(1, shift=7, number=8, flags=[2] * 8 + [0] * 9, **small)
    file = save(tmp_path, [few, person(1, shift=3, number=9, **size), person(1, flags=0, number=10, **small)])
    assert at(read_coco_keypoints(file), "left_elbow") == [73, 7]
    assert at(read_coco_keypoints(file, annotation=8), "left_elbow") == [77, 7]
    with pytest.raises(FormatError, match="no annotation has the id 77"):
        read_coco_keypoints(file, annotation=77)


def test_several_pictures_are_frames(tmp_path):
    file = save(tmp_path, [person(3, shift=3, number=3), person(1, number=5)], count=3)
    drawing = read_coco_keypoints(file)
    assert at(drawing, "left_elbow", 0) == [70, 7]
    assert not drawing.visible[1].any()
    assert np.isnan(drawing.markers[1]).all()
    assert at(drawing, "left_elbow", 2) == [73, 7]
    for image in (3, "3.jpg", "pictures/3.jpg"):
        assert at(read_coco_keypoints(file, image=image), "left_elbow") == [73, 7]
    with pytest.raises(FormatError, match=r"no picture is called '9\.jpg'"):
        read_coco_keypoints(file, image="9.jpg")
    with pytest.raises(FormatError, match="annotation 5 is not in the chosen picture"):
        read_coco_keypoints(file, image=3, annotation=5)


def test_a_category_may_name_its_keypoints(tmp_path):
    order = list(reversed(KEYPOINTS[5:]))
    points = np.ravel([[10 * i, i, 2] for i in range(12)]).tolist()
    people = [{"id": 1, "image_id": 1, "category_id": 4, "keypoints": points}]
    file = save(tmp_path, people, categories=[{"id": 4, "keypoints": order}])
    drawing = read_coco_keypoints(file)
    assert at(drawing, "right_foot") == [0, 0]
    assert at(drawing, "left_shoulder") == [110, 11]
    file = save(tmp_path, people, categories=[{"id": 4, "keypoints": ["tail", *order[1:]]}])
    with pytest.raises(FormatError, match="lacks the keypoints right_ankle"):
        read_coco_keypoints(file)


SIZES = [{"id": i, "file_name": f"{i}.jpg", "width": 640 + i, "height": 480} for i in (1, 2)]


@pytest.mark.parametrize(
    ("people", "others", "problem"),
    [
        ([], {}, "annotations: no keypoints"),
        ([{"image_id": 1, "bbox": [0, 0, 1, 1]}], {}, "annotations: no keypoints"),
        ([person(1), {"keypoints": []}], {}, r":\d+: annotations\[1\]: want an object with image_id"),
        ([person(1, keypoints=[1, 2])], {}, r":\d+: annotations\[0\].keypoints: want 51 entries, got 2"),
        ([person(1, keypoints=[1, 2, 3] * 17)], {}, r"annotations\[0\].keypoints\[2\]: want a flag 0, 1 or 2, got 3"),
        ([person(1, keypoints=[1, None, 2] * 17)], {}, r"keypoints\[1\]: want a number, got null"),
        ([person(1)], {"images": [{"id": 1}]}, r"images\[0\]: want an object with id"),
        ([person(1)], {"images": []}, "images: no pictures"),
        ([person(1)], {"images": SIZES}, r"differ in size, name one: \[\(641, 480\), \(642, 480\)\]"),
        ([person([])], {}, r"annotations\[0\].image_id: want a whole number"),
        ([person(1)], {"categories": [3]}, r"categories\[0\]: want an object"),
    ],
)
def test_what_is_wrong_is_named(people, others, problem, tmp_path):
    file = save(tmp_path, people, **others)
    for read in (read_annotations, read_coco_keypoints):
        with pytest.raises(FormatError, match=rf"person_keypoints\.json.*{problem}"):
            read(file)


def test_a_bare_list_of_results_is_refused(tmp_path):
    file = tmp_path / "results.json"
    file.write_text(json.dumps([person(1)]))
    with pytest.raises(FormatError, match="COCO keypoints need images and annotations"):
        read_coco_keypoints(file)
