import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar import Drawing, FormatError, Limb, PerspectiveCamera, read_annotations, write_annotations

SMALL = {
    "markers": ["neck", "pelvis", "head"],
    "image_size": [96, 128],
    "fps": 12,
    "loops": True,
    "limbs": [
        {"name": "torso", "from": "neck", "to": "pelvis", "color": [255, 255, 0]},
        {"name": "head", "from": "neck", "to": "head"},
    ],
    "source": "drawn for this test",
    "camera": {"matrix": [[100, 0, 47.5, 0], [0, 100, 63.5, 0], [0, 0, 1, 0]], "note": "assumed"},
    "depths": {"values": [2, 2.5, 3]},
    "frames": [
        {
            "image": "a/1.png",
            "xy": [[1, 2], [3, 4.5], [5, 6]],
            "visible": [True, False, True],
            "extents": {"torso": None},
        },
        {"image": "a/2.png", "xy": [[1, 2], None, [5, 6]], "hold": 3, "extents": {"torso": [1, 2, 3, 4]}},
    ],
}


def save(tmp_path, value):
    file = tmp_path / "annotation.json"
    file.write_text(value if isinstance(value, str) else json.dumps(value, indent=1), encoding="utf-8")
    return file


def changed(**changes):
    """SMALL with values put at places like ``frames__1__xy``; None removes."""
    value = json.loads(json.dumps(SMALL))
    for place, new in changes.items():
        *way, last = (int(key) if key.isdigit() else key for key in place.split("__"))
        target = value
        for key in way:
            target = target[key]
        target[last] = new
    return value


def same(first, second):
    for name in ("markers", "visible", "boxes", "extents", "depths"):
        a, b = getattr(first, name), getattr(second, name)
        assert (a is None) == (b is None), name
        if a is not None:
            np.testing.assert_array_equal(a, b, err_msg=name)
    for name in ("names", "image_size", "frame_rate", "limbs", "loops", "holds"):
        assert getattr(first, name) == getattr(second, name), name
    assert dict(first.notes) == dict(second.notes)
    for name in ("images", "segmentations", "masks"):
        normal = [[os.path.normpath(file) for file in getattr(drawing, name)] for drawing in (first, second)]
        assert normal[0] == normal[1]
    for a, b in zip(first.cameras, second.cameras, strict=True):
        np.testing.assert_allclose(a.matrix, b.matrix, rtol=1e-12, atol=1e-9)


def test_reads_what_the_file_says(tmp_path):
    drawing = read_annotations(save(tmp_path, SMALL))
    assert drawing.names == ("neck", "pelvis", "head")
    assert drawing.markers[0].tolist() == [[1, 2], [3, 4.5], [5, 6]]
    assert np.isnan(drawing.markers[1, 1]).all()
    assert drawing.visible.tolist() == [[True, False, True], [True, False, True]]
    assert drawing.image_size == (96, 128)
    assert drawing.frame_rate == 12
    assert drawing.loops
    assert drawing.limbs == (Limb("torso", "neck", "pelvis", (255, 255, 0)), Limb("head", "neck", "head"))
    assert drawing.images == (tmp_path / "a" / "1.png", tmp_path / "a" / "2.png")
    assert drawing.segmentations == ()
    assert drawing.boxes is None
    assert drawing.holds == (1, 3)
    assert np.isnan(drawing.extents[0]).all()
    assert drawing.extents[1, 0].tolist() == [1, 2, 3, 4]
    assert drawing.depths.tolist() == [[2, 2.5, 3]] * 2
    assert drawing.camera == drawing.cameras[1] == PerspectiveCamera(SMALL["camera"]["matrix"], (96, 128))
    assert drawing.notes == {"source": "drawn for this test"}


