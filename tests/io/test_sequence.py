from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pegbar import FormatError, MissingFrameError
from pegbar.io.numbers import MAX_FRAMES, format_frames, parse_frames
from pegbar.io.sequence import FrameSequence, find_sequences


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "shot #1 %04d ähm @@"
    place.mkdir()
    return place


def touch(folder, *names):
    for name in names:
        (folder / name).touch()


@pytest.mark.parametrize(
    ("pattern", "numbers", "fifth", "missing"),
    [
        ("d.####.png", (1, 2, 5, 12345), "d.0005.png", []),
        ("d.%04d.png", (1, 2, 5, 12345), "d.0005.png", []),
        ("d.@@@@.png", (1, 2, 5, 12345), "d.0005.png", []),
        ("d.#.png", (1, 2, 5, 12345), "d.0005.png", []),
        ("d.%d.png", (12345,), "d.5.png", []),
        ("d.##.png", (12345,), "d.05.png", []),
        ("d.1-5#.png", (1, 2, 3, 4, 5), "d.0005.png", [3, 4]),
        ("d.1-6x2####.png", (1, 3, 5), "d.0005.png", [3]),
        ("d.5,1-2%04d.png", (1, 2, 5), "d.0005.png", []),
        ("d.7####.png", (7,), "d.0005.png", [7]),
        ("", (1, 2, 5, 12345), "d.0005.png", []),
        ("d.0002.png", (2,), "d.0005.png", []),
    ],
)
def test_every_notation(pattern, numbers, fifth, missing, folder):
    touch(folder, "d.0001.png", "d.0002.png", "d.0005.png", "d.12345.png", "d.png", "other.txt", ".d.0003.png")
    (folder / "d.0009.png").mkdir()
    sequence = FrameSequence.parse(folder / pattern)
    assert sequence.numbers == numbers
    assert sequence.path(5) == folder / fifth
    assert sequence.missing() == missing


def test_a_lone_sign_takes_what_is_there(folder):
    touch(folder, "walk0.png", "walk7.png", "walk10.png")
    sequence = FrameSequence.parse(folder / "walk#.png")
    assert sequence.numbers == (0, 7, 10)
    assert [sequence.path(n).name for n in (0, 10, 11)] == ["walk0.png", "walk10.png", "walk11.png"]
    assert FrameSequence.parse(sequence.pattern) == sequence
    # Nothing is there yet: four digits, as most programs understand it.
    assert FrameSequence.parse(folder / "final.#.png").path(7).name == "final.0007.png"


def test_a_range_needs_a_place_where_it_is_no_part_of_a_word(folder):
    assert FrameSequence.parse(folder / "walk2####.png").prefix == "walk2"
    assert FrameSequence.parse(folder / "walk1-3####.png").numbers == (1, 2, 3)
    sequence = FrameSequence.parse(folder / "shot-02-1-3####.png")
    assert (sequence.prefix, sequence.numbers) == ("shot-02-", (1, 2, 3))
    assert FrameSequence.parse(folder / "a##.b_####.exr").prefix == "a##.b_"


def test_negative_numbers(folder):
    touch(folder, "d.-002.png", "d.0000.png", "e-005.png")
    assert FrameSequence.parse(folder / "d.#.png").numbers == (-2, 0)
    sequence = FrameSequence.parse(folder / "d.###.png")
    assert sequence.numbers == (-2,)
    assert sequence.path(-2).name == "d.-002.png"
    assert FrameSequence.parse(folder / "e-###.png").numbers == (5,)


def test_a_single_picture_is_frame_one(folder):
    touch(folder, "plate.png")
    sequence = FrameSequence.parse(folder / "plate.png")
    assert sequence.numbers == (1,)
    assert sequence.path(1) == folder / "plate.png"
    sequence.require()


def test_missing_frames_are_named_as_runs(folder):
    touch(folder, "d.0001.png", "d.0010.png")
    sequence = FrameSequence.parse(folder / "d.1-10####.png")
    with pytest.raises(MissingFrameError, match=r"d\.####\.png: missing 2-9$") as error:
        sequence.require()
    assert "\n" not in str(error.value)
    assert isinstance(error.value, FileNotFoundError)
    sequence.require([1, 10])
    with pytest.raises(MissingFrameError, match="missing 7, 12-15"):
        sequence.require([1, 7, 12, 13, 14, 15])
    # What comes to the disk later is seen, what goes is missed.
    touch(folder, "d.0002.png")
    (folder / "d.0001.png").unlink()
    assert sequence.missing([1, 2]) == [1]
    with pytest.raises(MissingFrameError, match="no frames"):
        FrameSequence.parse(folder / "none.####.png").require()


