//! Marker positions from drawn points and a clip: one small linear least-squares problem a frame.
//!
//! Jain, Sheikh, Hodgins 2009, eqs. 5-11, and within principal components eqs. 12-16. Assumes that the rows of eq. 6
//! come in metres and that the unknown is the step away from the clip's pose, so that what nothing determines stays.

use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// What the frames of a clip share.
pub struct Lift<'a> {
    /// Number of markers.
    pub markers: usize,
    /// Pairs of markers that eq. 7 holds apart.
    pub limbs: &'a [[i64; 2]],
    /// Weight of the squared limb residuals (lambda 1).
    pub limb_weight: f64,
    /// Weight of the squared distance to the clip (lambda 2), positive.
    pub prior_weight: f64,
    /// Mean pose, 3 numbers a marker; empty where poses are free.
    pub mean: &'a [f64],
    /// Orthonormal components, one row of 3 numbers a marker each; empty where poses are free.
    pub components: &'a [f64],
}

/// Solves every frame. `projection` holds two rows of eq. 6 a marker, each `a x + b y + c z = d` (all 0: not visible),
/// `lengths` one length a limb, `prior` the clip's pose; `out` takes the pose.
pub fn lift(
    shared: &Lift,
    projection: &[[[f64; 4]; 2]],
    lengths: &[f64],
    prior: &[f64],
    out: &mut [f64],
) -> Result<(), KernelError> {
    let (size, limbs) = (3 * shared.markers, shared.limbs.len());
    if size == 0 {
        return Ok(());
    }
    let frames = prior.len() / size;
    check_length("projection", frames * shared.markers, projection.len())?;
    check_length("lengths", frames * limbs, lengths.len())?;
    check_length("prior", frames * size, prior.len())?;
    check_length("out", prior.len(), out.len())?;
    check_length("mean", if shared.components.is_empty() { 0 } else { size }, shared.mean.len())?;
    check_length("components", shared.components.len() / size * size, shared.components.len())?;
    let inside = |marker: i64| usize::try_from(marker).is_ok_and(|marker| marker < shared.markers);
    if let Some(index) = shared.limbs.iter().position(|ends| !ends.iter().all(|&marker| inside(marker))) {
        return Err(KernelError::Item { argument: "limbs", problem: "no such marker", index });
    }
    out.par_chunks_mut(size).enumerate().try_for_each(|(frame, pose)| {
        let rows = &projection[frame * shared.markers..][..shared.markers];
        let (lengths, prior) = (&lengths[frame * limbs..][..limbs], &prior[frame * size..][..size]);
        let solved = if shared.components.is_empty() {
            free_pose(shared, rows, lengths, prior, pose)
        } else {
            pose_of_components(shared, rows, lengths, prior, pose)
        };
        solved.ok_or(KernelError::Item { argument: "prior", problem: UNSOLVED, index: frame })
    })
}

const UNSOLVED: &str = "the weights are too large or too small to solve for the pose";

