"""`pegbar import-passes` on the small sample shot: what it takes is what `pegbar composite` then composites."""

import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.io.exr import read_exr, write_exr
from pegbar.io.frames import read_picture
from pegbar.sample.shot import write_sample


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The sample shot with finished frames of its own passes."""
    shot = write_sample(tmp_path_factory.mktemp("import"), size=(240, 136), frames=3, samples=2)
    assert main(["composite", str(shot), "--jobs", "1"]) == 0
    return shot, [read_picture(shot.parent / f"final/final.{frame:04d}.png") for frame in (1, 2, 3)]


def test_straight_centimetres_composite_as_before(made, capsys):
    shot, finals = made
    for frame in (1, 2, 3):
        channels = read_exr(shot.parent / f"passes/passes.{frame:04d}.exr").channels
        alpha = channels["A"].astype(np.float32)
        spoiled = {name: channels[name] / np.maximum(alpha, 1e-6) for name in "RGB"}
        (shot.parent / "back").mkdir(exist_ok=True)
        write_exr(
            shot.parent / f"back/b.{frame + 1000}.exr",
            {**spoiled, "A": alpha, "Depth.V": channels["Z"] * 100},
            exact=True,
        )
    pattern = str(shot.parent / "back/b.####.exr")
    assert main(["import-passes", str(shot), pattern]) == 1
    said = capsys.readouterr()
    assert "numbered frames 1001-1003" in said.out
    assert "nothing is written" in said.err
    assert not (shot.parent / "imported").exists()
    options = ["--shift", "-1000", "--unit", "cm", "--alpha", "straight", "--depth", "planar"]
    before = shot.read_text()
    assert main(["import-passes", str(shot), pattern, *options, "--check"]) == 0
    assert shot.read_text() == before
    assert main(["import-passes", str(shot), pattern, *options]) == 0
    assert main(["composite", str(shot), "--jobs", "1", "--overwrite"]) == 0
    for frame, final in zip((1, 2, 3), finals, strict=True):
        again = read_picture(shot.parent / f"final/final.{frame:04d}.png")
        apart = np.abs(again.astype(int) - final.astype(int))
        assert np.percentile(apart, 99.9) <= 2
        assert (apart.max(axis=2) > 8).mean() < 1e-3


def test_the_table_has_a_line_for_everything(made, capsys):
    shot, _ = made
    assert main(["import-passes", str(shot), str(shot.parent / "passes/passes.####.exr"), "--check"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["what", "where", "found", "mended", "by"]
    assert [line.split()[1] for line in lines[1:]] == [
        *("frames", "size", "channels", "background", "depth", "unit", "camera", "alpha")
    ]
    begin = lines[0].index("found")
    assert all(line[begin - 1] == " " != line[begin] for line in lines)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ([], "want the passes"),
        (["--unit", "yard"], "--unit: want one of m, cm"),
        (["nowhere/p.####.exr"], "no frames"),
        (["--frames", "1-9"], "has no frame 4-9"),
        (["--layer", "sky"], "no beauty pass in layer 'sky'"),
    ],
)
def test_wrong_use_is_told(made, options, said, capsys):
    shot, _ = made
    passes = [] if not options or "nowhere" in options[0] else [str(shot.parent / "passes/passes.####.exr")]
    assert main(["import-passes", str(shot), *passes, *options]) == 2
    assert said in capsys.readouterr().err
