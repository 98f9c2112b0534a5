import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pegbar import FormatError, Motion
from pegbar.io.bvh import write_bvh
from pegbar.io.bvh_reader import read_bvh
from tests.oracles.kinematics import bvh_places

SMALL = """HIERARCHY
ROOT Hips
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Chest
  {
    OFFSET 0 5 0
    CHANNELS 3 Yrotation Zrotation Xrotation
    End Site
    {
      OFFSET 0 2.5 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.04
0 90 0 10 20 30 40 50 60
1 91 -1 -10 -20 -30 -40 -50 -60
"""


def read(tmp_path, text, name="a.bvh"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_bvh(path)


def refused(tmp_path, text):
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text)
    assert str(tmp_path / "a.bvh") in str(caught.value)
    return caught.value


def flat(names, channels="3 Xrotation Yrotation Zrotation"):
    joints = "".join(f"JOINT {name} {{ OFFSET 1 0 0 CHANNELS {channels} }}\n" for name in names)
    count = 3 + len(names) * int(channels.split()[0])
    head = f"HIERARCHY\nROOT r {{ OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition\n{joints}}}\n"
    return f"{head}MOTION\nFrames: 1\nFrame Time: 0.1\n{' '.join(['1'] * count)}\n"


def deep(levels):
    head = "".join(
        f"{'JOINT' if level else 'ROOT'} j{level} {{ OFFSET 0 1 0 CHANNELS 1 Zrotation\n" for level in range(levels)
    )
    values = " ".join(["0.5"] * levels)
    return f"HIERARCHY\n{head}{'}' * levels}\nMOTION\nFrames: 2\nFrame Time: 0.1\n{values}\n{values}\n"


def test_a_small_file_says_what_it_says(tmp_path):
    clip = read(tmp_path, SMALL)
    names, positions, rotations = bvh_places(SMALL)
    assert list(clip.names) == names == ["Hips", "Chest"]
    assert clip.parents == (-1, 0)
    np.testing.assert_allclose(clip.positions, positions, atol=1e-12)
    np.testing.assert_allclose(clip.rotations, rotations, atol=1e-14)
    assert clip.frame_rate == 25
    assert clip.offsets.tolist() == [[1, 2, 3], [0, 5, 0]]
    assert (clip.end_parents, clip.end_offsets.tolist()) == ((1,), [[0, 2.5, 0]])
    assert (clip.unit, clip.up, clip.notes) == (None, None, ())


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("  ", "\t").replace(" ", "\t"),
        lambda text: text.rstrip(),
        lambda text: text + "\n \t\n\n",
        lambda text: text.replace("0.04", ".04"),
        lambda text: text.replace("0.04", "4e-2"),
        lambda text: text.replace("Frames: 2", "Frames:2").replace("Frame Time: ", "Frame Time:\t"),
        lambda text: text.replace("Frames: 2", "FRAMES : 2").replace("MOTION", "Motion"),
        lambda text: text.replace("rotation", "ROTATION").replace("position", "Position"),
        lambda text: text.replace("0 90 0 10 20", "0 90 0\n10\n20"),
        lambda text: text.replace("Hips\n{", "Hips {").replace("Site\n    {", "Site {"),
        lambda text: text.replace("End Site", "End Site Chest end"),
        lambda text: text.replace("\n    }\n  }\n}", "}}}"),
    ],
)
def test_the_same_file_written_otherwise_is_the_same(tmp_path, change):
    assert change(SMALL) != SMALL
    plain, other = read(tmp_path, SMALL), read(tmp_path, change(SMALL))
    assert other.names == plain.names
    assert other.positions.tobytes() == plain.positions.tobytes()
    assert other.frame_rate == plain.frame_rate


@pytest.mark.parametrize(
    ("name", "read_as"),
    [
        (b"Left Up Leg", "Left Up Leg"),
        (b"mixamorig:Hips", "mixamorig:Hips"),
        (b"a{b}c", "a{b}c"),
        (b"J-1.2_#", "J-1.2_#"),
        ("Hüfte 腰".encode(), "Hüfte 腰"),
        (b"H\xfcfte", "Hüfte"),
    ],
)
@pytest.mark.parametrize("brace", [b"\n{", b" {", b"\t {"])
def test_names_are_kept_as_they_stand(tmp_path, name, read_as, brace):
    text = SMALL.encode().replace(b"Chest\n  {", name + brace)
    assert read(tmp_path, text).names == ("Hips", read_as)


def test_names_that_stand_twice_get_a_number_and_a_note(tmp_path):
    clip = read(tmp_path, flat(["a", "b", "a", "a_2", "a"]))
    assert clip.names == ("r", "a", "b", "a_3", "a_2", "a_4")
    assert len(clip.notes) == 2
    assert "'a'" in clip.notes[0]


