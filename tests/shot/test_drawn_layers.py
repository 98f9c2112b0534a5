"""Layers of a drawing for Nuke: names, and that they are the drawing."""

import cv2
import numpy as np
import pytest

from pegbar import ShotError
from pegbar.cli.main import main
from pegbar.io.exr import read_exr, read_passes, write_exr
from pegbar.io.frames import read_picture, write_image
from pegbar.layer.color import encode_srgb
from pegbar.shot.drawn_layers import matte_name
from pegbar.shot.plan import open_shot
from tests.shots import ARM, FAR, MIDDLE, NEAR, bar, draw, make_shot


def layered(folder, pattern="layers/n.####.exr", **keys):
    shot = make_shot(folder, 2)
    shot.write_text(shot.read_text() + f'layers = "{pattern}"\n')
    return shot


def test_colour_depth_and_mattes_are_the_drawing_s(tmp_path):
    shot = layered(tmp_path)
    assert main(["depth", str(shot), "--jobs", "1"]) == 0
    channels = read_exr(tmp_path / "layers/n.0002.exr").channels
    assert set(channels) == {*"RGBA", "depth.Z", "matte_body.A", "matte_arm.A"}
    passes = read_passes(tmp_path / "layers/n.0002.exr")
    own = read_passes(tmp_path / "depth/z.0002.exr", want=("depth",)).depth
    np.testing.assert_array_equal(passes.depth, own)
    assert set(np.unique(channels["depth.Z"])) == {np.float32(NEAR), np.float32(FAR), np.float32(1e10)}
    drawing = draw(2)[0]
    shown = encode_srgb(passes.beauty)
    opaque = drawing[..., 3] == 255
    np.testing.assert_allclose(shown[opaque] * 255, drawing[opaque], atol=0.6)
    np.testing.assert_allclose(passes.beauty[..., 3] * 255, drawing[..., 3], atol=0.2)
    body, arm = (channels[f"matte_{name}.A"].astype(np.float32) for name in ("body", "arm"))
    np.testing.assert_array_equal(body + arm, channels["A"].astype(np.float32))
    assert (passes.depth[body > 0] == FAR).all()
    assert (passes.depth[arm > 0] == NEAR).all()


def test_every_frame_has_every_matte(tmp_path):
    shot = layered(tmp_path)
    drawing, labels, _ = draw(2)
    arm = (labels == ARM).all(axis=2)
    near = np.asarray(cv2.dilate(arm.astype(np.uint8), np.ones((5, 5), np.uint8)), bool)
    write_image(tmp_path / "d.0002.png", np.where(near[..., None], 0, drawing).astype(np.uint8))
    write_image(tmp_path / "l.0002.png", np.where(arm[..., None], 0, labels).astype(np.uint8))
    assert main(["depth", str(shot), "--jobs", "1"]) == 0
    first, second = (read_exr(tmp_path / f"layers/n.{frame:04d}.exr").channels for frame in (1, 2))
    assert set(first) == set(second)
    assert first["matte_arm.A"].max() == 1
    assert second["matte_arm.A"].max() == 0


def test_names_are_what_nuke_allows():
    assert matte_name("left forearm (outer)") == "matte_left_forearm__outer_"
    assert matte_name("tête") == "matte_t_te"


def test_layers_are_exr_files(tmp_path):
    with pytest.raises(ShotError, match=r"output.layers: want a name that ends in .exr"):
        open_shot(layered(tmp_path, "layers/n.####.png"))


def test_layers_and_mattes_make_the_composite_elsewhere(tmp_path):
    shot = layered(tmp_path)
    soft = bar()
    soft[""][12] *= 0.5
    soft[""][11], soft["Z"][11] = 0, MIDDLE
    for frame in (1, 2):
        write_exr(tmp_path / f"p.{frame:04d}.exr", soft)
    text = shot.read_text().replace('"final/f.####.png"', '"final/f.####.exr"')
    shot.write_text(text + 'holdout = "mattes/h.####.png"\nvisible = "mattes/v.####.png"\n')
    assert main(["depth", str(shot), "--jobs", "1"]) == 0
    assert main(["composite", str(shot), "--jobs", "1"]) == 0
    drawing = read_passes(tmp_path / "layers/n.0002.exr").beauty
    alpha = drawing[..., 3:]
    straight = np.concatenate([drawing[..., :3] / np.maximum(alpha, 1e-6), np.ones_like(alpha)], axis=2)
    holdout, visible = (read_picture(tmp_path / f"mattes/{name}.0002.png")[..., :1] / 255 for name in "hv")
    final = read_passes(tmp_path / "final/f.0002.exr", want=("beauty",)).beauty
    np.testing.assert_allclose(soft[""] * (1 - holdout) + straight * visible, final, atol=0.004)
    assert ((visible > holdout + 0.4) & (alpha > 0.9)).sum() > 10
