import platform
import random
import re
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.io.film import write_film
from pegbar.io.hold import BusyError, hold
from pegbar.sample.shot import write_sample
from tests.cli.interruptions import contents, start, wait_for
from tests.cli.pipeline import kill_and_compare, write_shot
from tests.shots import make_shot

COUNT = 24


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A shot, and the bytes of its finished frames."""
    shot = make_shot(tmp_path_factory.mktemp("whole"), COUNT)
    assert main(["composite", str(shot), "--jobs", "2"]) == 0
    return shot, contents(shot.parent / "final")


@pytest.fixture
def shot(undisturbed, tmp_path):
    folder = tmp_path / "shot"
    shutil.copytree(undisturbed[0].parent, folder, ignore=shutil.ignore_patterns("final"))
    return folder / "shot.toml"


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_leaves_whole_frames_and_a_second_run_goes_on(shot, undisturbed, jobs):
    process = start(shot, "--jobs", jobs)
    wait_for(shot.parent / "final", 3, process)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=30)
    if process.returncode != 0:
        assert process.returncode == 130
        assert error.splitlines() == ["pegbar: interrupted; the finished frames are kept, run it again to go on"]
    before = contents(shot.parent / "final")
    assert before.items() <= undisturbed[1].items()
    assert main(["composite", str(shot), "--jobs", "1"]) == 0
    assert contents(shot.parent / "final") == undisturbed[1]


def test_kills_at_random_moments_leave_nothing_broken(shot, undisturbed):
    chance = random.Random(1)
    for done in sorted(chance.sample(range(1, COUNT - 2), 3)):
        process = start(shot, "--jobs", 2)
        wait_for(shot.parent / "final", done, process)
        process.kill()
        process.communicate(timeout=30)
        finals = {path.name: path.read_bytes() for path in (shot.parent / "final").glob("f.*.png")}
        assert finals.items() <= undisturbed[1].items()
    assert main(["composite", str(shot), "--jobs", "2"]) == 0
    assert contents(shot.parent / "final") == undisturbed[1]


def test_a_full_disk_is_one_line_and_leaves_nothing_half_written(shot, undisturbed):
    least = min(map(len, undisturbed[1].values()))
    process = start(shot, "--jobs", 1, limit=least - 1)
    out, error = process.communicate(timeout=60)
    assert process.returncode == 1
    assert len(error.splitlines()) == 1
    assert "frame 1: " in error
    assert "f.0001.png" in error
    assert "0 frames made" in out
    assert contents(shot.parent / "final") == {}


def test_two_runs_at_once_do_not_harm_each_other(shot, undisturbed):
    processes = [start(shot, "--jobs", 1) for _ in range(2)]
    for process in processes:
        process.communicate(timeout=120)
        assert process.returncode == 0
    assert contents(shot.parent / "final") == undisturbed[1]


def test_the_whole_batch_killed_and_run_again_gives_the_undisturbed_bytes(tmp_path):
    write_shot(tmp_path / "shot", 3, (128, 72), '["balls"]')
    assert kill_and_compare(tmp_path / "shot", 2, random.Random(), ["--jobs", "1"]) == []


@pytest.fixture
def holder():
    """Starts processes that hold a folder until they are killed."""
    processes = []

    def start_holder(folder):
        code = (
            "import sys, time; from pathlib import Path; from pegbar.io.hold import hold\n"
            "with hold(Path(sys.argv[1])):\n    print(flush=True); time.sleep(600)"
        )
        process = subprocess.Popen([sys.executable, "-c", code, folder], stdout=subprocess.PIPE)
        processes.append(process)
        process.stdout.readline()
        return process

    yield start_holder
    for process in processes:
        process.kill()
        process.communicate()


def test_a_second_run_in_a_folder_is_told_who_works_there_until_that_one_is_gone(tmp_path, holder):
    first = holder(tmp_path / "align")
    said = f"{tmp_path}/align: another pegbar is at work here .process {first.pid} on"
    with pytest.raises(BusyError, match=said), hold(tmp_path / "align"):
        raise AssertionError
    with hold(tmp_path / "lift"), hold(tmp_path / "lift"):
        pass
    first.kill()
    first.wait()
    with hold(tmp_path / "align"), pytest.raises(ZeroDivisionError), hold(tmp_path / "other"):
        raise ZeroDivisionError
    with hold(tmp_path / "other"):
        pass


def leftover(folder):
    """What a process that is gone left half written."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    folder.mkdir(exist_ok=True)
    left = folder / f".preview.{process.pid}-93@{re.sub('[^A-Za-z0-9-]', '', platform.node())[:24]}.part.gif"
    left.write_bytes(b"GIF")
    return left


def test_what_a_killed_run_left_is_cleared(tmp_path):
    left = leftover(tmp_path / "lift")
    with hold(tmp_path / "lift"):
        assert not left.exists()
    left = leftover(tmp_path / "films")
    write_film(tmp_path / "films/a.gif", np.zeros((2, 4, 4, 3), np.uint8), 12)
    assert [path.name for path in left.parent.iterdir()] == ["a.gif"]


def test_a_second_run_of_frames_says_so_and_goes_on(shot, undisturbed, holder, capsys):
    first = holder(shot.parent / "final")
    assert main(["composite", str(shot), "--jobs", "1"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert f"final: another pegbar is at work here (process {first.pid} on" in lines[0]
    assert lines[0].endswith("frames may be made twice")
    assert contents(shot.parent / "final") == undisturbed[1]


def test_a_second_export_or_import_says_so_and_stops(tmp_path, holder, capsys):
    shot = write_sample(tmp_path, size=(128, 72), frames=2, samples=1)
    passes = str(tmp_path / "passes/passes.####.exr")
    before = shot.read_text()
    for arguments, folder in ((["export", str(shot)], "export"), (["import-passes", str(shot), passes], "imported")):
        first = holder(tmp_path / folder)
        assert main(arguments) == 2
        assert f"{folder}: another pegbar is at work here (process {first.pid} on" in capsys.readouterr().err
        assert {path.name for path in (tmp_path / folder).rglob("*") if path.is_file()} <= {"run.lock"}
        assert shot.read_text() == before
        first.kill()
        first.wait()
        assert main(arguments) == 0
        before = shot.read_text()


def test_a_second_run_of_a_stage_says_so_and_stops(tmp_path, holder, capsys):
    shot = write_shot(tmp_path, 3, (128, 72), '["balls"]')
    for command, folder in (("align", "align"), ("secondary", "secondary"), ("lift", "align")):
        first = holder(tmp_path / folder)
        before = sorted(tmp_path.rglob("*"))
        assert main([command, str(shot)]) == 2
        assert f"process {first.pid} on" in capsys.readouterr().err
        assert {path for path in set(tmp_path.rglob("*")) - set(before) if path.is_file()} <= {
            tmp_path / "secondary/.pegbar/run.lock"
        }
        first.kill()
        first.wait()
