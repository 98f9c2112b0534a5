"""Passes of another package: every fault is found and named, mended where that can be, and nothing is made up."""

import numpy as np
import pytest

from pegbar import FormatError
from pegbar.io.exr import read_exr, read_passes, write_exr
from pegbar.shot.import_stage import ImportStage
from pegbar.shot.incoming import Incoming
from pegbar.shot.passes_check import ImportOptions
from tests.export.rendered import SIZE, depths, radial, small, truth, with_ground, write
from tests.export.shots import FRAMES


@pytest.fixture(scope="module")
def scene():
    return small()


def stage(folder, scene, pattern, *, frames=FRAMES, shift=0, layer=None, **options):
    incoming = Incoming.find([pattern] if isinstance(pattern, str) else pattern, shift, layer)
    return ImportStage(incoming, tuple(frames), scene, folder / "imported", ImportOptions(**options))


def lines(found, kind):
    return {(line.what, line.where): line.found for line in found if line.kind == kind}


def problems(found):
    return [f"{line.what}: {line.where}: {line.found}: {line.remedy}" for line in found if line.kind == "problem"]


def taken(tmp_path, scene, pattern, **options):
    """Import, and compare what is written with the truth; return the findings."""
    work = stage(tmp_path, scene, pattern, **options)
    found, judgement = work.check()
    assert judgement is not None, problems(found)
    work.run(judgement)
    for row in (0, 5):
        right, passes = truth(scene, row), read_passes(work.outputs.path(FRAMES[row]))
        np.testing.assert_allclose(passes.depth, right["Z"], rtol=2e-4)
        np.testing.assert_allclose(passes.beauty, right[""], atol=1e-6)
    return found


def test_good_passes_are_good(tmp_path, scene):
    found = taken(tmp_path, scene, write(tmp_path / "in", scene))
    assert {line.kind for line in found} == {"ok"}
    said = {line.what: line.found for line in found}
    assert said["camera"].endswith("(100% agree)")
    assert said["unit"] == "metres"
    assert said["alpha"] == "premultiplied"
    assert said["channels"] == "colour RGBA; depth Z, to check by: check.Depth.Z"


@pytest.mark.parametrize(
    ("change", "what", "said"),
    [
        (lambda depth, camera: depth * 100, "unit", "cm"),
        (lambda depth, camera: depth * 1000, "unit", "mm"),
        (lambda depth, camera: depth / 0.3048, "unit", "foot"),
        (lambda depth, camera: depth / 0.0254, "unit", "inch"),
        (radial, "depth", "along rays"),
        (lambda depth, camera: radial(depth, camera) * 100, "depth", "along rays"),
        (lambda depth, camera: 1 / depth, "depth", "one over the distance"),
        (lambda depth, camera: -depth, "depth", "negative"),
        (lambda depth, camera: -1 / depth, "depth", "one over the distance"),
        (lambda depth, camera: np.where(np.isinf(depth), 0, depth), "background", "depth 0"),
        (lambda depth, camera: np.where(np.isinf(depth), np.nan, depth), "background", "depth NaN"),
    ],
)
def test_a_depth_of_another_kind_is_made_planar_metres(tmp_path, scene, change, what, said):
    with np.errstate(divide="ignore"):
        found = taken(tmp_path, scene, write(tmp_path / "in", scene, depths(change)))
    assert any(line.what == what and line.kind == "mended" and said in line.found for line in found)
    assert any(line.what == "camera" and line.kind == "ok" for line in found)


@pytest.mark.parametrize("far", [1e10, 1e30, 65504.0, 1000.0])
def test_every_background_becomes_infinite(tmp_path, scene, far):
    found = taken(tmp_path, scene, write(tmp_path / "in", scene, depths(lambda depth, camera: np.minimum(depth, far))))
    assert {line.kind for line in found if line.what == "background"} == {"ok" if far > 1e9 else "mended"}


def test_a_scale_of_its_own_is_taken_and_told(tmp_path, scene):
    found = taken(tmp_path, scene, write(tmp_path / "in", scene, depths(lambda depth, camera: depth * 4)))
    assert lines(found, "guess") == {("unit", "some frames"): "0.25 metres a unit"}


def test_straight_alpha_is_multiplied(tmp_path, scene):
    def change(channels, camera, frame):
        beauty = channels[""]
        channels[""] = np.concatenate([beauty[..., :3] / np.maximum(beauty[..., 3:], 1e-6), beauty[..., 3:]], axis=2)

    pattern = write(tmp_path / "in", scene, change)
    found = taken(tmp_path, scene, pattern)
    assert lines(found, "mended") == {("alpha", "some frames"): "straight"}
    taken(tmp_path, scene, pattern, alpha="straight")
    assert stage(tmp_path, scene, pattern, alpha="premultiplied").check()[1].alpha == "premultiplied"


