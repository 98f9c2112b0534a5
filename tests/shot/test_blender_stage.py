"""`pegbar secondary --renderer blender` and `--engine blender`, with programs that pretend to be Blender."""

from __future__ import annotations

import os

import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.io.exr import read_passes
from pegbar.sample.shot import write_sample
from pegbar.shot.secondary import Secondary
from pegbar.shot.secondary_stage import SecondaryStage
from pegbar.simulate.chains import Bobs
from pegbar.simulate.elements import Balls, Strands
from pegbar.simulate.engine import assign
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.weather import Particles
from tests.blenders import fake_blender

pytestmark = pytest.mark.skipif(os.name == "nt", reason="the pretended programs are scripts")
OWN = '\n[secondary]\nelements = ["scarves", "skirt", "balls"]\n'
SECTION = (
    '\n[secondary]\nelements = [{ preset = "balls", count = 2 }]\npre_roll = 2\nsamples = 1\nblender = "fake-blender"\n'
)
RENDERS = """
import json, numpy as np
from pegbar.io.exr import write_exr
folder = arguments[-1]
job = json.load(open(folder + "/render.json"))
width, height = job["size"]
for done, frame in enumerate(job["frames"], 1):
    {spoil}
    depth = np.full((height, width), 0.5, np.float32)
    near = (depth < 1).astype(np.float32)
    color = np.stack([near, 0 * near, 0 * near, near], axis=-1)
    found = dict(zip(["Combined." + letter for letter in "RGBA"], np.moveaxis(color, 2, 0)))
    found |= {{"Depth.Z": depth, "Object Index.X": near}}
    write_exr(folder + "/" + frame["output"], {{"ViewLayer." + name: plane for name, plane in found.items()}})
    print("pegbar:progress:%d:%d" % (done, len(job["frames"])), flush=True)
print("pegbar:done")
"""


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """The sample shot, 4 small frames, with two balls."""
    path = write_sample(tmp_path_factory.mktemp("blender"), size=(160, 90), frames=4, samples=1)
    path.write_text(path.read_text().replace(OWN, "") + SECTION)
    return path


def test_what_blender_renders_is_composited_and_kept_frame_by_frame(shot, capsys):
    folder, command = shot.parent / "secondary", ["secondary", str(shot), "--jobs", "1", "--renderer", "blender"]
    # It dies at the third frame: the two before are whole, and taken up.
    fake_blender(shot.parent, RENDERS.format(spoil="if done == 3: print('boom', flush=True); os._exit(9)"))
    assert main(command) == 1
    assert "exit code 9; its last lines:\n  boom; what was made before is kept" in capsys.readouterr().err
    assert [path.name for path in sorted((folder / "blender").glob("*.exr"))] == [
        "elements.0001.exr",
        "elements.0002.exr",
    ]
    assert list((folder / "blender").glob(".pegbar-blender*")) == []
    first = (folder / "blender/elements.0001.exr").stat().st_mtime_ns
    fake_blender(shot.parent, RENDERS.format(spoil="pass"))
    assert main(command) == 0
    assert len(list((folder / "blender").glob("*.exr"))) == 4
    assert (folder / "blender/elements.0001.exr").stat().st_mtime_ns == first
    depth = read_passes(folder / "passes/passes.0003.exr").depth
    assert np.unique(depth[np.isfinite(depth)]).tolist() == [0.5]
    # What is up to date needs no Blender that works.
    fake_blender(shot.parent, "sys.exit(3)")
    assert main(command) == 0


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        ("print('pegbar:progress:1:4', flush=True)", "there is no file"),
        ("open(folder + '/' + frame['output'], 'wb').write(b'rubbish'); print('pegbar:progress:1:4'); break", "EXR"),
        ("height //= 2", "want 160 x 90 pixels, got 160 x 45"),
        ("break", "did not render frame 1"),
    ],
)
def test_a_frame_that_is_not_what_it_should_be_is_refused(shot, capsys, spoil, problem):
    fake_blender(shot.parent, RENDERS.format(spoil=spoil))
    assert main(["secondary", str(shot), "--jobs", "1", "--renderer", "blender", "--overwrite"]) in (1, 2)
    assert problem in capsys.readouterr().err


def test_what_blender_lacks_is_simulated_by_our_engines(shot):
    fake_blender(shot.parent)
    elements = [
        Balls("balls", [[0, 1, 0]], [0.1]),
        Balls("thrown", [[0, 1, 0]], [0.1], velocities=[[1, 0, 0]]),
        Strands("balloon", [[0, 1, 0], [0, 2, 0]], [2], [0.01], bobs=Bobs([0.2])),
        Strands("bunch", [[0, 1, 0], [0, 2, 0], [1, 1, 0], [1, 2, 0]], [2, 2], [0.01, 0.01], bobs=Bobs([0.1, 0.3])),
        Strands("rope", [[0, 1, 0], [0, 2, 0]], [2], [0.01]),
        Particles("snow", (0, 0, 0), (1, 1, 1), 5),
        Particles("drops", (0, 0, 0), (1, 1, 1), 0),
    ]
    stage, scene = SecondaryStage(shot, engine="blender"), SimulationScene(24, 2, elements)
    shares = assign(scene, stage.engines)
    assert stage.own_work(scene) == ["Blender cannot simulate thrown, bunch, drops: pegbar's own engines do"]
    assert SecondaryStage(shot).own_work(scene) == []
    assert {engine.name: [element.name for element in share] for engine, share in shares} == {
        "blender": ["balls", "balloon", "rope", "snow"],
        "rapier": ["thrown"],
        "strands": ["bunch"],
        "particles": ["drops"],
    }


def test_another_run_that_has_blender_render_is_waited_for(shot, capsys):
    fake_blender(shot.parent, RENDERS.format(spoil="pass"))
    fcntl = pytest.importorskip("fcntl")
    lock = shot.parent / "secondary/blender/.pegbar/run.lock"
    lock.parent.mkdir(parents=True, exist_ok=True)
    with lock.open("w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert main(["secondary", str(shot), "--jobs", "1", "--renderer", "blender", "--overwrite"]) == 2
    assert "another pegbar is at work here" in capsys.readouterr().err
    assert main(["secondary", str(shot), "--jobs", "1", "--renderer", "blender", "--overwrite"]) == 0


def test_another_blender_simulates_anew(shot):
    recipes = set()
    for version in ("5.0.1", "4.5.3"):
        fake_blender(shot.parent, says=f"Blender {version}")
        recipes |= {Secondary(shot, engine=engine).recipe() for engine in ("pegbar", "blender")}
    assert len(recipes) == 3


def test_a_crash_while_simulating_is_told(shot, capsys):
    fake_blender(shot.parent, "os.kill(os.getpid(), signal.SIGSEGV)")
    assert main(["secondary", str(shot), "--jobs", "1", "--engine", "blender"]) == 1
    assert "crashed or was killed (signal 11, SIGSEGV)" in capsys.readouterr().err


def test_a_blender_that_is_not_there_is_told_before_any_work(shot, capsys):
    (shot.parent / "fake-blender").unlink()
    assert main(["secondary", str(shot), "--engine", "blender"]) == 2
    assert "fake-blender: no such Blender" in capsys.readouterr().err
    assert np.isfinite(read_passes(shot.parent / "passes/passes.0001.exr").depth).any()
