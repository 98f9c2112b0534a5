import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pegbar import Clip, OrthographicCamera, match_clips, pose_descriptor, pose_distance
from pegbar.align.marks import EXCHANGED, read_marks
from pegbar.align.sides import mirror
from pegbar.sample.dancer import dance
from pegbar.scene.body import MARKERS
from tests.dancers import RATE, apart, covered, dance_clip, drawn, standstill, turned

few = settings(max_examples=6)
CLIP = dance_clip()


def best(marks, clip=CLIP, **options):
    return match_clips(marks, MARKERS, [clip], **{"frame_rate": RATE, "top": 1, **options}).matches[0]


@few
@given(st.floats(0, 360), st.floats(0, 360), st.floats(-10, 25))
def test_a_turned_world_turns_the_azimuth_and_nothing_else(azimuth, turn, elevation):
    clip = turned(CLIP, turn)
    found = best(drawn(CLIP, 40, 30, azimuth, elevation), clip)
    assert apart(found.azimuth, azimuth + turn) < 2
    assert abs(found.elevation - elevation) < 3
    assert (found.start, found.stop) == (pytest.approx(40, abs=2), pytest.approx(186, abs=2))
    assert (found.mirrored, found.swapped, found.verdict) == (False, False, "fits")
    assert found.cost < 1.5


@few
@given(st.floats(0, 360), st.floats(0.6, 1.7))
def test_a_slower_or_faster_drawing_is_found(azimuth, speed):
    found = best(drawn(CLIP, 50, 20, azimuth, speed=speed))
    assert found.cost < 2
    assert found.start == pytest.approx(50, abs=3)
    assert found.stop == pytest.approx(51 + 19 * 5 * speed, abs=3)
    assert (np.diff(found.times) >= 0).all()


def test_exchanged_marks_are_found_and_told_from_a_mirrored_motion():
    marks, seen = drawn(CLIP, 40, 30, 60, 10), covered(CLIP, 40, 30, 60, 10)
    exchanged = best(marks[:, EXCHANGED], visible=seen[:, EXCHANGED])
    assert (exchanged.swapped, exchanged.mirrored, exchanged.sides_told) == (True, False, True)
    assert apart(exchanged.azimuth, 60) < 2
    mirrored = Clip(CLIP.name, mirror(CLIP.markers).astype(np.float32), 30.0, 120.0, 0, 240)
    marks, seen = drawn(mirrored, 40, 30, 60, 10), covered(mirrored, 40, 30, 60, 10)
    other = best(marks, visible=seen)
    assert (other.swapped, other.mirrored, other.sides_told) == (False, True, True)
    assert apart(other.azimuth, 60) < 2
    assert other.elevation == pytest.approx(10, abs=3)
    assert other.sides == "mirror image of the clip"


def test_a_pose_that_is_its_own_mirror_image_is_as_marked():
    symmetric = (CLIP.markers + mirror(CLIP.markers).astype(np.float32)) / 2
    clip = Clip("both.bvh", symmetric, 30.0, 120.0, 0, 240)
    noise = np.random.default_rng(2).normal(0, 1, (1, 16, 2))
    for frame in (10, 60, 110):
        found = best(drawn(clip, frame, 1, 0) + noise, clip)
        assert (found.mirrored, found.swapped) == (False, False)


@pytest.mark.parametrize("group", ["arms", "legs"])
def test_drawings_with_mixed_up_limbs_are_named(group):
    marks = drawn(CLIP, 40, 30, 20)
    assert best(marks).mixed == {}
    joints = ("shoulder", "elbow", "hand") if group == "arms" else ("hip", "knee", "foot")
    wrong = marks.copy()
    for joint in joints:
        left, right = MARKERS.index(f"left_{joint}"), MARKERS.index(f"right_{joint}")
        wrong[[7, 8, 20], left], wrong[[7, 8, 20], right] = marks[[7, 8, 20], right], marks[[7, 8, 20], left]
    found = best(wrong)
    assert {name: frames.tolist() for name, frames in found.mixed.items()} == {group: [7, 8, 20]}