def test_what_the_user_says_counts(tmp_path, scene):
    pattern = write(tmp_path / "in", scene, depths(radial), check=False)
    taken(tmp_path, scene, pattern, form="radial")
    again = write(tmp_path / "cm", scene, depths(lambda depth, camera: depth * 100))
    found, judgement = stage(tmp_path, scene, again, unit=1.0).check()
    assert judgement is None
    assert "cm would fit" in problems(found)[0]


def test_the_wrong_size_is_named(tmp_path, scene):
    def half(channels, camera, frame):
        return {name: plane[::2, ::2] for name, plane in channels.items()}

    found, judgement = stage(tmp_path, scene, write(tmp_path / "half", scene, half)).check()
    assert judgement is None
    assert "120 x 68 pixels, the drawing has 240 x 135" in problems(found)[0]

    def odd(channels, camera, frame):
        return half(channels, camera, frame) if frame == 104 else None

    found, judgement = stage(tmp_path, scene, write(tmp_path / "odd", scene, odd)).check()
    assert judgement is None
    assert any(line.startswith("size: frame 104") for line in problems(found))


def test_larger_passes_are_kept_large(tmp_path, scene):
    def twice(channels, camera, frame):
        return {name: np.repeat(np.repeat(plane, 2, axis=0), 2, axis=1) for name, plane in channels.items()}

    work = stage(tmp_path, scene, write(tmp_path / "in", scene, twice))
    found, judgement = work.check()
    assert "480 x 270 pixels: 2 times" in lines(found, "ok")["size", "frames 101-108"]
    work.run(judgement)
    assert read_passes(work.outputs.path(101)).depth.shape == (270, 480)


def test_missing_and_damaged_frames_are_named(tmp_path, scene):
    pattern = write(tmp_path / "in", scene)
    (tmp_path / "in/r.0103.exr").unlink()
    (tmp_path / "in/r.0106.exr").unlink()
    found, judgement = stage(tmp_path, scene, pattern).check()
    assert judgement is None
    assert problems(found) == ["frames: frames 103, 106: missing: render them, or name others with --frames"]
    broken = tmp_path / "in/r.0105.exr"
    broken.write_bytes(broken.read_bytes()[:5000])
    found, judgement = stage(tmp_path, scene, pattern, frames=[101, 102, 104, 105]).check()
    assert judgement is None
    assert any("r.0105.exr" in line and "frame 105" in line for line in problems(found))
    assert stage(tmp_path, scene, pattern, frames=[101, 102, 104]).check()[1] is not None


def test_frames_numbered_otherwise_want_a_shift(tmp_path, scene):
    pattern = write(tmp_path / "in", scene, number=lambda frame: frame - 101)
    found, judgement = stage(tmp_path, scene, pattern).check()
    assert judgement is None
    assert "numbered frames 0-7: --shift 101" in problems(found)[0]
    taken(tmp_path, scene, pattern, shift=101)


def test_pictures_of_other_frames_are_found_by_the_limbs(tmp_path, scene):
    late = write(tmp_path / "in", scene, rows=lambda row: min(row + 1, 7))
    found, judgement = stage(tmp_path, scene, late).check()
    assert judgement is None
    assert "the shot's frames 1 later" in problems(found)[0]


@pytest.mark.parametrize("shift", [(6.0, 0.0), (0.0, -5.0)])
def test_another_camera_is_refused(tmp_path, scene, shift):
    other = small(shift=(4 * shift[0], 4 * shift[1]))
    found, judgement = stage(tmp_path, scene, write(tmp_path / "in", other)).check()
    assert judgement is None
    assert any("another camera" in line for line in problems(found))


def test_a_farther_camera_is_no_unit(tmp_path, scene):
    other = small()
    moved = [camera.matrix + np.array([[0] * 4, [0] * 4, [0, 0, 0, 0.8]]) for camera in other.cameras]
    cameras = tuple(type(other.cameras[0])(matrix, SIZE) for matrix in moved)
    object.__setattr__(other, "cameras", cameras)
    found, judgement = stage(tmp_path, scene, write(tmp_path / "in", other)).check()
    assert judgement is None
    assert any("another camera" in line for line in problems(found))


