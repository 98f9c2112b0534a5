"""The whole batch as one process that can be killed at any moment: from aligning to composite, export and animate."""

import json
import re
import shutil
import subprocess
import sys
import time

from pegbar.sample.shot import write_sample

JOBS = """
import sys
from pegbar.cli.main import main
if __name__ == "__main__":
    shot, folder, *jobs = sys.argv[1:]
    passes = f"{folder}/passes/passes.####.exr"
    for command in ("align", "import-passes", "secondary", "lift", "depth", "composite", "export"):
        options = {"import-passes": [passes], "secondary": jobs, "depth": jobs, "composite": jobs}
        if code := main([command, shot, *options.get(command, ())]):
            sys.exit(code)
    picture = [f"{folder}/drawings/dancer.0001.png", "--joints", f"{folder}/annotation.json"]
    sys.exit(main(["animate", *picture, "--clip", f"{folder}/clip.bvh", "-o", f"{folder}/animated.gif"]))
"""


def write_shot(folder, frames, size, elements=None):
    """Write a sample shot with few, small drawings and without cameras, so that it has to be aligned."""
    shot = write_sample(folder, size=size, frames=frames, samples=1)
    if elements is not None:
        text, changed = re.subn("elements = .*", f"elements = {elements}", shot.read_text())
        assert changed == 1
        shot.write_text(text)
    marks = json.loads((folder / "annotation.json").read_text())
    for entry in (marks, *marks["frames"]):
        for key in ("camera", "cameras", "depths"):
            entry.pop(key, None)
    (folder / "annotation.json").write_text(json.dumps(marks))
    (folder / "jobs.py").write_text(JOBS)
    return shot


def start_jobs(folder, options=()):
    command = [sys.executable, folder / "jobs.py", folder / "shot.toml", folder, *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder)


def run_jobs(folder, options=()):
    """Run everything undisturbed and return the seconds that it took."""
    begin = time.monotonic()
    process = start_jobs(folder, options)
    text = process.communicate(timeout=1800)[0]
    assert process.returncode == 0, text
    return time.monotonic() - begin


def results(folder):
    """The bytes of every file but the records; of reports without the seconds that were measured."""
    found = {}
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        if not path.is_file() or ".pegbar" in parts:
            continue
        data = path.read_bytes()
        if parts == ("secondary", "report.json"):
            data = {key: value for key, value in json.loads(data).items() if key not in ("seconds", "made")}
        found["/".join(parts)] = data
    return found


def kill_and_compare(folder, kills, chance, options=()):
    """Kill the batch of the shot in ``folder`` at ``kills`` random moments, run it to its end; return what differs.

    A run that ends before it is killed is compared too, and the next one begins anew.
    """
    shutil.copytree(folder, begun := folder.with_name("begun"))
    seconds = run_jobs(folder, options)
    whole = results(folder)
    _renew(begun, folder)
    done = 0
    while done < kills:
        process = start_jobs(folder, options)
        try:
            process.communicate(timeout=chance.uniform(0.05, 0.9) * seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            done += 1
        else:
            assert process.returncode == 0
            if wrong := differences(results(folder), whole):
                return wrong
            _renew(begun, folder)
    run_jobs(folder, options)
    return differences(results(folder), whole)


def differences(found, whole):
    return sorted(name for name in found.keys() | whole.keys() if found.get(name) != whole.get(name))


def _renew(begun, folder):
    shutil.rmtree(folder)
    shutil.copytree(begun, folder)