def test_a_mirrored_picture_is_told_by_covered_marks_only():
    marks, seen = drawn(CLIP, 40, 30, 60, 10) * [-1, 1], covered(CLIP, 40, 30, 60, 10)
    told = best(marks, visible=seen)
    assert (told.swapped, told.mirrored, told.sides) == (True, True, "picture mirrored")
    # Without them it is the view from the other side.
    untold = best(marks)
    assert (untold.swapped, untold.mirrored, untold.sides_told) == (False, False, False)
    assert apart(untold.azimuth, 240) < 2


@pytest.mark.parametrize("kind", ["as marked", "exchanged", "mirrored picture"])
def test_the_matched_markers_lie_on_the_drawing(kind):
    marks, seen = drawn(CLIP, 40, 30, 60, 10), covered(CLIP, 40, 30, 60, 10)
    if kind == "exchanged":
        marks, seen = marks[:, EXCHANGED], seen[:, EXCHANGED]
    elif kind == "mirrored picture":
        marks = marks * [-1, 1]
    found = best(marks, visible=seen)
    points = found.camera.project(found.markers(CLIP))
    pairs = [
        (MARKERS.index(a), MARKERS.index(b)) for a, b in (("left_hip", "left_knee"), ("right_elbow", "right_hand"))
    ]
    distance = np.diagonal(pose_distance(pose_descriptor(marks, pairs), pose_descriptor(points, pairs)))
    assert np.degrees(distance.mean()) / 2 < 3


def test_a_clip_as_long_as_the_drawing_is_found_without_its_rate():
    # At 12 a second the first pass likes it as well, but the drawings last longer than the clip then.
    short = Clip.from_motion("short.bvh", dance(12).clip)
    for azimuth in (3, 20):
        found = best(drawn(short, 0, 12, azimuth, -2, rate=24), short, frame_rate=None)
        assert (found.start, found.drawing_rate, found.verdict) == (0, 24, "fits")
        assert found.stop >= 11


def test_the_cost_is_equation_4_of_the_matched_poses():
    rng = np.random.default_rng(3)
    marks = drawn(CLIP, 40, 30, 60) + rng.normal(0, 4, (30, 16, 2))
    found = best(marks)
    read = read_marks(marks, MARKERS, np.ones((30, 16), bool), frame_rate=RATE, holds=np.ones(30), loops=False)
    points = found.camera.project(CLIP.at(found.times))
    distances = pose_distance(
        pose_descriptor(marks, read.pairs),
        pose_descriptor(points, read.pairs),
        weights=read.weights,
        a_trust=read.trust[0],
    )
    assert np.degrees(np.diagonal(distances).mean()) / read.weights.sum() == pytest.approx(found.cost, rel=2e-3)
    weights = read.trust[0] * read.weights
    per_frame = (found.differences * weights).sum(axis=1) / weights.sum(axis=1)
    assert per_frame.mean() == pytest.approx(found.cost, rel=2e-3)
    assert found.lines == tuple(line.name for line in read.lines)


def test_a_cycle_may_begin_anywhere_and_rates_are_tried():
    whole = np.roll(drawn(CLIP, 0, 24, 30, rate=12), 7, axis=0)
    assert best(whole, frame_rate=12).cost > 10
    found = best(whole, frame_rate=None, loops=True)
    assert found.drawing_rate == 12
    assert found.cost < 2
    assert found.times[7] < 5
    assert found.times[6] > 220


def test_holds_and_repeated_drawings_take_their_time():
    marks = drawn(CLIP, 40, 30, 60)[::3]
    held = best(marks, holds=[3] * 10)
    shown = best(np.repeat(marks, 3, axis=0))
    assert held.cost < 1
    assert shown.cost < 1
    assert held.times == pytest.approx(40 + 15 * np.arange(10), abs=2)
    assert shown.times == pytest.approx(np.repeat(held.times, 3), abs=2)


def test_one_drawing_is_a_pose():
    found = match_clips(drawn(CLIP, 100, 1, 200), MARKERS, [CLIP], top=3)
    assert found.movement == 0
    assert found.matches[0].start in range(97, 104)
    assert found.matches[0].stop == found.matches[0].start + 1
    assert found.matches[0].verdict == "fits"