def test_a_folder_of_several_sequences_lists_them(folder, test_data):
    touch(folder, "a.0001.png", "a.0002.png", "b.0001.exr")
    with pytest.raises(FormatError, match=r"several sequences, name one: a\.####\.png 1-2, b\.####\.exr 1$"):
        FrameSequence.parse(folder)
    with pytest.raises(FormatError, match=r"malePerson_climb#\.png 0-1, malePerson_walk#\.png 0-7"):
        FrameSequence.parse(test_data / "drawings" / "kenney" / "male_person")
    assert len(FrameSequence.parse(test_data / "annotated" / "morevna_side_walk" / "frames").numbers) == 48


def test_a_long_list_of_sequences_is_cut(folder):
    touch(folder, *(f"{letter}.1.png" for letter in "abcdefghij"))
    with pytest.raises(FormatError, match=r"name one: a\.#\.png 1, .*, h\.#\.png 1 and 2 more$"):
        FrameSequence.parse(folder)
    (folder / "i.1.png").unlink()
    (folder / "j.1.png").unlink()
    with pytest.raises(FormatError, match=r"h\.#\.png 1$"):
        FrameSequence.parse(folder)


def test_a_folder_without_pictures_and_a_name_without_numbers(folder):
    touch(folder, "a.0001.txt", "cover.png")
    with pytest.raises(FormatError, match="no numbered pictures"):
        FrameSequence.parse(folder)
    with pytest.raises(FileNotFoundError, match=r"cover\.tif"):
        FrameSequence.parse(folder / "cover.tif")


def test_a_frame_that_stands_there_twice_is_refused(folder):
    touch(folder, "d1.png", "d01.png")
    for pattern in ("", "d#.png"):
        with pytest.raises(FormatError, match=r"frame 1 stands there twice: d01\.png and d1\.png"):
            FrameSequence.parse(folder / pattern)
    assert FrameSequence.parse(folder / "d##.png").numbers == (1,)


def test_finds_the_sequences_below_a_folder(folder):
    (folder / "frames").mkdir()
    (folder / ".hidden").mkdir()
    touch(folder, "cover.png", "b.1.png", "frames/001.png", "frames/002.png", ".hidden/001.png")
    assert [Path(s.pattern).relative_to(folder).as_posix() for s in find_sequences(folder)] == [
        "b.#.png",
        "frames/###.png",
    ]


def test_an_absurd_range_is_refused(folder):
    for pattern in ("d.1-99999999####.png", "d.1-1000001#.png"):
        with pytest.raises(ValueError, match="more than 1000000"):
            FrameSequence.parse(folder / pattern)
    assert len(parse_frames(f"1-{MAX_FRAMES}")) == MAX_FRAMES


numbers = st.lists(st.integers(-300, 300), min_size=1, unique=True).map(sorted)


@given(numbers)
def test_formatted_frames_are_read_back(frames):
    text = format_frames(frames)
    assert sorted(parse_frames(text)) == frames
    assert len(text.split(",")) <= len(frames)


@pytest.mark.parametrize(
    ("frames", "text"),
    [
        ([7, 12, 13, 14, 15], "7, 12-15"),
        ([1, 2], "1-2"),
        ([1, 3], "1, 3"),
        ([1, 3, 5], "1-5x2"),
        ([1, 3, 4, 5], "1, 3-5"),
        ([5, 5, 1], "1, 5"),
        ([], ""),
    ],
)
def test_runs_are_short(frames, text):
    assert format_frames(frames) == text


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("1-4", [1, 2, 3, 4]),
        ("1-3,20", [1, 2, 3, 20]),
        ("1-8x3", [1, 4, 7]),
        ("-2--1, 5,5", [-2, -1, 5]),
        ("9,1", [9, 1]),
    ],
)
def test_frames_as_people_write_them(text, frames):
    assert parse_frames(text) == frames


@given(st.text(max_size=12))
def test_other_words_are_refused(text):
    assume(not all(letter in "0123456789-x, " for letter in text))
    try:
        assert parse_frames(text)
    except ValueError as error:
        assert "frames: " in str(error)  # noqa: PT017


@pytest.mark.parametrize("text", ["", "1-", "1,,2", "4-1", "1-5x0", "a", "1-5x", "1.5", "1-2-3"])
def test_wrong_ranges_are_refused(text):
    with pytest.raises(ValueError, match="^frames: "):
        parse_frames(text)