def test_a_frame_may_have_its_own_camera_depths_and_boxes(tmp_path):
    matrix = [[100, 0, 47.5, 5], [0, 100, 63.5, 0], [0, 0, 1, 0]]
    boxes = np.arange(16.0).reshape(2, 4, 2).tolist()
    value = changed(frames__1__camera={"matrix": matrix}, frames__0__depths=[7, 8, 9])
    for frame in value["frames"]:
        frame["boxes"] = boxes
    drawing = read_annotations(save(tmp_path, value))
    assert np.array_equal(drawing.cameras[1].matrix, matrix)
    assert drawing.cameras[0].matrix[0, 3] == 0
    assert drawing.depths.tolist() == [[7, 8, 9], [2, 2.5, 3]]
    assert drawing.boxes.tolist() == [boxes, boxes]
    write_annotations(tmp_path / "again.json", drawing)
    same(read_annotations(tmp_path / "again.json"), drawing)


@pytest.mark.parametrize("name", ["morevna_side_walk", "kenney_male_person_walk", "yogait_photos"])
def test_real_drawings(name, test_data, tmp_path):
    drawing = read_annotations(test_data / "annotated" / name / "annotation.json")
    frames = {"morevna_side_walk": 48, "kenney_male_person_walk": 8, "yogait_photos": 2}[name]
    assert drawing.markers.shape == (frames, 16, 2)
    assert all(file.is_file() for file in (*drawing.images, *drawing.segmentations))
    assert len(drawing.segmentations) == len(drawing.cameras) == (0 if name == "yogait_photos" else frames)
    assert drawing.loops == (name == "kenney_male_person_walk")
    assert len({limb.color for limb in drawing.limbs}) == 10
    assert "licence" in drawing.notes
    write_annotations(tmp_path / "again.json", drawing)
    same(read_annotations(tmp_path / "again.json"), drawing)
    text = (tmp_path / "again.json").read_text()
    # A line an entry: a change of one marker shows as one line.
    assert max(map(len, text.splitlines())) < 2000
    assert text.count("\n") > 3 * frames


names = st.lists(
    st.text(min_size=1, max_size=6).filter(lambda word: "\0" not in word), unique=True, min_size=1, max_size=5
)
finite = st.floats(-1e6, 1e6)


@st.composite
def drawings(draw):
    markers = tuple(draw(names))
    frames, count = draw(st.integers(1, 4)), len(markers)
    colors = st.tuples(*[st.integers(0, 255)] * 3).filter(any)
    limb_names = draw(names)
    limb_colors = draw(st.lists(colors, unique=True, min_size=len(limb_names), max_size=len(limb_names)))
    ends = st.sampled_from(markers)
    limbs = tuple(
        Limb(name, draw(ends), draw(ends), draw(st.sampled_from([None, color])))
        for name, color in zip(limb_names, limb_colors, strict=True)
    )
    visible = draw(hnp.arrays(bool, (frames, count)))
    points = draw(hnp.arrays(float, (frames, count, 2), elements=finite))
    points[draw(hnp.arrays(bool, (frames, count))) & ~visible] = np.nan

    def array(*shape):
        return draw(st.none() | hnp.arrays(float, (frames, *shape), elements=finite))

    def files():
        name = st.text("abc ä#%", min_size=1, max_size=5).map(lambda word: Path("/pictures") / f"x{word}.png")
        return draw(st.just(()) | st.lists(name, min_size=frames, max_size=frames).map(tuple))

    size = draw(st.tuples(st.integers(1, 9999), st.integers(1, 9999)))
    matrix = np.array([[100, 0, 47.5, 0], [0, 100, 63.5, 0], [0, 0, 1, 0.0]])
    shifts = draw(st.lists(finite, min_size=frames, max_size=frames) | st.just([]) | finite.map(lambda x: [x] * frames))
    return Drawing(
        names=markers,
        markers=points,
        visible=visible,
        image_size=size,
        frame_rate=draw(st.none() | st.floats(1, 120)),
        images=files(),
        segmentations=files(),
        masks=files(),
        limbs=limbs,
        boxes=array(len(limbs), 4, 2),
        extents=array(len(limbs), 4),
        depths=array(count),
        cameras=tuple(PerspectiveCamera(matrix + np.eye(3, 4, 3) * shift, size) for shift in shifts),
        loops=draw(st.booleans()),
        holds=draw(st.just(()) | st.lists(st.integers(2, 9), min_size=frames, max_size=frames).map(tuple)),
        notes=draw(st.dictionaries(st.sampled_from(["source", "licence", "facing"]), st.text())),
    )


