"""Every speed that pegbar promises, beside its peer in the same run, with correctness checked in that run.

    python benches/peers.py [name ...] > figures.md

Names: those of ``THREADS`` (default: all); each runs in a process of its own with that many threads, unless
RAYON_NUM_THREADS says otherwise. Peers come with ``pip install ".[peers]"``; one that is missing is said and left out.
The machine may be noisy: ratios are of medians within one run, and the load is printed above each table.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

#: The comparisons, and the threads that each is stated for.
THREADS = {
    **dict.fromkeys(("composite", "depth", "raster", "warp", "registration", "pose", "lift", "deform"), 1),
    **dict.fromkeys(("batch", "motion", "match", "simulation", "secondary", "animate"), 2),
}


def main(names: list[str]) -> int:
    """Print a table for each comparison; the exit code is 1 where one failed."""
    if unknown := set(names) - set(THREADS):
        print(f"no such benchmark: {', '.join(sorted(unknown))} (there are {', '.join(THREADS)})", file=sys.stderr)
        return 2
    failed = [name for name in names or THREADS if run(name)]
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


def run(name: str) -> int:
    """Print the table of one comparison from a process that has its number of threads; return the exit code."""
    threads = os.environ.get("RAYON_NUM_THREADS", str(THREADS[name]))
    limits = dict.fromkeys(("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), threads)
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    print(f"\n## {name}\n\n{threads} thread{'s' * (threads != '1')} of {os.cpu_count()}{load}\n", flush=True)
    command = [sys.executable, __file__, "--table", name]
    return subprocess.run(command, env={**os.environ, **limits}, check=False).returncode


def table(name: str) -> None:
    """Print the rows of one comparison as they come."""
    from benches.measure import HEADER

    module: Any = importlib.import_module(f"benches.peer_{name}")
    print(HEADER)
    for row in module.run():
        print(row.line, flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--table"]:
        table(sys.argv[2])
        sys.exit(0)
    sys.exit(main(sys.argv[1:]))
