"""A shot goes to Blender and comes back: exported, rendered, imported, composited, compared with our own depth."""

import json

import numpy as np
import pytest

from pegbar import Mesh
from pegbar.cli.main import main
from pegbar.export.limbs import limb_meshes
from pegbar.io.exr import read_exr, read_passes
from pegbar.io.frames import read_picture
from pegbar.sample.shot import write_sample
from pegbar.shot.shot_scene import Tracked, shot_scene
from pegbar.simulate.blender.locate import find_blender
from pegbar.simulate.blender.process import run_blender
from pegbar.simulate.passes import render_passes

# Opens the shot as a user would, adds a mesh that is given, and renders.
SCRIPT = """
import json, runpy, sys
import bpy
opener, mesh, passes, frames, off = sys.argv[1:6]
sys.argv = [opener, "--passes", passes, "--samples", "4"]
runpy.run_path(opener, run_name="__main__")
given = json.load(open(mesh))
data = bpy.data.meshes.new("ring")
data.from_pydata([(x, -z, y) for x, y, z in given["vertices"]], [], given["triangles"])
bpy.context.scene.collection.objects.link(bpy.data.objects.new("ring", data))
bpy.data.objects["pegbar camera"].data.shift_x += float(off)
bpy.data.objects["pegbar camera"].data.animation_data_clear()
first, last = map(int, frames.split("-"))
for frame in range(first, last + 1):
    bpy.context.scene.frame_start = bpy.context.scene.frame_end = frame
    bpy.ops.render.render(animation=True)
    print(f"pegbar:progress:{frame}:{last}", flush=True)
"""


@pytest.fixture(scope="module")
def blender():
    return find_blender()


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """The sample shot, 3 small frames, exported, with a ring about the dancer's waist in the script's format."""
    shot = write_sample(tmp_path_factory.mktemp("trip"), size=(320, 180), frames=3, samples=1)
    assert main(["export", str(shot), "--formats", "blender"]) == 0
    table = json.loads((shot.parent / "export/shot.json").read_text())
    mesh = ring(np.array(table["characters"][0]["markers"]["pelvis"][0]))
    entries = {"vertices": mesh.vertices.tolist(), "triangles": mesh.triangles.tolist()}
    (shot.parent / "ring.json").write_text(json.dumps(entries))
    (shot.parent / "script.py").write_text(SCRIPT)
    return shot, mesh


def ring(middle):
    """A torus about the vertical."""
    around, across = np.meshgrid(np.arange(48) * (2 * np.pi / 48), np.arange(12) * (2 * np.pi / 12), indexing="ij")
    wide = 0.45 + 0.05 * np.cos(across)
    places = np.stack([wide * np.cos(around), 0.05 * np.sin(across), wide * np.sin(around)], axis=-1) + middle
    a = np.arange(48 * 12).reshape(48, 12)
    b, c, d = np.roll(a, -1, 0), np.roll(a, -1, (0, 1)), np.roll(a, -1, 1)
    triangles = np.concatenate([np.stack(part, -1).reshape(-1, 3) for part in ((a, d, b), (b, d, c))])
    return Mesh(places.reshape(-1, 3), triangles, (0.8, 0.2, 0.1, 1))


def rendered(blender, shot, folder, frames="1-3", off=0.0):
    pattern = shot.parent / folder / "r.####.exr"
    arguments = [shot.parent / "export/open_in_blender.py", shot.parent / "ring.json", pattern, frames, off]
    run_blender(blender, shot.parent / "script.py", [str(argument) for argument in arguments])
    return str(pattern)


def test_the_round_trip(blender, sample, capsys):
    shot, mesh = sample
    pattern = rendered(blender, shot, "render")
    assert main(["import-passes", str(shot), pattern]) == 0
    said = capsys.readouterr().out
    assert "guess" not in said
    assert "limbs are where the shot's camera sees them" in said
    assert main(["composite", str(shot), "--jobs", "1"]) == 0
    scene, _ = shot_scene(Tracked(shot, False, shot.parent / "export"))
    for row in range(3):
        passes = read_passes(shot.parent / f"imported/passes.{row + 1:04d}.exr")
        limbs = read_exr(shot.parent / f"imported/passes.{row + 1:04d}.exr").channels["check.Depth.Z"]
        ours = render_passes([mesh], scene.cameras[row]).depth
        both = np.isfinite(ours) & (passes.beauty[..., 3] > 0.99)
        assert both.sum() > 0.85 * np.isfinite(ours).sum()
        apart = np.abs(passes.depth[both] / ours[both] - 1)
        assert np.median(apart) < 1e-4
        assert np.percentile(apart, 90) < 5e-3
        body = render_passes(limb_meshes(scene.characters, row), scene.cameras[row]).depth
        same = np.abs(limbs[np.isfinite(body)] / body[np.isfinite(body)] - 1)
        assert np.median(same) < 1e-4
        final = read_picture(shot.parent / f"final/final.{row + 1:04d}.png")
        drawing = read_picture(shot.parent / f"drawings/dancer.{row + 1:04d}.png")
        changed = np.abs(final.astype(int) - drawing.astype(int)).max(axis=2) > 8
        seen, drawn = np.isfinite(ours), drawing[..., 3] > 250
        # In front of her the ring covers the drawing, behind her the drawing covers the ring.
        near = ours < scene.cameras[row].depth(scene.characters[0].markers[row])[0]
        assert changed[seen & drawn & near].mean() > 0.6
        assert changed[seen & drawn & ~near].mean() < 0.2


def test_another_camera_is_refused(blender, sample, capsys):
    shot, _ = sample
    pattern = rendered(blender, shot, "off", "2-2", 0.02)
    assert main(["import-passes", str(shot), pattern, "--frames", "2"]) == 1
    assert "another camera" in capsys.readouterr().out
