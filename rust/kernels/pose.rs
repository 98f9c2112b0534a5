//! The camera under which each pose of a clip looks most like the marks on one picture.
//!
//! Hornung, Dekkers, Kobbelt 2007, section 5: Levenberg-Marquardt on seven unknowns a pose, here from several azimuths
//! and with robust losses. Assumes that every pose has as many points as there are marks. Eight poses are fitted side
//! by side; blocks of eight run in parallel and know nothing of each other.

use crate::error::{KernelError, check_length};
use crate::lanes::{LANES, Lanes};
use crate::pinhole::{Cameras, Normal, Target, UNKNOWNS};
use crate::robust::Loss;
use glam::{DVec2, DVec3};
use multiversion::multiversion;
use rayon::prelude::*;

/// What the fit assumes about picture, marks and camera.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// The principal point, in pixels.
    pub principal: DVec2,
    /// The usual focal length, in pixels.
    pub focal: f64,
    /// How far ln f is usually off; None holds the focal length.
    pub focal_spread: Option<f64>,
    /// How far the camera is usually rolled, in radians; infinite does not care.
    pub roll_spread: f64,
    /// How far the camera usually stands above or below the level, in radians; infinite does not care.
    pub elevation_spread: f64,
    /// What a residual costs.
    pub loss: Loss,
    /// Scale of the loss, in pixels.
    pub scale: f64,
    /// Azimuths to start from.
    pub starts: usize,
}

/// Steps at most from each start, and the last decrease, as part of the cost, that was worth a step.
const ROUGH: (usize, f64) = (12, 1e-3);
/// The same for the best start.
const FINE: (usize, f64) = (50, 1e-11);

/// One pose's outcome.
pub struct Found<'a> {
    /// The 3x4 matrix, row by row; its third row gives metres. NaN for a pose without an answer.
    pub matrix: &'a mut [f64; 12],
    /// What the fit costs: losses and priors. Infinite for a pose without an answer.
    pub cost: &'a mut f64,
    /// The distance of every mark from its projected point, in pixels.
    pub distances: &'a mut [f64],
}