def test_the_ground_tells_where_limbs_are_not_rendered(tmp_path, scene):
    def change(channels, camera, frame):
        with_ground(channels, camera, frame)
        channels["Z"] = np.asarray(radial(channels["Z"], camera) * 100, np.float32)

    found, judgement = stage(tmp_path, scene, write(tmp_path / "in", scene, change, check=False)).check()
    assert (judgement.convention.form, judgement.convention.scale) == ("radial", 0.01)
    assert any(line.what == "camera" and line.kind == "ok" and "ground" in line.found for line in found)


@pytest.mark.parametrize(("factor", "unit"), [(1, 1.0), (100, 0.01), (1000, 0.001)])
def test_without_anything_known_units_are_guessed_and_said_so(tmp_path, scene, factor, unit):
    changed = write(tmp_path / "in", scene, depths(lambda depth, camera: depth * factor), check=False)
    found = taken(tmp_path, scene, changed)
    assert {line.what for line in found if line.kind == "guess"} == {"depth", "unit", "camera"}
    assert stage(tmp_path, scene, changed).check()[1].convention.scale == unit


def test_normalised_depth_is_refused(tmp_path, scene):
    changed = write(tmp_path / "in", scene, depths(lambda depth, camera: np.minimum(depth / 1000, 1)), check=False)
    found, judgement = stage(tmp_path, scene, changed, unit=1.0, form="planar").check()
    assert judgement is None
    assert any("normalised" in line for line in problems(found))


def test_an_empty_depth_is_refused(tmp_path, scene):
    changed = write(tmp_path / "in", scene, depths(lambda depth, camera: np.full_like(depth, np.inf)), check=False)
    assert any("nothing is in front" in line for line in problems(stage(tmp_path, scene, changed).check()[0]))


def test_frames_with_other_layers_are_named(tmp_path, scene):
    def change(channels, camera, frame):
        return {"beauty": channels[""], "depth.Z": channels["Z"]} if frame == 104 else None

    found, judgement = stage(tmp_path, scene, write(tmp_path / "in", scene, change)).check()
    assert judgement is None
    assert "channels: frame 104: colour beauty.RGBA; depth depth.Z" in problems(found)[0]


def test_layers_to_choose_from_are_listed(tmp_path, scene):
    def change(channels, camera, frame):
        return {"near": channels[""], "near.Z": channels["Z"], "far": channels[""], "far.Z": channels["Z"]}

    pattern = write(tmp_path / "in", scene, change)
    with pytest.raises(FormatError, match="name a layer: far, near"):
        stage(tmp_path, scene, pattern)
    taken(tmp_path, scene, pattern, layer="near")


def test_colour_and_depth_may_be_apart_and_nothing_is_lost(tmp_path, scene):
    def change(channels, camera, frame):
        return {"": channels[""], "crypto.R": np.full(SIZE[::-1], 0.123456789, np.float32), "normal.X": channels["Z"]}

    def deep(channels, camera, frame):
        return {"Depth.V": channels["Z"] * 100, "check.Depth.V": channels["check.Depth.Z"], "mask.Y": channels["Z"]}

    pattern, depth = write(tmp_path / "in", scene, change), write(tmp_path / "deep", scene, deep)
    with pytest.raises(FormatError, match="no depth pass"):
        stage(tmp_path, scene, pattern)
    taken(tmp_path, scene, [pattern, depth])
    kept = read_exr(tmp_path / "imported/passes.0101.exr").channels
    assert kept["crypto.R"].dtype == np.float32
    assert (kept["crypto.R"] == np.float32(0.123456789)).all()
    assert set(kept) == {*"RGBAZ", "crypto.R", "normal.X", "mask.Y", "check.Depth.V"}


def test_nothing_that_is_read_is_replaced(tmp_path, scene):
    write(tmp_path / "imported", scene)
    for path in (tmp_path / "imported").iterdir():
        path.rename(path.with_name(path.name.replace("r.", "passes.", 1)))
    work = stage(tmp_path, scene, str(tmp_path / "imported/passes.####.exr"))
    with pytest.raises(ValueError, match="writing would replace it"):
        _ = work.outputs


def test_other_files_than_exr_are_refused(tmp_path, scene):
    (tmp_path / "a.0001.png").write_bytes(b"")
    with pytest.raises(FormatError, match="want EXR"):
        stage(tmp_path, scene, str(tmp_path / "a.####.png"))
    with pytest.raises(FileNotFoundError):
        stage(tmp_path, scene, str(tmp_path / "b.####.exr"))
    write_exr(tmp_path / "c.0101.exr", {"Z": np.ones((4, 4), np.float32)})
    with pytest.raises(FormatError, match="no beauty pass"):
        stage(tmp_path, scene, str(tmp_path / "c.####.exr"))
