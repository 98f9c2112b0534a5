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
    """Run commands in a process of its own; return the most memory that it or one of its workers took, in MB.

    Its own ru_maxrss would have this process's memory for its least value.
    """
    code = (
        "import resource; from pegbar.cli.main import main\n"
        "if __name__ == '__main__':\n"
        f"    for command in {commands!r}:\n"
        "        assert main(command) == 0, command\n"
        "    own = open('/proc/self/status').read().split('VmHWM:')[1].split()[0]\n"
        "    print(max(int(own), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))"
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


def test_two_thousand_frames_take_no_memory_but_for_their_numbers(tmp_path):
    """A kept picture takes 0.4 MB or more, marks and poses less than 0.08 MB a frame, exported meshes 0.1 MB."""
    short, long = (_peaks(tmp_path / str(count), count, (480, 270)) for count in (100, 2000))
    grown = {command: (long[command] - short[command]) / 1900 for command in short}
    assert grown.pop("export") <= 0.15, (short, long)
    assert max(grown.values()) <= 0.1, (short, long)


def test_every_command_works_on_4k_frames_in_bounded_memory(tmp_path):
    """In MB for one job. A picture of 3840 x 2160 takes 33, the 2 x 2 samples of a whole frame's passes 860."""
    peaks = _peaks(tmp_path / "shot", 2, (3840, 2160))
    assert peaks.pop("secondary") <= 1800, peaks
    assert peaks.pop("align") <= 900, peaks
    assert max(peaks.values()) <= 750, peaks


def _peaks(folder, count, size):
    """Each command's memory in MB, in the order in which one needs the other's results."""
    shot = str(write_shot(folder, count, size, '["scarves"]'))
    words = {command: [shot, "--jobs", "1"] for command in ("secondary", "depth", "composite")}
    picture = [str(folder / "drawings/dancer.0001.png"), "--joints", str(folder / "annotation.json")]
    words["animate"] = [*picture, "--clip", str(folder / "clip.bvh"), "-o", str(folder / "a.gif")]
    order = ("align", "lift", "secondary", "depth", "composite", "export", "report", "animate")
    return {command: peak(folder, command, [[command, *words.get(command, [shot])]]) for command in order}