/// Normal equations of eq. 10 for a step away from a pose: the matrix and the right side.
struct Normal {
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Normal {
    /// The equations around `pose`; limbs are linearised around `prior`.
    fn new(shared: &Lift, rows: &[[[f64; 4]; 2]], lengths: &[f64], prior: &[f64], pose: &[f64]) -> Self {
        let size = prior.len();
        let mut normal = Normal { matrix: vec![0.0; size * size], right: vec![0.0; size] };
        for (marker, rows) in rows.iter().enumerate() {
            let at = &pose[3 * marker..][..3];
            for [a, b, c, d] in rows {
                let residual = d - (a * at[0] + b * at[1] + c * at[2]);
                normal.add(&[(3 * marker, [*a, *b, *c])], residual, 1.0);
            }
        }
        for (&[i, j], length) in shared.limbs.iter().zip(lengths) {
            let (i, j) = (3 * i as usize, 3 * j as usize);
            let between = |pose: &[f64]| [pose[i] - pose[j], pose[i + 1] - pose[j + 1], pose[i + 2] - pose[j + 2]];
            let (base, now) = (between(prior), between(pose));
            let gradient = base.map(|value| 2.0 * value);
            // Eq. 7 as printed: the residual is a squared length, here around the clip's limb `base`.
            let residual = length * length + dot(base, base) - dot(gradient, now);
            normal.add(&[(i, gradient), (j, gradient.map(|value| -value))], residual, shared.limb_weight);
        }
        for k in 0..size {
            normal.matrix[k * size + k] += shared.prior_weight;
            normal.right[k] += shared.prior_weight * (prior[k] - pose[k]);
        }
        normal
    }

    /// Adds one row of eq. 10, given where its triples of numbers start.
    fn add(&mut self, row: &[(usize, [f64; 3])], residual: f64, weight: f64) {
        let size = self.right.len();
        for (first, left) in row {
            for (second, right) in row {
                for (k, value) in left.iter().enumerate() {
                    for (l, other) in right.iter().enumerate() {
                        self.matrix[(first + k) * size + second + l] += weight * value * other;
                    }
                }
            }
            for (k, value) in left.iter().enumerate() {
                self.right[first + k] += weight * value * residual;
            }
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Eq. 11.
fn free_pose(shared: &Lift, rows: &[[[f64; 4]; 2]], lengths: &[f64], prior: &[f64], pose: &mut [f64]) -> Option<()> {
    let Normal { mut matrix, mut right } = Normal::new(shared, rows, lengths, prior, prior);
    solve(&mut matrix, &mut right)?;
    pose.iter_mut().zip(prior).zip(&right).for_each(|((pose, prior), step)| *pose = prior + step);
    Some(())
}

/// Eqs. 12-16: the step from the clip's pose within the components.
fn pose_of_components(
    shared: &Lift,
    rows: &[[[f64; 4]; 2]],
    lengths: &[f64],
    prior: &[f64],
    pose: &mut [f64],
) -> Option<()> {
    let size = prior.len();
    let components = || shared.components.chunks_exact(size);
    let away: Vec<f64> = prior.iter().zip(shared.mean).map(|(prior, mean)| prior - mean).collect();
    pose.copy_from_slice(shared.mean);
    components().for_each(|row| accumulate(pose, row, inner(row, &away)));
    let full = Normal::new(shared, rows, lengths, prior, pose);
    let count = components().len();
    let mut matrix = vec![0.0; count * count];
    let mut right: Vec<f64> = components().map(|row| inner(row, &full.right)).collect();
    for (k, row) in components().enumerate() {
        let mut image = vec![0.0; size];
        for (line, weight) in full.matrix.chunks_exact(size).zip(row) {
            accumulate(&mut image, line, *weight);
        }
        components().enumerate().skip(k).for_each(|(l, other)| matrix[k * count + l] = inner(&image, other));
    }
    solve(&mut matrix, &mut right)?;
    components().zip(&right).for_each(|(row, weight)| accumulate(pose, row, *weight));
    Some(())
}

fn accumulate(sum: &mut [f64], row: &[f64], weight: f64) {
    sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
}

/// Cholesky on the upper triangle, row by row; the solution replaces `right`. None where the matrix is not positive
/// definite. Rows are added to rows, which runs in wide registers, and zeros (markers that no limb joins) are skipped.
fn solve(matrix: &mut [f64], right: &mut [f64]) -> Option<()> {
    let size = right.len();
    for k in 0..size {
        let (above, below) = matrix.split_at_mut((k + 1) * size);
        let line = &mut above[k * size..];
        let pivot = line[k].sqrt();
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        line[k..].iter_mut().for_each(|value| *value /= pivot);
        right[k] /= pivot;
        let (solved, rest) = right.split_at_mut(k + 1);
        accumulate(rest, &line[k + 1..], -solved[k]);
        for (i, other) in (k + 1..size).zip(below.chunks_exact_mut(size)) {
            if line[i] != 0.0 {
                accumulate(&mut other[i..], &line[i..], -line[i]);
            }
        }
    }
    for (i, line) in matrix.chunks_exact(size).enumerate().rev() {
        right[i] = (right[i] - inner(&line[i + 1..], &right[i + 1..])) / line[i];
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRONT: [[f64; 4]; 2] = [[1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0]];

    fn seen(x: f64, y: f64) -> [[f64; 4]; 2] {
        [[1.0, 0.0, 0.0, x], [0.0, -1.0, 0.0, -y]]
    }

    fn shared<'a>(limbs: &'a [[i64; 2]], mean: &'a [f64], components: &'a [f64]) -> Lift<'a> {
        Lift { markers: 2, limbs, limb_weight: 1.0, prior_weight: 0.1, mean, components }
    }

    #[test]
    fn cholesky_solves_a_known_system() {
        let mut right = [8.0, 7.0];
        assert_eq!(solve(&mut [4.0, 2.0, f64::NAN, 3.0], &mut right), Some(()));
        assert!((right[0] - 1.25).abs() < 1e-12 && (right[1] - 1.5).abs() < 1e-12);
        assert_eq!(solve(&mut [1.0, 2.0, 0.0, 1.0], &mut [0.0, 0.0]), None);
    }

    #[test]
    fn drawn_as_the_clip_gives_the_clip_back() {
        let prior = [0.0, 0.0, 1.0, 0.3, 0.4, 1.0];
        let mut out = [0.0; 6];
        let rows = [FRONT, seen(0.3, 0.4)];
        assert_eq!(lift(&shared(&[[0, 1]], &[], &[]), &rows, &[0.5], &prior, &mut out), Ok(()));
        assert!(out.iter().zip(prior).all(|(got, want)| (got - want).abs() < 1e-12));
    }

    #[test]
    fn components_keep_the_pose_in_their_span() {
        let (mean, along) = ([0.0; 6], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        let mut out = [9.0; 6];
        let rows = [FRONT, seen(2.2, 5.0)];
        assert_eq!(lift(&shared(&[], &mean, &along), &rows, &[], &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], &mut out), Ok(()));
        assert!((out[3] - 2.0).abs() < 1e-12);
        assert!(out.iter().enumerate().all(|(k, value)| k == 3 || *value == 0.0));
    }

    #[test]
    fn wrong_sizes_and_markers_are_refused() {
        let mut out = [0.0; 6];
        let got = lift(&shared(&[[0, 2]], &[], &[]), &[FRONT; 2], &[1.0], &[0.0; 6], &mut out);
        assert!(matches!(got, Err(KernelError::Item { argument: "limbs", index: 0, .. })));
        let got = lift(&shared(&[[0, 1]], &[], &[]), &[FRONT; 2], &[], &[0.0; 6], &mut out);
        assert!(matches!(got, Err(KernelError::Length { argument: "lengths", .. })));
    }
}