@given(drawings())
def test_what_is_written_is_read(tmp_path_factory, drawing):
    file = tmp_path_factory.getbasetemp() / "drawing.json"
    write_annotations(file, drawing)
    same(read_annotations(file), drawing)
    first = file.read_bytes()
    write_annotations(file, read_annotations(file))
    assert file.read_bytes() == first


MATRIX = SMALL["camera"]["matrix"]
CAMERA = PerspectiveCamera(MATRIX, (96, 128))


@pytest.mark.parametrize(
    ("value", "line", "problem"),
    [
        ("", None, "the file is empty"),
        ('{"markers": [\n"a",\n]}', 3, "not JSON"),
        ('{"markers": ["a"], "image_size": [9, 9],\n"frames": [{"xy": [[NaN, 1]]}]}', 2, "NaN is no JSON number"),
        ('{"markers": ["a"],\n"markers": ["b"]}', None, "the key 'markers' stands twice"),
        ("[1, 2]", 1, "want an object"),
        ("[" * 100_000, None, "not JSON"),
        ('{"frames": 1}', 1, "lacks 'markers'"),
        ('{"fps": ' + "1" * 5000 + "}", None, "not JSON"),
        (changed(markers=["neck", "neck", "head"]), 4, r"markers\[1\]: the marker 'neck' stands twice"),
        (changed(markers=[]), 2, "markers: want at least one"),
        (changed(markers__2=7), 5, r"markers\[2\]: want a text, got 7"),
        (changed(image_size=[96]), 7, "image_size: want width and height"),
        (changed(image_size__1=0), 9, r"image_size\[1\]: want a whole number in 1..1048576, got 0"),
        (changed(image_size__1=True), 9, r"image_size\[1\]: want a whole number"),
        (changed(fps=0), 11, "fps: want a number"),
        (changed(loops=1), 12, "loops: want true or false"),
        (changed(colour=3), '"colour": 3', "colour: unknown key"),
        (changed(limbs__1__name="torso"), 25, r"limbs\[1\].name: the limb 'torso' stands twice"),
        (changed(limbs__0__to="tail"), 17, r"limbs\[0\].to: no marker is called \"tail\"$"),
        (changed(limbs__0__to="haed"), 17, r"no marker is called \"haed\" \(did you mean \"head\"\?\)$"),
        (changed(limbs__0__width=3), 23, r"limbs\[0\].width: unknown key"),
        (changed(limbs__1__color=[255, 255, 0]), 28, "'head' has the colour of 'torso'"),
        (changed(limbs__0__color=[0, 0, 0]), 18, "black is the background"),
        (changed(limbs__0__color=[0, 0, 256]), 21, r"limbs\[0\].color\[2\]: want a whole number in 0..255, got 256"),
        (changed(limbs__0__color=[0, 0]), 18, r"limbs\[0\].color: want red, green and blue"),
        (changed(camera__matrix=MATRIX[:2]), '"matrix": [', "camera.matrix: want 3 entries, got 2"),
        (changed(camera__matrix=[[0] * 4] * 3), '"matrix": [', "camera.matrix: its left 3x3 block is singular"),
        (changed(depths__values=[1, 2]), '"values": [', "depths.values: want 3 entries, got 2"),
        (changed(frames=[]), '"frames": []', "frames: want at least one"),
        (changed(frames__1={"image": "x"}), None, r"frames\[1\]: lacks 'xy'"),
        (changed(frames__1__xy=[[1, 2]]), '"xy": [', r"frames\[1\].xy: want 3 points, one a marker, got 1"),
        (changed(frames__0__xy__2=[1, "2"]), '"2"', r"frames\[0\].xy\[2\]\[1\]: want a number, got \"2\""),
        (changed(frames__0__xy__2=None), "null", r"frames\[0\].xy\[2\]: a visible marker needs a place"),
        (changed(frames__0__visible=[True]), '"visible": [', r"frames\[0\].visible: want 3 times true or false"),
        (changed(frames__0__visible=[True, 1, False]), None, r"frames\[0\].visible: want 3 times true or false"),
        (changed(frames__0__vissible=[True]), '"vissible": [', r"frames\[0\].vissible: unknown key"),
        (changed(frames__1__image=None), None, r"frames\[1\]: lacks 'image', which other frames have"),
        (changed(frames__1__image=5), '"image": 5', r"frames\[1\].image: want a text"),
        (changed(frames__1__hold=0), '"hold": 0', r"frames\[1\].hold: want a whole number"),
        (changed(frames__1__extents={"tail": None}), '"tail": null', r"frames\[1\].extents.tail: unknown key"),
        (changed(frames__1__boxes=[1]), None, r"frames\[0\]: lacks 'boxes'"),
        (changed(frames__0__camera={"matrix": [[0] * 4] * 3}), None, r"frames\[0\].camera.matrix: its left"),
        (changed(frames__1__depths=[1, 2, float("1e308")]), "1e+308", r"frames\[1\].depths\[2\]: want a number"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(value, line, problem, tmp_path):
    file = save(tmp_path, value)
    with pytest.raises(FormatError, match=problem) as error:
        read_annotations(file)
    message = str(error.value)
    assert message.startswith(str(file))
    assert "\n" not in message
    if isinstance(line, int):
        assert error.value.line == line
    elif line:
        assert line in file.read_text().splitlines()[error.value.line - 1]


def test_bytes_that_are_no_text(tmp_path):
    file = tmp_path / "a.json"
    file.write_bytes(b'{"markers": ["\xff"]}')
    with pytest.raises(FormatError, match="at byte 14: not text in UTF-8"):
        read_annotations(file)
    file.write_bytes(b"\xef\xbb\xbf" + json.dumps(SMALL).encode())
    assert read_annotations(file).frame_rate == 12
    with pytest.raises(FileNotFoundError):
        read_annotations(tmp_path / "none.json")


def test_a_real_file_cut_anywhere_is_refused(test_data, tmp_path):
    data = (test_data / "annotated" / "kenney_male_person_walk" / "annotation.json").read_bytes()
    file = tmp_path / "cut.json"
    for twentieth in range(20):
        file.write_bytes(data[: len(data) * twentieth // 20])
        with pytest.raises(FormatError, match=r"cut\.json"):
            read_annotations(file)


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"markers": np.zeros((2, 2, 2))}, "markers: want shape"),
        ({"markers": np.full((2, 1, 2), np.inf)}, "markers: JSON has no infinity"),
        ({"markers": np.full((2, 1, 2), np.nan)}, "a visible marker needs a place"),
        ({"depths": np.full((2, 1), np.nan)}, "depths: want finite"),
        ({"boxes": np.zeros((2, 1, 4, 2))}, "boxes: want shape"),
        ({"names": ("",)}, r"markers\[0\]: want a text"),
        ({"limbs": (Limb("arm", "head", "hand"),)}, r"limbs\[0\].to: no marker is called"),
        ({"limbs": (Limb("arm", "head", "head", (0, 0, 0)),)}, r"limbs\[0\].color: black"),
        ({"notes": {"frames": "many"}}, "notes: 'frames' is a key of the format"),
        ({"notes": {"version": 3}}, "version: unknown key"),
        ({"frame_rate": 0.0}, "fps: want a number"),
        ({"cameras": (CAMERA, CAMERA)}, "cameras: want the drawing's image size"),
        ({"images": (Path("a"),)}, "images: want none or one a frame"),
        ({"markers": np.zeros((0, 1, 2)), "visible": np.zeros((0, 1), bool)}, "at least one frame"),
    ],
)
def test_a_drawing_that_does_not_fit_is_not_written(changes, problem, tmp_path):
    plain = {"names": ("head",), "markers": np.zeros((2, 1, 2)), "visible": np.ones((2, 1), bool)}
    drawing = Drawing(image_size=(9, 9), **(plain | changes))
    with pytest.raises(ValueError, match=problem):
        write_annotations(tmp_path / "a.json", drawing)
    assert list(tmp_path.iterdir()) == []


def test_reading_marks_loads_no_picture_library():
    script = (
        "import sys, pegbar, pegbar.io.sequence, pegbar.io.exposure\n"
        "pegbar.read_annotations, pegbar.write_annotations\n"
        "print([name for name in ('cv2', 'OpenEXR', 'yaml', 'scipy') if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout == "[]\n"
