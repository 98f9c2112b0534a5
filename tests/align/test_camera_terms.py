import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar.align.camera_solver import damped_step, solve, unknowns_of
from pegbar.align.camera_terms import Cameras, Shot, Terms, cost, normal, projected_slopes, turn_slopes
from tests.oracles import registration as oracle

MODES = ("static", "pan", "free")


def case(seed=0, knee=np.inf, frames=6, marks=7):
    rng = np.random.default_rng(seed)
    seen = rng.random((frames, marks)) > 0.2
    points = np.where(seen[..., None], rng.normal(size=(frames, marks, 3)), 0)
    drawn = np.where(seen[..., None], rng.uniform(0, 600, (frames, marks, 2)), 0)
    turns = Rotation.from_rotvec(rng.normal(0, 0.2, (frames, 3))).as_matrix() @ np.diag([1, -1, -1])
    centers = np.array([0, -0.3, 6]) + rng.normal(0, 0.3, (frames, 3))
    terms = Terms(3.0, 4.0, 20.0, 25.0, 30.0, 0.1, 40.0, np.log(700), knee)
    return Shot(drawn, seen, points, np.array([320.0, 180])), Cameras(turns, centers, np.log(500)), terms


@pytest.mark.parametrize("knee", [np.inf, 150.0])
def test_cost_is_the_transcription(knee):
    shot, cameras, terms = case(knee=knee)
    want = oracle.cost(shot.marks, shot.seen, shot.points, shot.middle, *cameras[:2], 500, terms)
    assert cost(shot, cameras, terms) == pytest.approx(want, rel=1e-12)


@pytest.mark.parametrize("knee", [np.inf, 150.0])
@pytest.mark.parametrize("mode", MODES)
def test_gradient_is_that_of_finite_differences(mode, knee):
    shot, cameras, terms = case(knee=knee)
    unknowns = unknowns_of(mode, True)
    if mode != "free":  # what is shared stays the same in all frames, and has no differences over time
        cameras = Cameras(cameras.rotations, np.repeat(cameras.centers[:1], 6, axis=0), cameras.log_focal)
    if mode == "static":
        cameras = Cameras(np.repeat(cameras.rotations[:1], 6, axis=0), *cameras[1:])
    found = normal(shot, cameras, terms, unknowns)

    def slope(frames, column):
        step = np.zeros((6, 7))
        step[frames, column] = 1e-6
        return (cost(shot, cameras.moved(step), terms) - cost(shot, cameras.moved(-step), terms)) / 4e-6

    want = [slope(slice(None), column) for column in unknowns.shared]
    np.testing.assert_allclose(found.shared_slope, want, rtol=1e-5, atol=1e-2)
    own = [[slope(frame, column) for column in unknowns.own] for frame in range(6)]
    np.testing.assert_allclose(found.slope, np.reshape(own, found.slope.shape), rtol=1e-5, atol=1e-2)


def test_slopes_of_projection_and_turns_are_those_of_finite_differences():
    shot, cameras, _ = case()
    found, turns = projected_slopes(shot.points, cameras), turn_slopes(cameras.rotations)

    def pixels(moved):
        local = np.einsum("fab,fnb->fna", moved.rotations, shot.points - moved.centers[:, None])
        return np.exp(moved.log_focal) * local[..., :2] / local[..., 2:]

    def jolts(moved):
        steps = Rotation.from_matrix(moved.rotations[1:] @ moved.rotations[:-1].transpose(0, 2, 1)).as_rotvec()
        return np.diff(steps, axis=0)

    for column in range(7):
        step = np.zeros((6, 7))
        step[:, column] = 1e-6
        want = (pixels(cameras.moved(step)) - pixels(cameras.moved(-step))) / 2e-6
        np.testing.assert_allclose(found[..., column], want, rtol=1e-6, atol=1e-4)
    for frame in range(6):
        for axis in range(3):
            step = np.zeros((6, 7))
            step[frame, axis] = 1e-6
            want = (jolts(cameras.moved(step)) - jolts(cameras.moved(-step))) / 2e-6
            for place in range(3):
                if 0 <= frame - place < 4:
                    np.testing.assert_allclose(turns[frame - place, place, :, axis], want[frame - place], atol=1e-8)


@pytest.mark.parametrize("solve_focal", [True, False])
@pytest.mark.parametrize("mode", MODES)
def test_step_solves_the_dense_equations(mode, solve_focal):
    shot, cameras, terms = case()
    unknowns = unknowns_of(mode, solve_focal)
    found = normal(shot, cameras, terms, unknowns)
    size, frames, shared = len(unknowns.own), 6, len(unknowns.shared)
    dense = np.zeros((frames * size + shared,) * 2)
    for distance, blocks in enumerate((found.own, found.next, found.after)):
        for frame, block in enumerate(blocks):
            rows, columns = (slice(size * f, size * (f + 1)) for f in (frame, frame + distance))
            dense[rows, columns], dense[columns, rows] = block, block.T
    arrow = found.arrow.reshape(frames * size, shared)
    end = frames * size
    dense[:end, end:], dense[end:, :end], dense[end:, end:] = arrow, arrow.T, found.corner
    dense[np.diag_indices_from(dense)] *= 1.01
    want = np.linalg.solve(dense, -np.concatenate([found.slope.ravel(), found.shared_slope]))
    step = damped_step(found, unknowns, 0.01)
    np.testing.assert_allclose(step[:, list(unknowns.own)].ravel(), want[:end], rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(step[:, list(unknowns.shared)], np.tile(want[end:], (6, 1)), rtol=1e-8, atol=1e-10)


def test_solving_never_goes_uphill_and_a_start_behind_the_figure_stays():
    shot, cameras, terms = case()
    found = solve(shot, cameras, terms, unknowns_of("free", True))
    assert found.cost < cost(shot, cameras, terms)
    assert found.cost == pytest.approx(cost(shot, found.cameras, terms))
    behind = Cameras(cameras.rotations, cameras.centers - [0, 0, 20], cameras.log_focal)
    assert solve(shot, behind, terms, unknowns_of("free", True)) == (behind, np.inf, 0)
