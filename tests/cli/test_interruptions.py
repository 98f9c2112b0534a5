import random
import shutil
import signal

import pytest

from pegbar.cli.main import main
from tests.cli.interruptions import contents, start, wait_for
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