/// Fits a camera to every pose.
///
/// `poses` holds as many points a pose as there are `joints`. `matrices` and `costs` take one entry a pose,
/// `distances` one a joint and pose. A pose whose points lie on one line has no answer.
pub fn fit_poses(
    joints: &[DVec2],
    poses: &[DVec3],
    settings: &Settings,
    matrices: &mut [[f64; 12]],
    costs: &mut [f64],
    distances: &mut [f64],
) -> Result<(), KernelError> {
    let (count, total) = (joints.len(), costs.len());
    check_length("poses", count * total, poses.len())?;
    check_length("matrices", total, matrices.len())?;
    check_length("distances", count * total, distances.len())?;
    if count == 0 || settings.starts == 0 {
        return Err(KernelError::Argument { argument: "joints", problem: "want joints and starts" });
    }
    let marks: Vec<[f64; 2]> = joints.iter().map(|joint| (*joint - settings.principal).to_array()).collect();
    let blocks = poses.par_chunks(LANES * count).zip(matrices.par_chunks_mut(LANES));
    let found = costs.par_chunks_mut(LANES).zip(distances.par_chunks_mut(LANES * count));
    blocks.zip(found).for_each(|((poses, matrices), (costs, distances))| {
        let found = matrices.iter_mut().zip(costs).zip(distances.chunks_mut(count));
        let found = found.map(|((matrix, cost), distances)| Found { matrix, cost, distances });
        fit_block(poses, &marks, settings, &mut found.collect::<Vec<_>>());
    });
    Ok(())
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn fit_block(poses: &[DVec3], marks: &[[f64; 2]], settings: &Settings, found: &mut [Found]) {
    let (count, last) = (marks.len(), found.len() - 1);
    // A last block that is not full repeats its last pose.
    let pose = |lane: usize| &poses[lane.min(last) * count..][..count];
    let middles: [DVec3; LANES] = std::array::from_fn(|lane| pose(lane).iter().sum::<DVec3>() / count as f64);
    let points: Vec<[Lanes; 3]> = (0..count)
        .map(|joint| {
            let offsets: [DVec3; LANES] = std::array::from_fn(|lane| pose(lane)[joint] - middles[lane]);
            std::array::from_fn(|axis| Lanes(offsets.map(|offset| offset[axis])))
        })
        .collect();
    let target = Target {
        points: &points,
        marks,
        loss: settings.loss,
        scale: settings.scale,
        log_focal: settings.focal.ln(),
        focal_weight: settings.focal_spread.map(f64::recip),
        roll_weight: settings.roll_spread.recip(),
        elevation_weight: settings.elevation_spread.recip(),
    };
    // Losses that forget outliers forget whole limbs from a rough start: first the one that forgets nothing.
    let whole = if settings.loss == Loss::Squared { Loss::Squared } else { Loss::Huber };
    let rough = Target { loss: whole, ..target };
    let (mut best, mut cost) = minimise(&rough, start(&rough, 0.0), ROUGH);
    for turn in 1..settings.starts {
        let azimuth = std::f64::consts::TAU * turn as f64 / settings.starts as f64;
        let (camera, reached) = minimise(&rough, start(&rough, azimuth), ROUGH);
        let better = reached.below(cost);
        (best, cost) = (camera.or(&better, &best), reached.or(&better, cost));
    }
    let (best, cost) = minimise(&target, best, FINE);
    for (lane, found) in found.iter_mut().enumerate() {
        *found.cost = cost.0[lane];
        let rotation = best.rotation.map(|row| DVec3::from_array(row.map(|value| value.0[lane])));
        let shift = DVec2::new(best.shift[0].0[lane], best.shift[1].0[lane]);
        let (scale, focal) = (best.log_scale.0[lane].exp(), best.log_focal.0[lane].exp());
        write(rotation, shift, scale, focal, middles[lane], settings.principal, found.matrix);
        for ((distance, point), mark) in found.distances.iter_mut().zip(pose(lane)).zip(marks) {
            let offset = *point - middles[lane];
            let seen = shift + scale * DVec2::new(rotation[0].dot(offset), rotation[1].dot(offset));
            let seen = seen / (1.0 + scale / focal * rotation[2].dot(offset));
            *distance = seen.distance(DVec2::from_array(*mark));
        }
        if spread(pose(lane), middles[lane]) < LINE {
            *found.cost = f64::INFINITY;
            found.matrix.fill(f64::NAN);
            found.distances.fill(f64::INFINITY);
        }
    }
}

/// A pose narrower than this part of its length, squared, is a line.
const LINE: f64 = 1e-12;

/// How far the points are from one line: the sum of the products of two principal variances over the squared variance.
fn spread(points: &[DVec3], middle: DVec3) -> f64 {
    let mut sums = [0.0; 6];
    for point in points {
        let [x, y, z] = (*point - middle).to_array();
        sums.iter_mut().zip([x * x, y * y, z * z, x * y, x * z, y * z]).for_each(|(sum, value)| *sum += value);
    }
    let [xx, yy, zz, xy, xz, yz] = sums;
    let minors = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz;
    let ratio = minors / (xx + yy + zz).powi(2);
    if ratio.is_finite() { ratio } else { 0.0 }
}

/// The matrix K [R | t] with metres in its third row.
fn write(
    rotation: [DVec3; 3],
    shift: DVec2,
    scale: f64,
    focal: f64,
    middle: DVec3,
    principal: DVec2,
    matrix: &mut [f64; 12],
) {
    let depth = focal / scale;
    let place = [shift.x / scale, shift.y / scale, depth];
    let row = |axis: usize| rotation[axis].extend(place[axis] - rotation[axis].dot(middle));
    let rows = [focal * row(0) + principal.x * row(2), focal * row(1) + principal.y * row(2), row(2)];
    for (target, row) in matrix.chunks_exact_mut(4).zip(rows) {
        target.copy_from_slice(&row.to_array());
    }
}

/// Level cameras in the direction of an azimuth, as far away as makes the figure as large as it is drawn.
#[inline(always)]
fn start(target: &Target, azimuth: f64) -> Cameras {
    let (sin, cos) = azimuth.sin_cos();
    let rotation = [[cos, 0.0, -sin], [0.0, -1.0, 0.0], [-sin, 0.0, -cos]].map(|row| row.map(Lanes::splat));
    let count = target.marks.len() as f64;
    let sum = target.marks.iter().fold([0.0; 2], |sum, mark| [sum[0] + mark[0], sum[1] + mark[1]]);
    let middle = sum.map(|sum| sum / count);
    let drawn: f64 =
        target.marks.iter().map(|mark| (mark[0] - middle[0]).powi(2) + (mark[1] - middle[1]).powi(2)).sum();
    let (mut seen, mut reach) = (Lanes::ZERO, Lanes::ZERO);
    for point in target.points {
        let [x, y, z] = rotation.map(|row| row[0] * point[0] + row[1] * point[1] + row[2] * point[2]);
        seen = seen + x * x + y * y;
        reach = reach.or(&(z * z).below(reach), z * z);
    }
    // No point may be nearer than half the middle's depth, however large the figure is drawn.
    let nearest = reach.map(|reach| target.log_focal - (2.0 * reach.sqrt()).max(1e-12).ln());
    let scale = seen.map(|seen| 0.5 * (drawn / seen.max(1e-12)).ln());
    Cameras {
        rotation,
        shift: middle.map(Lanes::splat),
        log_scale: scale.or(&scale.below(nearest), nearest),
        log_focal: Lanes::splat(target.log_focal),
    }
}

/// Levenberg-Marquardt: the cameras after at most so many steps, and what they cost.
#[inline(always)]
fn minimise(target: &Target, mut camera: Cameras, (steps, tolerance): (usize, f64)) -> (Cameras, Lanes) {
    let mut now = camera.normal(target);
    let mut damping = Lanes::splat(1e-3);
    let mut running = [true; LANES];
    for _ in 0..steps {
        let step = now.step(damping);
        let worth = promise(&now, &step).below(now.cost * Lanes::splat(tolerance) + Lanes::splat(1e-20));
        let trial = camera.moved(&step);
        let next = trial.normal(target);
        let mut better = next.cost.below(now.cost);
        better.iter_mut().zip(running).for_each(|(better, running)| *better &= running);
        camera = trial.or(&better, &camera);
        now = next.or(&better, &now);
        damping = (damping * Lanes::splat(0.2)).or(&better, damping * Lanes::splat(5.0)).within(1e9);
        running.iter_mut().zip(worth).for_each(|(running, small)| *running &= !small);
        if !running.contains(&true) {
            break;
        }
    }
    (camera, now.cost)
}

/// About the decrease that a step promises.
#[inline(always)]
fn promise(now: &Normal, step: &[Lanes; UNKNOWNS]) -> Lanes {
    let mut sum = Lanes::ZERO;
    for (gradient, step) in now.gradient.iter().zip(step) {
        sum = sum - *gradient * *step;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Settings = Settings {
        principal: DVec2::new(319.5, 239.5),
        focal: 900.0,
        focal_spread: Some(0.35),
        roll_spread: 0.1,
        elevation_spread: 0.5,
        loss: Loss::Huber,
        scale: 4.0,
        starts: 8,
    };

    fn poses(count: usize) -> Vec<DVec3> {
        let wave = |k: usize| (k as f64 * 0.71).sin() + (k as f64 * 0.13).cos();
        (0..count * 9).map(|k| DVec3::new(wave(5 * k), wave(7 * k + 1), wave(11 * k + 2))).collect()
    }

    /// A pose seen by a level camera in the direction of an azimuth.
    fn seen(points: &[DVec3], azimuth: f64) -> Vec<DVec2> {
        let (sin, cos) = azimuth.sin_cos();
        let (right, back) = (DVec3::new(cos, 0.0, -sin), DVec3::new(sin, 0.0, cos));
        let at = |p: DVec3| DVec2::new(right.dot(p), -p.y) * 900.0 / (8.0 - back.dot(p)) + SETTINGS.principal;
        points.iter().map(|point| at(*point)).collect()
    }

    fn fit(joints: &[DVec2], poses: &[DVec3], settings: &Settings) -> (Vec<[f64; 12]>, Vec<f64>, Vec<f64>) {
        let count = poses.len() / joints.len();
        let (mut matrices, mut costs) = (vec![[0.0; 12]; count], vec![0.0; count]);
        let mut distances = vec![0.0; poses.len()];
        let done = fit_poses(joints, poses, settings, &mut matrices, &mut costs, &mut distances);
        assert_eq!(done, Ok(()));
        (matrices, costs, distances)
    }

    #[test]
    fn the_pose_that_was_seen_costs_nothing_and_its_matrix_is_the_camera() {
        let poses = poses(11);
        for (pose, azimuth) in [(0, 0.3), (7, 2.0), (10, -1.9)] {
            let points = &poses[9 * pose..][..9];
            let joints = seen(points, azimuth);
            let (matrices, costs, distances) = fit(&joints, &poses, &SETTINGS);
            assert!(costs.iter().enumerate().all(|(other, cost)| other == pose || *cost > 1.0 + costs[pose]));
            assert!(costs[pose] < 1e-9 && distances[9 * pose..][..9].iter().all(|distance| *distance < 1e-3));
            let [_, _, depths] = [0, 4, 8].map(|row| DVec3::from_slice(&matrices[pose][row..]));
            assert!(depths.distance(DVec3::new(-azimuth.sin(), 0.0, -azimuth.cos())) < 1e-5);
            assert!((matrices[pose][11] - 8.0).abs() < 1e-3);
        }
    }

    #[test]
    fn a_pose_is_fitted_alike_whatever_poses_lie_beside_it() {
        let poses = poses(19);
        let joints = seen(&poses[..9], 0.8);
        let (matrices, costs, distances) = fit(&joints, &poses, &SETTINGS);
        for pose in [0, 7, 8, 18] {
            let alone = fit(&joints, &poses[9 * pose..][..9], &SETTINGS);
            assert_eq!(alone, (vec![matrices[pose]], vec![costs[pose]], distances[9 * pose..][..9].to_vec()));
        }
    }

    #[test]
    fn a_pose_on_one_line_has_no_answer() {
        let mut poses = poses(3);
        let joints = seen(&poses[..9], 0.8);
        for (k, point) in poses[9..18].iter_mut().enumerate() {
            *point = DVec3::new(1.0, 2.0, 3.0) * k as f64;
        }
        let (matrices, costs, distances) = fit(&joints, &poses, &SETTINGS);
        assert!(costs[1] == f64::INFINITY && distances[9..18] == [f64::INFINITY; 9]);
        assert!(matrices[1].iter().all(|value| value.is_nan()) && costs[0].is_finite() && costs[2].is_finite());
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let got =
            fit_poses(&[DVec2::ZERO; 4], &[DVec3::ZERO; 7], &SETTINGS, &mut [[0.0; 12]], &mut [0.0], &mut [0.0; 4]);
        assert_eq!(got, Err(KernelError::Length { argument: "poses", wanted: 4, got: 7 }));
        let got = fit_poses(&[], &[], &SETTINGS, &mut [], &mut [], &mut []);
        assert!(matches!(got, Err(KernelError::Argument { argument: "joints", .. })));
    }
}