def test_hidden_and_missing_marks_count_less():
    rng = np.random.default_rng(0)
    marks = drawn(CLIP, 40, 30, 60)
    hands = [MARKERS.index("left_hand"), MARKERS.index("left_elbow")]
    wrong = marks.copy()
    wrong[:, hands] += rng.normal(0, 30, (30, 2, 2))
    visible = np.ones((30, 16), bool)
    visible[:, hands] = False
    assert best(wrong, visible=visible).cost < 0.8 * best(wrong).cost
    wrong[:, hands] = np.nan
    found = best(wrong, visible=visible)
    assert found.cost < 1
    assert "left_forearm" not in found.lines
    assert found.start == pytest.approx(40, abs=2)


def test_nothing_fits_what_is_not_there():
    rng = np.random.default_rng(5)
    scribble = rng.normal(0, 50, (24, 16, 2))
    assert not match_clips(scribble, MARKERS, [CLIP], frame_rate=RATE).found
    assert not match_clips(drawn(CLIP, 20, 30, 30), MARKERS, [standstill()], frame_rate=RATE).found
    short = match_clips(drawn(CLIP, 0, 48, 30), MARKERS, [CLIP], frame_rate=6)
    assert (short.matches, short.found) == ((), False)
    assert short.skipped["dance.bvh"].startswith("too short: 2.0 s, the drawings last 7.8 s")


def test_several_segments_of_a_long_clip_are_apart():
    twice = Clip("twice.bvh", np.concatenate([CLIP.markers] * 3), 30.0, 120.0, 1, 721)
    found = match_clips(drawn(CLIP, 60, 24, 45), MARKERS, [twice, standstill()], frame_rate=RATE, top=5)
    fits = [match for match in found.matches if match.verdict == "fits"]
    assert sorted(match.start for match in fits) == pytest.approx([61, 301, 541], abs=3)
    assert {match.clip for match in fits} == {"twice.bvh"}


def test_the_result_does_not_depend_on_threads_or_order():
    marks = drawn(CLIP, 40, 30, 60)
    clips = [CLIP, standstill(), turned(CLIP, 90)]
    first = match_clips(marks, MARKERS, clips, frame_rate=RATE)
    again = match_clips(marks, MARKERS, clips, frame_rate=RATE)
    assert [m.cost for m in first.matches] == [m.cost for m in again.matches]
    assert all(np.array_equal(a.times, b.times) for a, b in zip(first.matches, again.matches, strict=True))
    other = match_clips(marks.astype(np.float32)[:, ::-1], MARKERS[::-1], clips, frame_rate=RATE)
    assert other.matches[0].start == first.matches[0].start


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("markers", {"markers": np.zeros((3, 15, 2))}),
        ("markers", {"markers": np.zeros((0, 16, 2))}),
        ("markers", {"markers": np.full((3, 16, 2), np.inf)}),
        ("names", {"names": [f"m{i}" for i in range(16)]}),
        ("visible", {"visible": np.ones((3, 15), bool)}),
        ("visible", {"visible": np.ones((3, 16))}),
        ("frame_rate", {"frame_rate": 0}),
        ("frame_rate", {"frame_rate": np.nan}),
        ("holds", {"holds": [1, 0, 1]}),
        ("holds", {"holds": [1, 1]}),
        ("top", {"top": 0}),
        ("speed", {"speed": 0.5}),
    ],
)
def test_wrong_input_is_named(name, change):
    given = {"markers": drawn(CLIP, 0, 3, 0), "names": MARKERS, "clips": [CLIP], **change}
    with pytest.raises(ValueError, match=f"^{name}: "):
        match_clips(given.pop("markers"), given.pop("names"), given.pop("clips"), **given)


def test_the_side_seen_is_told_in_words():
    for azimuth, side in ((0, "front"), (90, "left"), (180, "back"), (270, "right"), (45, "front left")):
        # The dance faces the front on the whole.
        assert best(drawn(CLIP, 0, 48, azimuth)).seen_from == side, azimuth
    assert OrthographicCamera.from_angles(90, 0).project([0, 0, 1.0])[0] < 0
