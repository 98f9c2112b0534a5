import math
import shutil

import numpy as np
import pytest

from pegbar import FormatError
from pegbar.io.acclaim import read_acclaim
from pegbar.io.bvh_reader import read_bvh
from pegbar.io.c3d import read_c3d
from tests.oracles.kinematics import acclaim_turn

ASF = """# a comment
:version 1.10
:name VICON
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
  begin is a word
  end is another
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name thigh # the upper one
    direction 0 -1 0
    length 2
    axis 10 20 30 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-inf inf)
  end
  begin
    name shin
    direction 0 -1 0
    length 3
    axis 0 0 20 XYZ
    dof rx
  end
  begin
    name still
    direction 1 0 0
    length 1.5
    axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root thigh still
    thigh shin
  end
"""
AMC = """#!OML:ASF somewhere
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 10 20 30
thigh 40 50 60
shin 70
2
root 4 5 6 0 0 0
thigh 0 0 0
shin 0
"""


def files(tmp_path, asf=ASF, amc=AMC):
    (tmp_path / "01.asf").write_bytes(asf.encode())
    (tmp_path / "01_01.amc").write_bytes(amc.encode())
    return tmp_path / "01_01.amc"


def refused(path, **named):
    with pytest.raises(FormatError) as caught:
        read_acclaim(path, **named)
    return caught.value


def test_a_small_clip_is_as_its_equation_says(tmp_path):
    clip = read_acclaim(files(tmp_path))
    assert clip.names == ("root", "thigh", "shin", "shin_end", "still", "still_end")
    assert clip.parents == (-1, 0, 1, 2, 0, 4)
    assert clip.offsets.tolist() == [[0, 0, 0], [0, 0, 0], [0, -2, 0], [0, -3, 0], [0, 0, 0], [1.5, 0, 0]]
    root = acclaim_turn([0, 0, 0], "rx ry rz", [10, 20, 30])
    thigh = root @ acclaim_turn([10, 20, 30], "rx ry rz", [40, 50, 60])
    shin = thigh @ acclaim_turn([0, 0, 20], "rx", [70])
    np.testing.assert_allclose(clip.rotations[0, :4], [root, thigh, shin, shin], atol=1e-14)
    places = np.array([[1, 2, 3], [1, 2, 3], [1, 2, 3] + thigh @ [0, -2, 0]])
    np.testing.assert_allclose(clip.positions[0, :3], places, atol=1e-14)
    np.testing.assert_allclose(clip.positions[0, 3], places[2] + shin @ [0, -3, 0], atol=1e-14)
    np.testing.assert_allclose(clip.positions[0, 5], places[0] + root @ [1.5, 0, 0], atol=1e-14)
    np.testing.assert_allclose(clip.positions[1, 3], [4, 0, 6], atol=1e-14)
    assert clip.unit == pytest.approx(0.0254 / 0.45)
    assert (clip.frame_rate, clip.up, clip.notes) == (None, None, ())


@pytest.mark.parametrize(
    ("asf", "amc"),
    [
        (lambda text: text.replace("\n", "\r\n"), lambda text: text.replace("\n", "\r\n")),
        (lambda text: text, lambda text: text.rstrip()),
        (lambda text: text, lambda text: text.replace("\n1\n", "\n# first\n1 # one\n\n")),
        (lambda text: text, lambda text: text.replace("thigh 40 50 60\nshin 70", "SHIN 70\nthigh 40 50 60\nstill")),
        (lambda text: text.replace("rx ry rz", "RX, RY, RZ"), lambda text: text),
        (lambda text: text.replace(" 10 20 30 XYZ", " (10, 20, 30) XYZ"), lambda text: text),
        (lambda text: text.replace("order TX TY TZ RX RY RZ", ""), lambda text: text),
        (
            lambda text: text.replace("order TX TY TZ RX RY RZ", "order RX TZ RY TX TY RZ"),
            lambda text: text.replace("1 2 3 10 20 30", "10 3 20 1 2 30").replace("4 5 6 0 0 0", "0 6 0 4 5 0"),
        ),
        (
            lambda text: text.replace("position 0 0 0", "position -1 0 1"),
            lambda text: text.replace("root 1 2 3", "root 2 2 2").replace("4 5 6", "5 5 5"),
        ),
    ],
)
def test_the_same_clip_written_otherwise_is_the_same(tmp_path, asf, amc):
    plain = read_acclaim(files(tmp_path))
    other = read_acclaim(files(tmp_path, asf(ASF), amc(AMC)))
    assert other.names == plain.names
    np.testing.assert_allclose(other.positions, plain.positions, atol=1e-14)


