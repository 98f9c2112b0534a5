import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar.io.exposure import Exposure


@given(hold=st.integers(1, 9), first=st.integers(-5, 50), count=st.integers(1, 30), start=st.integers(-9, 99))
def test_a_hold_shows_every_drawing_equally_long(hold, first, count, start):
    exposure = Exposure.of(hold, range(first, first + count), first_frame=start)
    assert exposure.frames == range(start, start + hold * count)
    shown = [exposure.drawing(frame) for frame in exposure.frames]
    assert shown == [drawing for drawing in range(first, first + count) for _ in range(hold)]
    for outside in (start - 1, start + hold * count):
        with pytest.raises(ValueError, match=f"^frame {outside}: "):
            exposure.drawing(outside)


def test_on_ones_frame_and_drawing_have_one_number():
    assert [Exposure.of(1, [3, 4, 5]).drawing(frame) for frame in (3, 4, 5)] == [3, 4, 5]


def test_a_missing_drawing_does_not_shift_the_others():
    exposure = Exposure.of(2, [1, 2, 4])
    assert [exposure.drawing(frame) for frame in exposure.frames] == [1, 1, 2, 2, 3, 3, 4, 4]


@given(st.sets(st.integers(0, 60), min_size=1), st.integers(0, 99))
def test_sparse_drawings_are_held_until_the_next(drawings, frame):
    exposure = Exposure.of("sparse", drawings)
    before = [number for number in drawings if number <= frame]
    if before:
        assert exposure.drawing(frame) == max(before)
    else:
        with pytest.raises(ValueError, match=f"^frame {frame}: "):
            exposure.drawing(frame)
    assert exposure.frames == range(min(drawings), max(drawings) + 1)


def test_sparse_drawings_may_begin_elsewhere():
    assert Exposure.of("sparse", [10, 14], first_frame=1).drawing(5) == 14


def test_an_exposure_sheet_says_it_frame_by_frame():
    exposure = Exposure.of([1, 1, 2, 2, 5], [], first_frame=10)
    assert [exposure.drawing(frame) for frame in exposure.frames] == [1, 1, 2, 2, 5]
    assert exposure.frames == range(10, 15)
    assert Exposure.of([4], []).frames == range(1, 2)


@pytest.mark.parametrize(("spec", "name"), [(0, "hold"), (-1, "hold"), ("twos", "hold"), ([], "hold")])
def test_other_specifications_are_refused(spec, name):
    with pytest.raises(ValueError, match=f"^{name}: "):
        Exposure.of(spec, [1, 2])


@pytest.mark.parametrize("spec", [2, "sparse"])
def test_no_drawings_are_refused(spec):
    with pytest.raises(ValueError, match="^drawings: "):
        Exposure.of(spec, [])
