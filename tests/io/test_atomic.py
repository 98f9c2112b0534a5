import errno
import os
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import numpy as np
import pytest

from pegbar.io.animation import write_animation
from pegbar.io.annotations_writer import write_annotations
from pegbar.io.atomic import clean_leftovers, complete_file, write_bytes
from pegbar.io.bvh import write_bvh
from pegbar.io.exr import write_exr
from pegbar.io.frames import write_image
from pegbar.scene.drawing import Drawing
from pegbar.scene.motion import Motion

NOISE = np.random.default_rng(0).integers(0, 255, (200, 200, 4), dtype=np.uint8)
WRITERS = {
    "a.png": lambda path: write_image(path, NOISE),
    "a.tif": lambda path: write_image(path, NOISE),
    "a.jpg": lambda path: write_image(path, NOISE[..., :3]),
    "a.exr": lambda path: write_exr(path, {"": NOISE / np.float32(255), "Z": NOISE[..., 0] / np.float32(9)}),
    "b.png": lambda path: write_animation(path, [NOISE, NOISE[::-1]], 24),
    "a.json": lambda path: write_annotations(
        path, Drawing(("head",), np.zeros((5000, 1, 2)), np.ones((5000, 1), bool), (9, 9))
    ),
    "a.bvh": lambda path: write_bvh(
        path,
        Motion(("hips",), (-1,), np.zeros((3000, 1, 3)), np.broadcast_to(np.eye(3), (3000, 1, 3, 3)), 24),
    ),
}


@pytest.mark.parametrize("old", [None, b"old"])
@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit, OSError])
def test_a_block_that_fails_leaves_what_was_there(error, old, tmp_path):
    target = tmp_path / "final.0001.png"
    if old:
        target.write_bytes(old)

    def fail():
        with complete_file(target) as part:
            assert part.parent == tmp_path
            assert part.suffix == ".png"
            assert part.name.startswith(".")
            part.write_bytes(b"half")
            raise error

    with pytest.raises(error):
        fail()
    assert [file.read_bytes() for file in tmp_path.iterdir()] == ([old] if old else [])


def test_a_block_that_ends_well_replaces_the_file(tmp_path):
    target = tmp_path / f"{'ä' * 120}.png"
    write_bytes(target, b"old")
    with complete_file(target) as part:
        part.write_bytes(b"new")
        assert target.read_bytes() == b"old"
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [(target.name, b"new")]


def test_two_threads_may_write_one_file(tmp_path):
    threads = [threading.Thread(target=write_bytes, args=(tmp_path / "a", bytes([i]) * 10**5)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (file,) = tmp_path.iterdir()
    assert len(file.read_bytes()) == 10**5
    assert len(set(file.read_bytes())) == 1


@pytest.mark.parametrize("name", WRITERS)
def test_a_folder_that_cannot_be_written_is_named(name, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_bytes(b"")
    for folder, kind in (
        (tmp_path / "none", FileNotFoundError),
        (blocked, NotADirectoryError),
        (Path("/proc"), OSError),
    ):
        with pytest.raises(kind) as error:
            WRITERS[name](folder / name)
        assert error.value.filename == str(folder / name)
    assert list(tmp_path.iterdir()) == [blocked]


@pytest.mark.parametrize("name", WRITERS)
def test_a_folder_in_the_way_is_named(name, tmp_path):
    (tmp_path / name).mkdir()
    with pytest.raises(OSError, match=name) as error:
        WRITERS[name](tmp_path / name)
    assert error.value.filename == str(tmp_path / name)
    assert [file.name for file in tmp_path.iterdir()] == [name]


FULL = """
    import resource, signal, sys
    from pathlib import Path
    from tests.io.test_atomic import WRITERS

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
    for name, write in WRITERS.items():
        try:
            write(Path(sys.argv[1]) / name)
        except OSError as error:
            print(error.errno, error.filename)
        else:
            print("written", name)
"""


def test_a_full_disk_is_an_error_that_names_the_file(tmp_path):
    script = [sys.executable, "-c", textwrap.dedent(FULL), str(tmp_path)]
    root = Path(__file__).parents[2]
    run = subprocess.run(script, capture_output=True, text=True, check=True, cwd=root, timeout=60)
    assert run.stdout.splitlines() == [f"{errno.EFBIG} {tmp_path / name}" for name in WRITERS]
    assert run.stderr == ""
    assert list(tmp_path.iterdir()) == []


KILLED = """
    import os, sys
    from pegbar.io.atomic import complete_file

    with complete_file(sys.argv[1] + "/final.0001.png") as part:
        part.write_bytes(b"half")
        os.kill(os.getpid(), 9)
"""


def test_leftovers_of_killed_runs_are_removed_and_living_ones_kept(tmp_path):
    run = subprocess.run([sys.executable, "-c", textwrap.dedent(KILLED), str(tmp_path)], check=False, timeout=60)
    assert run.returncode == -9
    (left,) = tmp_path.iterdir()
    user = tmp_path / ".note.part.png"
    user.write_bytes(b"")
    elsewhere = tmp_path / ".final.1-0@another.part.png"
    elsewhere.write_bytes(b"")
    aged = tmp_path / ".final.1-1@another.part.png"
    aged.write_bytes(b"")
    os.utime(aged, (1, 1))
    host = left.name.partition("@")[2].partition(".")[0]
    parent = tmp_path / f".final.0003.{os.getppid()}-0@{host}.part.png"
    parent.write_bytes(b"")
    with complete_file(tmp_path / "final.0002.png") as part:
        part.write_bytes(b"whole")
        assert clean_leftovers(tmp_path) == sorted([left, aged])
    kept = {user, elsewhere, parent, tmp_path / "final.0002.png"}
    assert set(tmp_path.iterdir()) == kept
    # A process may be given the number of one that was killed: what it did not open itself is a leftover.
    own = tmp_path / f".final.0003.{os.getpid()}-99999@{host}.part.png"
    own.write_bytes(b"")
    assert clean_leftovers(tmp_path) == [own]