def test_angles_may_be_radians_in_each_file(tmp_path):
    plain = read_acclaim(files(tmp_path))
    asf = ASF.replace("angle deg", "angle rad").replace(
        "10 20 30 XYZ", f"{math.pi / 18} {math.pi / 9} {math.pi / 6} XYZ"
    )
    asf = asf.replace("0 0 20 XYZ", f"0 0 {math.pi / 9} XYZ")
    other = read_acclaim(files(tmp_path, asf))
    np.testing.assert_allclose(other.positions, plain.positions, atol=1e-13)
    lines = []
    for line in AMC.replace(":DEGREES\n", "").splitlines():
        name, *words = line.split() if "#" not in line else ("#",)
        places = 3 if name == "root" else 0
        turns = [repr(math.radians(float(word))) for word in words[places:]]
        lines.append(" ".join([name, *words[:places], *turns]) if words and ":" not in line else line)
    other = read_acclaim(files(tmp_path, asf, "\n".join([*lines, ""])))
    np.testing.assert_allclose(other.positions, plain.positions, atol=1e-13)
    other = read_acclaim(files(tmp_path, ASF, "\n".join([*lines, ""]).replace("FIED", "FIED\n:radians")))
    np.testing.assert_allclose(other.positions, plain.positions, atol=1e-13)


@pytest.mark.parametrize(
    ("order", "dof", "values"), [("XYZ", "rz rx", [20, 30]), ("ZYX", "ry", [50]), ("YZX", "rx rz", [5, 6])]
)
def test_dof_and_axis_orders(tmp_path, order, dof, values):
    asf = ASF.replace("10 20 30 XYZ", f"10 20 30 {order}").replace("dof rx ry rz", f"dof {dof}")
    amc = AMC.replace("40 50 60", " ".join(map(str, values))).replace("thigh 0 0 0", "thigh" + " 0" * len(values))
    clip = read_acclaim(files(tmp_path, asf, amc.replace("10 20 30", "0 0 0")))
    angles = dict(zip("XYZ", [10, 20, 30], strict=True))
    rest = np.eye(3)
    for letter in order:
        rest = acclaim_turn([0, 0, 0], f"r{letter.lower()}", [angles[letter]]) @ rest
    wanted = rest @ acclaim_turn([0, 0, 0], dof, values) @ rest.T
    np.testing.assert_allclose(clip.rotations[0, 1], wanted, atol=1e-14)


def test_a_preset_orientation_turns_the_skeleton_before_its_motion(tmp_path):
    clip = read_acclaim(files(tmp_path, ASF.replace("orientation 0 0 0", "orientation 10 90 20")))
    turn = acclaim_turn([0, 0, 0], "rx ry rz", [10, 20, 30]) @ acclaim_turn([0, 0, 0], "rx ry rz", [10, 90, 20])
    np.testing.assert_allclose(clip.rotations[0, 0], turn, atol=1e-14)
    np.testing.assert_allclose(clip.positions[0, 0], [1, 2, 3])


def test_unit_rate_and_frame_numbers(tmp_path):
    asf, amc = ASF.replace("length 0.45", "length 1.0"), AMC.replace(":DEGREES", ":DEGREES\n:SAMPLES-PER-SECOND 60")
    clip = read_acclaim(files(tmp_path, asf, amc.replace("\n1\n", "\n7\n").replace("\n2\n", "\n10\n")))
    assert (clip.unit, clip.frame_rate) == (None, 60)
    assert clip.notes == ("its frames are numbered from 7 in steps of 3",)


