import dataclasses

import numpy as np
import pytest

from pegbar.errors import FormatError
from pegbar.io.frames import write_image
from pegbar.io.puppet import read_figure, read_puppet, write_figure, write_puppet
from pegbar.puppet.make import make_puppet, prepare_figure
from pegbar.shot import puppet as shot_puppet
from pegbar.shot.puppet import PuppetOptions, kept_puppet
from tests.figures import clip, figure
from tests.io.test_puppet_input import written

FLAT = PuppetOptions(completion="flat")


def same(first, second):
    for field in dataclasses.fields(first):
        a, b = getattr(first, field.name), getattr(second, field.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_array_equal(a, b, err_msg=field.name)
        elif field.name == "textures":
            assert all(np.array_equal(one, other) for one, other in zip(a, b, strict=True))
        else:
            assert a == b, field.name


def test_puppets_and_figures_come_back_from_their_files(tmp_path):
    puppet = make_puppet(figure(60), clip(), completion="flat", clip="wave")
    write_puppet(tmp_path / "p.npz", puppet)
    same(read_puppet(tmp_path / "p.npz"), puppet)
    source = figure(60)
    prepared = prepare_figure(source)
    write_figure(tmp_path / "f.npz", prepared)
    same(read_figure(tmp_path / "f.npz", source), prepared)
    with pytest.raises(FormatError, match="no puppet"):
        read_puppet(tmp_path / "f.npz")
    small = dataclasses.replace(source, image=source.image[:50])
    with pytest.raises(FormatError, match="is not of the picture picture"):
        read_figure(tmp_path / "f.npz", small)
    (tmp_path / "p.npz").write_bytes((tmp_path / "p.npz").read_bytes()[:500])
    with pytest.raises(FormatError, match="no puppet"):
        read_puppet(tmp_path / "p.npz")


def test_what_is_kept_is_taken_again_and_made_anew_when_something_changes(tmp_path, monkeypatch):
    picture, keep = written(tmp_path), tmp_path / "kept"
    made = []
    for name in ("prepare_figure", "build_puppet"):
        plain = getattr(shot_puppet, name)
        monkeypatch.setattr(
            shot_puppet, name, lambda *args, plain=plain, name=name, **more: made.append(name) or plain(*args, **more)
        )
    first = kept_puppet(picture, clip(), keep=keep, options=FLAT, clip="a")
    assert made == ["prepare_figure", "build_puppet"]
    again = kept_puppet(picture, clip(), keep=keep, options=FLAT, clip="a")
    same(again, first)
    assert len(made) == 2
    other = kept_puppet(picture, clip(sway=0.02, frames=5), keep=keep, options=FLAT, clip="b")
    assert (other.pose_frame, other.clip, len(made)) == (2, "b", 2)
    kept_puppet(picture, clip(), keep=keep, options=dataclasses.replace(FLAT, view="side"))
    assert made[2:] == ["build_puppet"]
    image = np.array(figure().image)
    image[..., 0] //= 2
    write_image(picture, image)
    changed = kept_puppet(picture, clip(), keep=keep, options=FLAT)
    assert made[3:] == ["prepare_figure", "build_puppet"]
    assert not np.array_equal(changed.textures[0], first.textures[0])


def test_a_broken_kept_file_is_made_anew(tmp_path):
    picture, keep = written(tmp_path), tmp_path / "kept"
    first = kept_puppet(picture, clip(), keep=keep, options=FLAT)
    for path in keep.glob("*.npz"):
        size = path.stat().st_size
        path.write_bytes(b"x" * size)
    again = kept_puppet(picture, clip(), keep=keep, options=FLAT)
    same(again, first)
    assert all(path.read_bytes()[:2] == b"PK" for path in keep.glob("*.npz"))


def test_nothing_is_kept_where_nothing_is_to_be(tmp_path):
    before = sorted(path.name for path in tmp_path.iterdir())
    picture = written(tmp_path)
    before = sorted(path.name for path in tmp_path.iterdir())
    kept_puppet(picture, clip(), options=FLAT)
    assert sorted(path.name for path in tmp_path.iterdir()) == before