def test_position_channels_replace_the_offset_on_every_joint(tmp_path):
    text = SMALL.replace("CHANNELS 3 Yrotation Zrotation Xrotation", "CHANNELS 2 Yposition Zrotation")
    text = text.replace("10 20 30 40 50 60", "0 0 0 7 0").replace("-10 -20 -30 -40 -50 -60", "90 0 0 8 0")
    clip = read(tmp_path, text)
    np.testing.assert_allclose(clip.positions[:, 1] - clip.positions[:, 0], [[0, 7, 0], [-8, 0, 0]], atol=1e-12)


def test_all_roots_are_kept(tmp_path):
    head, _, _ = SMALL.partition("MOTION")
    text = head + head.replace("HIERARCHY\n", "").replace("Hips", "Other") + "MOTION\nFrames: 1\nFrame Time: 1\n"
    clip = read(tmp_path, text + " ".join(map(str, range(18))))
    assert clip.names == ("Hips", "Chest", "Other", "Chest_2")
    assert clip.parents == (-1, 0, -1, 2)
    assert clip.positions[0, 2].tolist() == [9, 10, 11]


def test_deep_and_flat_skeletons_are_read_and_written_again(tmp_path):
    for text, count in ((deep(500), 500), (deep(3000), 3000), (flat([f"j{i}" for i in range(2000)]), 2001)):
        clip = read(tmp_path, text)
        assert len(clip.names) == count
        motion = Motion(clip.names, clip.parents, clip.positions, clip.rotations, clip.frame_rate)
        write_bvh(tmp_path / "b.bvh", motion, unit="m")
        again = read_bvh(tmp_path / "b.bvh")
        assert again.names == clip.names
        np.testing.assert_allclose(again.positions, clip.positions, atol=2e-3)


def test_channels_may_come_in_any_order_and_number(tmp_path):
    @given(
        st.lists(st.sampled_from(["Xrotation", "Yrotation", "Zrotation"]), min_size=0, max_size=5),
        st.permutations("XYZ"),
    )
    def check(turns, places):
        kinds = [*turns, *(f"{axis}position" for axis in places[: len(turns) % 4])]
        text = SMALL.replace("3 Yrotation Zrotation Xrotation", f"{len(kinds)} {' '.join(kinds)}")
        row = " ".join(str(7.25 * value) for value in range(6 + len(kinds)))
        text = text.partition("0 90 0 ")[0].replace("Frames: 2", "Frames: 1") + row
        clip, (_, positions, rotations) = read(tmp_path, text), bvh_places(text)
        np.testing.assert_allclose(clip.positions, positions, atol=1e-12)
        np.testing.assert_allclose(clip.rotations, rotations, atol=1e-14)

    check()


def test_real_clips_are_as_the_oracle_reads_them(tmp_path, test_data):
    for name in ("cmu_35_17", "cmu_131_01_max", "ad_fair1_dab"):
        text = (test_data / "mocap" / "bvh" / f"{name}.bvh").read_text()
        head, _, rows = text.partition("Frames:")
        lines = rows.splitlines()
        text = "\n".join([f"{head}Frames: 8", lines[1], *lines[2::12][:8]])
        clip, (names, positions, _) = read(tmp_path, text), bvh_places(text)
        assert list(clip.names) == names
        np.testing.assert_allclose(clip.positions, positions, atol=1e-10)


def motions():
    """Motions of one skeleton, parents before children and each limb as one stretch, as the writer orders them."""

    @st.composite
    def build(draw):
        count, frames = draw(st.integers(1, 7)), draw(st.integers(1, 4))
        chance = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
        parents, path = [-1], [0]
        for joint in range(1, count):
            path = path[: draw(st.integers(1, len(path)))]
            parents.append(path[-1])
            path.append(joint)
        turns = Rotation.random(frames * count, random_state=chance.integers(2**31)).as_matrix()
        positions = chance.uniform(-2, 2, (frames, count, 3))
        rate = draw(st.sampled_from([12, 23.976, 24, 25, 29.97, 30, 60, 120]))
        names = tuple(f"j{index}" for index in range(count))
        return Motion(names, tuple(parents), positions, turns.reshape(frames, count, 3, 3), rate)

    return build()


