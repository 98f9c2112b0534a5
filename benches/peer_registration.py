"""register_cameras on 300 frames x 17 markers beside scipy's least_squares with a sparse Jacobian's pattern."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import lil_matrix
from scipy.spatial.transform import Rotation

from benches.measure import Row
from pegbar import CameraTrack, PerspectiveCamera, register_cameras

FRAMES, MARKS, SIZE, VIEW = 300, 17, (1280, 720), math.radians(40)


def scene() -> tuple[np.ndarray, np.ndarray, list[PerspectiveCamera]]:
    """Marks with 2 px noise, the points of a figure that walks, and the cameras that follow and turn."""
    rng = np.random.default_rng(0)
    time_of = np.linspace(0, 20 * math.pi, FRAMES)[:, None, None]
    swing = np.sin(time_of + rng.uniform(0, 6, (MARKS, 1))) * rng.normal(0, 0.15, (MARKS, 3))
    points = rng.normal(0, (0.25, 0.5, 0.2), (MARKS, 3)) + swing + [0, 0.9, 0]
    points = points + np.linspace(-5, 5, FRAMES)[:, None, None] * [0, 0, 1]
    cameras = []
    for azimuth, z in zip(np.linspace(40, 90, FRAMES), np.linspace(-5, 5, FRAMES), strict=True):
        place = [5 * math.sin(math.radians(azimuth)), 1.3, z + 5 * math.cos(math.radians(azimuth))]
        cameras.append(PerspectiveCamera.look_at(place, [0, 0.9, z], SIZE, VIEW))
    marks = np.stack([camera.project(pose) for camera, pose in zip(cameras, points, strict=True)])
    return marks + rng.normal(0, 2, marks.shape), points, cameras


def peer(marks: np.ndarray, points: np.ndarray, start: CameraTrack) -> np.ndarray:
    """Camera places by scipy: reprojection and second differences, started beside the answer (0.05 off)."""
    spread = np.sqrt(np.mean(np.sum((marks - marks.mean(axis=1, keepdims=True)) ** 2, axis=-1)))
    smooth = 1.5 * spread * (9 / 2.78) ** 2
    middle, focal = (np.array(SIZE) - 1) / 2, SIZE[0] / 2 / math.tan(VIEW / 2)
    turns = Rotation.from_matrix([camera.rotation for camera in start.cameras]).as_rotvec()
    first = np.hstack([turns, [camera.position for camera in start.cameras]])

    def residuals(flat: np.ndarray) -> np.ndarray:
        state = flat.reshape(FRAMES, 6)
        rotations = Rotation.from_rotvec(state[:, :3]).as_matrix()
        local = (points - state[:, None, 3:]) @ rotations.transpose(0, 2, 1)
        offset = focal * local[..., :2] / local[..., 2:] + middle - marks
        turn = np.diff(Rotation.from_matrix(rotations[1:] @ rotations[:-1].transpose(0, 2, 1)).as_rotvec(), axis=0)
        place = np.diff(state[:, 3:], n=2, axis=0) / 5
        return np.concatenate([offset.ravel() / math.sqrt(MARKS), smooth * turn.ravel(), smooth * place.ravel()])

    rows = 2 * FRAMES * MARKS
    pattern = lil_matrix((rows + 6 * (FRAMES - 2), 6 * FRAMES), dtype=int)
    for frame in range(FRAMES):
        pattern[2 * MARKS * frame : 2 * MARKS * (frame + 1), 6 * frame : 6 * frame + 6] = 1
    for frame in range(FRAMES - 2):
        for part in range(2):
            top = rows + part * 3 * (FRAMES - 2) + 3 * frame
            pattern[top : top + 3, 6 * frame : 6 * frame + 18] = 1
    found = least_squares(
        residuals, first.ravel() + 0.05, jac_sparsity=pattern, method="trf", x_scale="jac", max_nfev=30
    )
    return found.x.reshape(FRAMES, 6)[:, 3:]


def run() -> Iterator[Row]:
    """Yield a row for each mode; the peer, which needs a start, solves the free camera with the field of view given."""
    marks, points, cameras = scene()
    want = np.array([camera.position for camera in cameras])
    options = {"mode": "free", "field_of_view": VIEW}
    start = register_cameras(marks, points, SIZE, **options)
    begin = time.process_time()
    theirs = peer(marks, points, start)
    slow = 1e3 * (time.process_time() - begin)
    for mode in ("static", "pan", "free", "auto"):
        times = []
        for _ in range(3):
            begin = time.process_time()
            track = register_cameras(marks, points, SIZE, mode=mode, field_of_view=VIEW)
            times.append(1e3 * (time.process_time() - begin))
        ours = float(np.median(times))
        places = np.array([camera.position for camera in track.cameras])
        said = f"places off by {np.linalg.norm(places - want, axis=1).mean():.3f} m"
        said += f", the peer's by {np.linalg.norm(theirs - want, axis=1).mean():.3f} m" if mode == "free" else ""
        rival = f"least_squares {slow:.0f} ms" if mode == "free" else "-"
        ratio = f"{slow / ours:.0f}x faster" if mode == "free" else "-"
        name = f"register_cameras {mode}, {FRAMES} frames x {MARKS}, CPU time"
        yield Row(name, f"{ours:.0f} ms", rival, ratio, "promise 1 s", said)
