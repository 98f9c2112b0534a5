"""`pegbar animate` from end to end: cold, with the puppet kept, and another clip on it.

python benches/animate.py PICTURE CLIP OTHER_CLIP [SUFFIX ...]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from pegbar.puppet.staging import Setting
from pegbar.shot.animating import Casting, Part, animate_parts


def run(picture: Path, clip: Path, output: Path) -> str:
    """Animate once and tell what it took."""
    processor = time.process_time()
    casting = Casting(keep=output.parent / "kept")
    made = animate_parts([Part(picture, (clip,))], output, casting=casting, setting=Setting(size=(500, 500)))
    pace = made.frames / (made.seconds - made.setup)
    return (
        f"{made.frames} pictures in {made.seconds:.2f} s ({time.process_time() - processor:.2f} s of processor): "
        f"{made.setup:.2f} s to the first, then {pace:.0f} a second, {output.stat().st_size >> 10} KiB"
    )


def main() -> None:
    """Measure every suffix on one drawing."""
    picture, clip, other = (Path(argument) for argument in sys.argv[1:4])
    with tempfile.TemporaryDirectory() as folder:
        for suffix in sys.argv[4:] or ["gif", "mp4"]:
            place = Path(folder) / suffix
            place.mkdir()
            output = place / f"made.{suffix}"
            for name, performed in (("cold", clip), ("kept", clip), ("another clip", other)):
                print(f"{suffix}, {name}: {run(picture, performed, output)}", flush=True)


if __name__ == "__main__":
    main()
