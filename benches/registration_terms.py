"""What each term of `register_cameras` and its weight does to real clips seen through known cameras (docs/cameras.md).

    python benches/registration_terms.py DATA [modes]

DATA is the folder of real clips. With `modes`: what `mode="auto"` chooses, instead of the terms.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from pegbar import register_cameras
from tests.drawn_clips import CLIPS, SIZE, VIEWS, DrawnClip, clip_points, draw, recovery

#: The camera that a kind of shot needs.
KINDS = {"static": "static", "pan": "pan", "tilt": "pan", "dolly": "free", "track": "free"}
VARIANTS: dict[str, dict] = {
    "all terms": {},
    "smooth 0": {"weights": {"smooth": 0}},
    "smooth 0.1": {"weights": {"smooth": 0.1}},
    "smooth 10": {"weights": {"smooth": 10}},
    "smooth 100": {"weights": {"smooth": 100}},
    "window 5": {"window": 5},
    "window 17": {"window": 17},
    "roll 0": {"weights": {"roll": 0}},
    "roll 10": {"weights": {"roll": 10}},
    "ground 0": {"weights": {"ground": 0}},
    "field_of_view 0": {"weights": {"field_of_view": 0}},
    "field_of_view 10": {"weights": {"field_of_view": 10}},
    "field_of_view 100": {"weights": {"field_of_view": 100}},
    "not robust": {"robust": False},
}


def shots(folder: Path) -> list[tuple[str, str, DrawnClip, float]]:
    """Clip, kind, drawing and field of view in degrees of every trial; three marks in a hundred are 30 px off."""
    made = []
    for name in CLIPS:
        clip = clip_points(folder, name)
        for kind in KINDS:
            for seed, view in enumerate(VIEWS):
                drawn = draw(clip, kind, view, seed=seed)
                rng = np.random.default_rng(seed)
                wild = rng.random(drawn.marks.shape[:2]) < 0.03
                drawn.marks[wild] += 30 * rng.choice([-1, 1], (wild.sum(), 2))
                made.append((name, kind, drawn, view[2]))
    return made


def terms(folder: Path) -> None:
    """Print a row for every variant: errors of the cameras, the field of view solved, as RMS over the shots."""
    trials = shots(folder)[::3]
    print(
        "| | view, deg | angle, deg | place, % | field of view, deg | jitter, px | step, px | roll, deg | below floor |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for label, options in VARIANTS.items():
        rows = []
        for _, kind, drawn, fov in trials:
            track = register_cameras(drawn.marks, drawn.points, SIZE, mode=KINDS[kind], **options)
            found = recovery(track, drawn)
            camera = track.cameras[0]
            roll = math.degrees(np.abs([view.rotation[0, 1] for view in track.cameras]).max())
            below = float(np.mean([view.position[1] < 0 for view in track.cameras]))
            place = 100 * found.place / found.distance
            lens = math.degrees(camera.field_of_view) - fov
            rows.append((found.view, found.angle, place, lens, found.jitter, found.step, roll, below))
        values = np.sqrt(np.mean(np.square(rows), axis=0))
        print(f"| {label} | " + " | ".join(f"{value:.2f}" for value in values) + " |", flush=True)


def modes(folder: Path) -> None:
    """Print a row for every kind of camera: what was chosen, and the errors with the field of view given."""
    rows: dict[str, list] = {}
    for _, kind, drawn, fov in shots(folder):
        options = {"field_of_view": math.radians(fov), "mode": "auto"}
        track = register_cameras(drawn.marks, drawn.points, SIZE, **options)
        found = recovery(track, drawn)
        place = 100 * found.place / found.distance
        rows.setdefault(kind, []).append(
            (track.mode, found.view, found.most_view, found.angle, place, found.jitter, found.step, track.error)
        )
    print(
        "| kind | chosen | view, deg | largest | angle, deg | place, % | jitter, px | largest | step, px | marks, px |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for kind, found in rows.items():
        chosen = [row[0] for row in found]
        counts = ", ".join(f"{mode} {chosen.count(mode)}" for mode in ("static", "pan", "free") if mode in chosen)
        view, _, angle, place, jitter, step, error = np.sqrt(np.mean(np.square([row[1:] for row in found]), axis=0))
        worst, jumpiest = max(row[2] for row in found), max(row[5] for row in found)
        print(
            f"| {kind} | {counts} | {view:.1f} | {worst:.1f} | {angle:.1f} | {place:.1f} | {jitter:.2f} | "
            f"{jumpiest:.2f} | {step:.2f} | {error:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    (modes if "modes" in sys.argv[2:] else terms)(Path(sys.argv[1]))
