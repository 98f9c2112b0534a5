"""Every speed that pegbar promises, beside its peer in the same run, with correctness checked in that run.

    RAYON_NUM_THREADS=1 python benches/peers.py [name ...]

Names: those of ``NAMES`` (default: all). Peers come with ``pip install ".[peers]"``; one that is missing is said and
left out. The machine may be noisy: ratios are of medians within one run.
"""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path
from typing import Any

os.environ.setdefault("RAYON_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

NAMES = (
    *("composite", "depth", "raster", "batch", "motion", "match", "warp", "registration", "pose", "lift"),
    *("deform", "simulation"),
)


def main(names: list[str]) -> int:
    """Print one row a measurement: what, ours in ms, peer's in ms, peer / ours, promise, correctness."""
    if unknown := set(names) - set(NAMES):
        print(f"no such benchmark: {', '.join(sorted(unknown))} (there are {', '.join(NAMES)})", file=sys.stderr)
        return 2
    print(f"threads: {os.environ['RAYON_NUM_THREADS']}")
    for name in names or NAMES:
        module: Any = importlib.import_module(f"benches.peer_{name}")
        for row in module.run():
            print(" | ".join(map(str, row)))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
