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


def peak(tmp_path, name, commands):
    """Run commands in a process of its own; return the most memory that it or one of its workers took, in MB."""
    code = (
        "import resource; from pegbar.cli.main import main\n"
        "if __name__ == '__main__':\n"
        f"    for command in {commands!r}:\n"
        "        assert main(command) == 0, command\n"
        "    both = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN\n"
        "    print(max(resource.getrusage(who).ru_maxrss for who in both))"
    )
    script = tmp_path / f"{name}.py"
    script.write_text(code)
    out = subprocess.run([sys.executable, script], check=True, capture_output=True, text=True).stdout
    return int(out.splitlines()[-1]) / 1024


@pytest.mark.parametrize("jobs", [1, 2])
def test_memory_does_not_grow_with_the_number_of_frames(tmp_path, jobs):
    shots = [make_shot(tmp_path / str(count), count) for count in (50, 500)]
    peaks = [peak(tmp_path, shot.parent.name, [["composite", str(shot), "--jobs", str(jobs)]]) for shot in shots]
    assert peaks[1] <= 1.1 * peaks[0], peaks


@pytest.mark.parametrize("command", ["align", "lift", "secondary", "animate"])
def test_shots_of_two_thousand_frames_take_little_more_memory_than_short_ones(tmp_path, command):
    """Numbers grow, by 0.6 MB a drawing where cameras are registered; pictures and overlays would be 1.5 MB more."""
    peaks = []
    for count in (100, 2000):
        folder = tmp_path / str(count)
        shot = write_shot(folder, count, (480, 270), '["scarves"]')
        words = [str(shot)]
        if command == "animate":
            words = [str(folder / "drawings/dancer.0001.png"), "--joints", str(folder / "annotation.json")]
            words += ["--clip", str(folder / "clip.bvh"), "-o", str(folder / "a.gif")]
        peaks.append(peak(tmp_path, f"{command}{count}", [[command, *words]]))
    assert peaks[1] <= peaks[0] + 0.7 * 1900, peaks
