"""What is too long for the gate: many kills, a 4K frame, memory over many frames."""

import random
import subprocess
import sys

import pytest

from benches.peer_batch import make_shot as make_large_shot
from pegbar.cli.main import main
from tests.cli.interruptions import contents, start, wait_for
from tests.cli.pipeline import kill_and_compare, write_shot
from tests.shots import make_shot


def test_twenty_kills_and_one_whole_run_give_the_undisturbed_bytes(tmp_path):
    whole, shot = make_shot(tmp_path / "whole", 48), make_shot(tmp_path / "killed", 48)
    assert main(["composite", str(whole)]) == 0
    chance = random.Random(7)
    for _ in range(20):
        process = start(shot, "--jobs", 2)
        wait_for(shot.parent / "final", chance.randrange(1, 46), process)
        process.kill()
        process.communicate(timeout=60)
    assert main(["composite", str(shot)]) == 0
    assert contents(shot.parent / "final") == contents(whole.parent / "final")


def test_the_whole_batch_killed_at_twenty_random_moments_gives_the_undisturbed_bytes(tmp_path):
    write_shot(tmp_path / "shot", 12, (240, 136))
    assert kill_and_compare(tmp_path / "shot", 20, random.Random()) == []


def test_a_4k_frame_is_composited(tmp_path):
    shot = make_large_shot(tmp_path, 1, (3840, 2160), 2)
    assert main(["composite", str(tmp_path / "shot.toml")]) == 0
    assert shot.output("frames", 1).is_file()


@pytest.mark.parametrize("jobs", [1, 2])
def test_memory_does_not_grow_with_the_number_of_frames(tmp_path, jobs):
    peaks = []
    for count in (50, 500):
        shot = make_shot(tmp_path / str(count), count)
        code = (
            "import resource, sys; from pegbar.cli.main import main\n"
            f"if __name__ == '__main__':\n"
            f"    assert main(['composite', {str(shot)!r}, '--jobs', '{jobs}']) == 0\n"
            "    both = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN\n"
            "    print(max(resource.getrusage(who).ru_maxrss for who in both))"
        )
        script = tmp_path / f"run{count}.py"
        script.write_text(code)
        out = subprocess.run([sys.executable, script], check=True, capture_output=True, text=True).stdout
        peaks.append(int(out.splitlines()[-1]))
    assert peaks[1] <= 1.1 * peaks[0], peaks
