"""fit_pose over 500 poses of a swaying figure, one start, beside scipy's least_squares in a loop; and eight starts."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from benches.measure import Row, alternate, milliseconds
from pegbar import PerspectiveCamera, fit_pose

SIZE, USUAL, SPREADS, SCALE = (1280, 720), math.radians(40), (0.35, math.radians(5), math.radians(30)), 8.0
FOCAL = SIZE[0] / 2 / math.tan(USUAL / 2)
CENTER = (np.array(SIZE) - 1) / 2
POSES, JOINTS = 500, 16


def scene() -> tuple[np.ndarray, np.ndarray]:
    """Marks with 3 px noise, and poses that sway."""
    random = np.random.default_rng(0)
    rest, phase = random.normal(size=(JOINTS, 3)) * (0.25, 0.5, 0.2), random.uniform(0, 6, (JOINTS, 3))
    poses = rest + 0.12 * np.sin(np.arange(POSES)[:, None, None] * 0.05 + phase)
    camera = PerspectiveCamera.look_at((0.8, 0.4, 3.6), (0, 0, 0), SIZE, USUAL)
    return camera.project(poses[200]) + random.normal(0, 3, (JOINTS, 2)), poses


def residuals(unknowns: np.ndarray, joints: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Reprojection error in scales, and the priors: unknowns are ln f / f0, a rotation vector, the camera's centre."""
    rotation = Rotation.from_rotvec(unknowns[1:4]).as_matrix()
    seen = (points - unknowns[4:]) @ rotation.T
    off = FOCAL * math.exp(unknowns[0]) * seen[:, :2] / seen[:, 2:] + CENTER - joints
    up = rotation[:, 1]
    return np.concatenate([off.ravel() / SCALE, [unknowns[0] / SPREADS[0], up[0] / SPREADS[1], up[2] / SPREADS[2]]])


def loop(joints: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """The cost of every pose, from a camera in front, as far away as makes the figure as large as it is drawn."""
    costs = np.empty(len(poses))
    turn = Rotation.from_matrix(np.diag([1.0, -1, -1])).as_rotvec()
    spread = np.linalg.norm(joints - joints.mean(axis=0))
    for index, points in enumerate(poses):
        middle = points.mean(axis=0)
        depth = FOCAL * np.linalg.norm((points - middle)[:, :2]) / spread
        shift = (joints.mean(axis=0) - CENTER) * depth / FOCAL
        start = np.concatenate([[0.0], turn, middle + np.array([-shift[0], shift[1], depth])])
        costs[index] = 2 * least_squares(residuals, start, args=(joints, points), method="lm").cost
    return costs


def run() -> Iterator[Row]:
    """Yield the comparison with scipy and the time of eight starts."""
    joints, poses = scene()

    def ours(starts: int, **options: object) -> np.ndarray:
        return fit_pose(joints, poses, SIZE, starts=starts, **options).costs  # type: ignore[arg-type]

    begin = time.perf_counter()
    want = loop(joints, poses)
    peer = 1e3 * (time.perf_counter() - begin)
    got = ours(1, loss="squared", scale=SCALE)
    one, eight, robust = alternate(
        lambda: ours(1, loss="squared", scale=SCALE), lambda: ours(8, loss="squared", scale=SCALE), lambda: ours(8)
    )
    alike = np.isclose(got, want, rtol=1e-5)
    yield Row(
        f"fit_pose, {POSES} poses, 1 start, squared loss",
        milliseconds(one),
        f"scipy least_squares in a loop {milliseconds(peer)}",
        f"{peer / one:.0f}x faster",
        "promise 50x",
        f"costs alike in {alike.mean():.1%}, ours lower in {(got < want * (1 - 1e-5)).mean():.1%}, the same best pose: "
        f"{got.argmin() == want.argmin()}",
    )
    for name, milli in (("squared loss", eight), ("as by default, scale found", robust)):
        yield Row(f"fit_pose, {POSES} poses, 8 starts, {name}", milliseconds(milli), "", "", "promise 100 ms")