def test_the_skeleton_is_found_or_the_candidates_are_named(tmp_path):
    motion = files(tmp_path)
    skeleton = tmp_path / "01.asf"
    for name in ("01_01.ASF", "01.asf", "01-walk.asf"):
        skeleton = skeleton.rename(tmp_path / name)
        (tmp_path / "011.asf").write_text("broken")
        assert len(read_acclaim(motion).names) == 6
        (tmp_path / "011.asf").unlink()
    skeleton = skeleton.rename(tmp_path / "other.asf")
    assert "other.asf" in read_acclaim(motion).notes[0]
    shutil.copy(skeleton, tmp_path / "another.asf")
    assert "another.asf, other.asf" in refused(motion).problem
    assert len(read_acclaim(motion, skeleton).names) == 6
    for path in tmp_path.glob("*.asf"):
        path.unlink()
    assert "no .asf" in refused(motion).problem
    with pytest.raises(FileNotFoundError):
        read_acclaim(motion, skeleton)


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        (":bonedata", ":bonedato", 1, "bonedata"),
        (":root", "root", 1, "root"),
        ("# a comment", "words", 1, "keyword"),
        ("angle deg", "angle grad", 7, "deg or rad"),
        ("length 0.45", "length 0", 6, "above 0"),
        ("length 0.45", "length nan", 6, "number"),
        ("order TX TY", "order TX TX", 12, "order"),
        ("orientation 0 0 0", "orientation 0 0", 15, "3 numbers"),
        ("direction 0 -1 0\n    length 2", "length 2", 17, "direction"),
        ("direction 0 -1 0", "direction 0 inf 0", 20, "number"),
        ("name shin", "name thigh", 28, "second bone"),
        ("name shin", "", 28, "name"),
        ("length 3", "length 3\n length 3", 32, "second"),
        ("20 30 XYZ", "20 30 XXZ", 22, "order of axes"),
        ("dof rx ry rz", "dof rx rx", 23, "dof"),
        ("dof rx ry rz", "dof rx l", 23, "dof"),
        ("  end\n:hierarchy", ":hierarchy", 39, "ends inside"),
        ("thigh shin", "thigh shinn", 44, "shinn"),
        ("    thigh shin\n", "", 28, "shin"),
        ("thigh shin", "thigh shin still", 44, "two parents"),
        ("thigh shin", "thigh shin root", 44, "two parents"),
        ("thigh shin\n  end", "thigh shin", 44, "cut short"),
    ],
)
def test_a_fault_of_the_skeleton_is_told_with_its_line(tmp_path, old, new, line, said):
    assert old in ASF
    error = refused(files(tmp_path, ASF.replace(old, new, 1)))
    assert said in error.problem
    assert (error.path, error.line) == (str(tmp_path / "01.asf"), line)


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("thigh 40 50 60\n", "", 7, "frame 1 lacks the bone 'thigh'"),
        ("shin 0\n", "", 10, "frame 2 lacks the bone 'shin'"),
        ("thigh 40 50 60", "thigh 40 50", 6, "has 2 numbers"),
        ("thigh 40 50 60", "thigh 40 50 60 70", 6, "has 4 numbers"),
        ("thigh 40 50 60", "thigh 40 50 nan", 6, "number"),
        ("thigh 40 50 60", "thigh 40 50 1e400", 6, "number"),
        ("thigh 40 50 60", "arm 40 50 60", 6, "no bone 'arm'"),
        ("shin 70", "shin 70\nshin 70", 8, "twice"),
        ("\n2\n", "\n1\n", 8, "follows"),
        ("\n2\n", "\n0\n", 8, "follows"),
        ("\n2\n", "\n99999999999999999999999\n", 8, "too large"),
        ("\n1\n", "\n", 4, "first frame"),
        ("shin 0\n", "shin 0\n:DEGREES\n", 12, "no bone"),
    ],
)
def test_a_fault_of_the_motion_is_told_with_its_line(tmp_path, old, new, line, said):
    assert old in AMC
    error = refused(files(tmp_path, amc=AMC.replace(old, new, 1)))
    assert said in error.problem
    assert (error.path, error.line) == (str(tmp_path / "01_01.amc"), line)


def test_bones_that_never_move_reserve_no_memory(tmp_path):
    count, frames = 3000, 3000
    bones = "".join(f"begin\nname b{i}\ndirection 1 0 0\nlength 1\nend\n" for i in range(count))
    asf = f":root\norder TX\n:bonedata\n{bones}:hierarchy\nbegin\nroot {' '.join(f'b{i}' for i in range(count))}\nend\n"
    amc = "".join(f"{frame}\nroot 0\n" for frame in range(1, frames + 1))
    assert "never move" in refused(files(tmp_path, asf, amc)).problem


def place(clip, *names):
    return np.mean([clip.positions[:, clip.names.index(name)] for name in names], axis=0)


def test_amc_frame_i_is_bvh_frame_i_plus_1(test_data):
    amc = read_acclaim(test_data / "mocap" / "asfamc" / "02_01.amc")
    bvh = read_bvh(test_data / "mocap" / "bvh" / "cmu_02_01.bvh")
    assert len(amc.positions) + 1 == len(bvh.positions) == 344
    pairs = {"root": "Hips", "ltibia": "LeftLeg", "rtibia": "RightLeg", "lfoot": "LeftFoot", "rfoot": "RightFoot"}
    for bone, joint in (pairs | {"lfemur": "LeftUpLeg", "rtoes": "RightToeBase"}).items():
        np.testing.assert_allclose(place(amc, bone), place(bvh, joint)[1:], atol=1e-4)


def test_the_root_follows_the_markers_of_the_waist(test_data):
    amc = read_acclaim(test_data / "mocap" / "asfamc" / "05_13.amc")
    c3d = read_c3d(test_data / "mocap" / "c3d" / "cmu_05_13.c3d")
    waist = place(c3d, "LFWT", "RFWT", "LBWT", "RBWT")[:, [1, 2, 0]] * c3d.unit
    assert np.linalg.norm(place(amc, "root") * amc.unit - waist, axis=1).mean() < 0.0135
