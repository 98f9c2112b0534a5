//! Distances between two sets of 2D poses, each given as the angles of its limbs.
//!
//! Jain, Sheikh, Hodgins 2009, section 3.3, equation 4: the sum over limbs of the internal angle difference. Assumes
//! angles of which any two differ by less than 2 pi.

use crate::error::{KernelError, check_length};
use multiversion::multiversion;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// One set of poses: `limbs` angles each in radians, pose after pose, and how far each is to be trusted (empty: fully).
#[derive(Clone, Copy)]
pub struct Poses<'a> {
    /// The angles, (poses, limbs).
    pub angles: &'a [f64],
    /// Nothing, or a factor of zero or more for each angle.
    pub trust: &'a [f64],
}

/// Poses worked at a time: their sums stay in the nearest cache.
const BLOCK: usize = 512;

/// Writes the distances (poses of `a`, poses of `b`), row-major, to `out`.
///
/// With trust, a pair's limb counts `weight * trust of a * trust of b` and the sum is rescaled to the sum of
/// `weights`; a pair that no limb is trusted in has the mean of unrelated angles, pi / 2 a limb.
pub fn pose_distance(a: Poses, b: Poses, weights: &[f64], out: &mut [f64]) -> Result<(), KernelError> {
    let limbs = weights.len();
    if limbs == 0 {
        out.fill(0.0);
        return Ok(());
    }
    let trusted = !(a.trust.is_empty() && b.trust.is_empty());
    if trusted {
        check_length("trust", a.angles.len(), a.trust.len())?;
        check_length("trust", b.angles.len(), b.trust.len())?;
    }
    let (rows, columns) = (a.angles.len() / limbs, b.angles.len() / limbs);
    check_length("out", rows * columns, out.len())?;
    if columns == 0 {
        return Ok(());
    }
    let angles = by_limb(b.angles, limbs);
    let trust = by_limb(b.trust, limbs);
    let unknown = weights.iter().sum::<f64>() * PI / 2.0;
    out.par_chunks_mut(columns).enumerate().for_each(|(row, out)| {
        let pose = row * limbs..(row + 1) * limbs;
        for (start, out) in (0..columns).step_by(BLOCK).zip(out.chunks_mut(BLOCK)) {
            out.fill(0.0);
            let mut known = [0.0; BLOCK];
            for (limb, (angle, weight)) in a.angles[pose.clone()].iter().zip(weights).enumerate() {
                let place = limb * columns + start..limb * columns + start + out.len();
                if trusted {
                    let weight = weight * a.trust[pose.start + limb];
                    add_trusted(*angle, weight, &angles[place.clone()], &trust[place], out, &mut known);
                } else {
                    add(*angle, *weight, &angles[place], out);
                }
            }
            if trusted {
                rescale(out, &known, unknown);
            }
        }
    });
    Ok(())
}

fn by_limb(values: &[f64], limbs: usize) -> Vec<f64> {
    (0..limbs).flat_map(|limb| values.iter().skip(limb).step_by(limbs).copied()).collect()
}

#[inline(always)]
fn internal(a: f64, b: f64) -> f64 {
    let turn = (a - b).abs();
    let back = TAU - turn;
    if turn < back { turn } else { back }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add(angle: f64, weight: f64, others: &[f64], out: &mut [f64]) {
    for (out, other) in out.iter_mut().zip(others) {
        *out += weight * internal(angle, *other);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_trusted(angle: f64, weight: f64, others: &[f64], trust: &[f64], out: &mut [f64], known: &mut [f64]) {
    for (((out, known), other), trust) in out.iter_mut().zip(known).zip(others).zip(trust) {
        let weight = weight * trust;
        *out += weight * internal(angle, *other);
        *known += weight;
    }
}

fn rescale(out: &mut [f64], known: &[f64], unknown: f64) {
    for (out, known) in out.iter_mut().zip(known) {
        *out = if *known > 0.0 { *out / known * (unknown * 2.0 / PI) } else { unknown };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distances(a: &[f64], b: &[f64], trust: [&[f64]; 2], weights: &[f64]) -> Vec<f64> {
        let mut out = vec![-1.0; a.len() * b.len() / weights.len().pow(2)];
        let (a, b) = (Poses { angles: a, trust: trust[0] }, Poses { angles: b, trust: trust[1] });
        assert_eq!(pose_distance(a, b, weights, &mut out), Ok(()));
        out
    }

    #[test]
    fn the_shorter_way_round_is_taken_and_weighted() {
        let got = distances(&[3.0, 0.5], &[-3.0, 0.25], [&[], &[]], &[1.0, 2.0]);
        assert!((got[0] - (TAU - 6.0 + 0.5)).abs() < 1e-15);
    }

    #[test]
    fn poses_beyond_a_block_have_their_own_distances() {
        let many: Vec<f64> = (0..2 * BLOCK + 3).map(|i| i as f64 * 1e-3).collect();
        assert_eq!(distances(&[0.0], &many, [&[], &[]], &[1.0]), many);
    }

    #[test]
    fn untrusted_limbs_are_left_out_and_the_sum_rescaled() {
        let trust: [&[f64]; 2] = [&[1.0, 1.0], &[1.0, 0.0, 0.0, 0.0]];
        let got = distances(&[0.0, 0.0], &[0.5, 2.0, 1.0, 1.0], trust, &[1.0, 1.0]);
        assert_eq!(got, [1.0, PI]);
    }

    #[test]
    fn a_short_buffer_is_refused() {
        let poses = Poses { angles: &[0.0, 1.0], trust: &[] };
        assert!(matches!(pose_distance(poses, poses, &[1.0], &mut [0.0]), Err(KernelError::Length { .. })));
    }
}