def test_what_is_written_is_read_again(tmp_path):
    @given(motions())
    def check(motion):
        write_bvh(tmp_path / "a.bvh", motion, stretch=True)
        clip = read_bvh(tmp_path / "a.bvh")
        assert (clip.names, clip.parents) == (motion.names, motion.parents)
        assert clip.frame_rate == pytest.approx(motion.frame_rate, rel=1e-6)
        np.testing.assert_allclose(clip.positions / 100, motion.positions, atol=1e-6)
        np.testing.assert_allclose(clip.rotations, motion.rotations, atol=1e-6)

    check()


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("HIERARCHY", "HIERARCHIE", 1, "HIERARCHY"),
        ("HIERARCHY\n", "", 1, "HIERARCHY"),
        ("ROOT Hips\n", "ROOT\n", 2, "name"),
        ("Hips\n{", "Hips\n", 4, "{"),
        ("OFFSET 1 2 3", "OFFSET 1 2", 5, "number"),
        ("OFFSET 1 2 3", "OFFSET 1 nan 3", 4, "number"),
        ("OFFSET 1 2 3", "OFFSET 1 2 1e400", 4, "number"),
        ("OFFSET 1 2 3", "OFFSET 1,2,3", 4, "decimal point"),
        ("  OFFSET 1 2 3\n", "", 14, "OFFSET"),
        ("OFFSET 1 2 3", "OFFSET 1 2 3\n OFFSET 1 2 3", 5, "second"),
        ("CHANNELS 3", "CHANNELS 2", 9, "Xrotation"),
        ("CHANNELS 3", "CHANNELS 4", 10, "channel"),
        ("CHANNELS 3", "CHANNELS 3000000000", 10, "channel"),
        ("CHANNELS 3", "CHANNELS -3", 9, "whole number"),
        ("Yrotation Z", "Wrotation Z", 9, "channel"),
        ("Yposition", "Xposition", 5, "twice"),
        ("    }\n  }\n}", "    }\n}", 15, "MOTION"),
        ("    }\n  }\n}", "    }\n  }\n}\n}", 16, "ROOT or MOTION"),
        ("OFFSET 0 2.5 0", "OFFSET 0 2.5 0 JOINT x", 12, "JOINT"),
        ("Frames: 2", "Frames: 1", 20, "more numbers"),
        ("Frames: 2", "Frames: 3", 20, "18 numbers"),
        ("Frames: 2", "Frames: 0", 17, "no frames"),
        ("Frames: 2", "Frames: -2", 17, "whole number"),
        ("Frames: 2", "Frames: 2.5", 17, "whole number"),
        ("Frames: 2", "Frames: 1000000000", 17, "1000000000"),
        ("Frames: 2", f"Frames: {10**30}", 17, "whole number"),
        ("Frame Time: 0.04", "Frame Time: 0", 18, "frame time"),
        ("Frame Time: 0.04", "Frame Time: -0.04", 18, "frame time"),
        ("Frame Time: 0.04", "Frame Time: nan", 18, "number"),
        ("Frame Time: 0.04", "Frame Time: 1e-300", 18, "frame time"),
        ("Frame Time: 0.04\n", "", 18, "Frame"),
        ("1 91 -1", "1 inf -1", 20, "number"),
        ("1 91 -1", "1 0x5B -1", 20, "number"),
        ("1 91 -1", "1 91,5 -1", 20, "decimal point"),
        ("1 91 -1", "# 1 91 -1", 20, "number"),
    ],
)
def test_a_fault_is_told_with_its_line(tmp_path, old, new, line, said):
    assert old in SMALL
    error = refused(tmp_path, SMALL.replace(old, new, 1))
    assert said in error.problem
    assert error.line == line


def test_what_is_no_bvh_is_refused(tmp_path):
    for content in (
        b"",
        b" \n",
        b"\0" * 1000,
        bytes(range(256)) * 9,
        SMALL.encode("utf-16"),
        b"a text\n",
        b"HIERARCHY",
    ):
        assert refused(tmp_path, content).line == 1
    (tmp_path / "folder.bvh").mkdir()
    with pytest.raises(FormatError, match="folder"):
        read_bvh(tmp_path / "folder.bvh")
    with pytest.raises(FileNotFoundError, match="none.bvh"):
        read_bvh(tmp_path / "none.bvh")


def test_a_file_without_any_channel_or_with_joints_that_never_move_reserves_no_memory(tmp_path):
    still = flat([f"j{i}" for i in range(20000)], "0").replace("Frames: 1", "Frames: 300")
    text = still.removesuffix("1 1 1\n") + "1 1 1\n" * 300
    assert "announced" in refused(tmp_path, text).problem
    text = "HIERARCHY\nROOT a { OFFSET 0 0 0 }\nMOTION\nFrames: 1000000000\nFrame Time: 1\n"
    assert "channel" in refused(tmp_path, text).problem
