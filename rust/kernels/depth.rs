//! Depth of every drawn pixel from the depths of its limb's two ends.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, section 3.3.1: a pixel has the depth of the closest point of its limb's axis,
//! the segment between the limb's two markers. Assumes labels 0 (no limb) or v + 1 (limb v).

use crate::checks::first_fault;
use crate::error::{KernelError, check_length};
use glam::DVec2;
use multiversion::multiversion;
use rayon::prelude::*;

/// How depth runs from one end of a limb to the other, along the drawn segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Linear in pixels, as the paper says.
    Linear,
    /// Linear in 1/z: a straight limb under a perspective camera.
    Perspective,
}

/// One limb made ready for its pixels: depth, or one over it, is affine in the pixel's place and ends at the markers'.
#[derive(Clone, Copy)]
struct Axis {
    origin: DVec2,
    slope: DVec2,
    at_origin: f64,
    low: f64,
    high: f64,
    reciprocal: bool,
}

impl Axis {
    fn new(a: DVec2, b: DVec2, za: f64, zb: f64, interpolation: Interpolation) -> Self {
        let along = b - a;
        let squared = along.length_squared();
        let reciprocal = interpolation == Interpolation::Perspective;
        // A limb seen end on takes its nearer end (docs/papers.md): without a slope the depth stays there.
        let (za, zb) = if squared > 0.0 { (za, zb) } else { (za.min(zb), za.min(zb)) };
        let (from, to) = if reciprocal { (za.recip(), zb.recip()) } else { (za, zb) };
        let slope = if squared > 0.0 { along * ((to - from) / squared) } else { DVec2::ZERO };
        Axis { origin: a, slope, at_origin: from, low: from.min(to), high: from.max(to), reciprocal }
    }

    /// Fills one run of pixels of this limb in one row.
    #[inline(always)]
    fn fill(&self, row: usize, column: usize, out: &mut [f32]) {
        let start = self.at_origin + (DVec2::new(column as f64, row as f64) - self.origin).dot(self.slope);
        let steps: [f64; LANES] = std::array::from_fn(|i| self.slope.x * i as f64);
        let block_start = |block: usize| start + self.slope.x * (block * LANES) as f64;
        let (blocks, rest) = out.as_chunks_mut::<LANES>();
        let whole = blocks.len();
        for (block, depths) in blocks.iter_mut().enumerate() {
            let start = block_start(block);
            *depths = steps.map(|step| self.depth(start + step));
        }
        rest.iter_mut().zip(steps).for_each(|(depth, step)| *depth = self.depth(block_start(whole) + step));
    }

    /// The depth where the axis, longer than its limb, has `free`.
    #[inline(always)]
    fn depth(&self, free: f64) -> f32 {
        // Not `clamp`: its care for NaN keeps the compiler from packed minima and maxima.
        let above = if free > self.low { free } else { self.low };
        let depth = if above < self.high { above } else { self.high } as f32;
        if self.reciprocal { depth.recip() } else { depth }
    }
}

/// Pixels worked at a time.
const LANES: usize = 8;

/// How many labels at the front are the same.
#[inline(always)]
fn run_length(labels: &[u8]) -> usize {
    let (blocks, rest) = labels.as_chunks::<32>();
    let first = labels[0];
    let whole = blocks.iter().take_while(|block| **block == [first; 32]).count();
    let next = blocks.get(whole).map_or(rest, |block| block);
    whole * 32 + next.iter().take_while(|label| **label == first).count()
}

/// Writes the depth map of a labelled drawing: +inf where there is no limb.
///
/// `labels` and `out` are row-major with `width` columns; `ends` holds two pixel positions a limb, `end_depths` two
/// depths a limb. Rows are worked in parallel; every row depends on its own labels only.
pub fn limb_depth(
    labels: &[u8],
    width: usize,
    ends: &[[DVec2; 2]],
    end_depths: &[[f64; 2]],
    interpolation: Interpolation,
    out: &mut [f32],
) -> Result<(), KernelError> {
    check_length("out", labels.len(), out.len())?;
    check_length("end_depths", ends.len(), end_depths.len())?;
    if width == 0 {
        return Ok(());
    }
    if interpolation == Interpolation::Perspective
        && let Some(index) = end_depths.iter().position(|z| z[0] <= 0.0 || z[1] <= 0.0)
    {
        let problem = "perspective interpolation needs depths in front of the camera, got zero or less,";
        return Err(KernelError::Item { argument: "end_depths", problem, index });
    }
    let axes: Vec<Axis> =
        ends.iter().zip(end_depths).map(|([a, b], [za, zb])| Axis::new(*a, *b, *za, *zb, interpolation)).collect();
    let rows = out.par_chunks_mut(width).zip(labels.par_chunks(width)).enumerate();
    rows.try_for_each(|(row, (out, labels))| limb_depth_row(row, labels, &axes, out)).map_err(|met| {
        first_fault("labels", ABOVE, labels, width, |label| usize::from(*label) <= axes.len()).unwrap_or(met)
    })
}

const ABOVE: &str = "a label above the number of limbs";

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn limb_depth_row(row: usize, labels: &[u8], axes: &[Axis], out: &mut [f32]) -> Result<(), KernelError> {
    let mut column = 0;
    while column < labels.len() {
        let length = run_length(&labels[column..]);
        let depths = &mut out[column..column + length];
        match usize::from(labels[column]).checked_sub(1) {
            None => depths.fill(f32::INFINITY),
            Some(limb) => axes
                .get(limb)
                .ok_or(KernelError::Pixel { argument: "labels", problem: ABOVE, row, column })?
                .fill(row, column, depths),
        }
        column += length;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth_of(labels: &[u8], width: usize, a: DVec2, b: DVec2, z: [f64; 2], how: Interpolation) -> Vec<f32> {
        let mut out = vec![0.0; labels.len()];
        assert_eq!(limb_depth(labels, width, &[[a, b]], &[z], how, &mut out), Ok(()));
        out
    }

    #[test]
    fn runs_linearly_and_clamps_beyond_the_ends() {
        let out = depth_of(&[1; 7], 7, DVec2::new(1., 0.), DVec2::new(5., 0.), [2., 4.], Interpolation::Linear);
        assert_eq!(out, [2.0, 2.0, 2.5, 3.0, 3.5, 4.0, 4.0]);
    }

    #[test]
    fn perspective_is_linear_in_reciprocal_depth() {
        let out = depth_of(&[1; 3], 3, DVec2::ZERO, DVec2::new(2., 0.), [1., 3.], Interpolation::Perspective);
        assert_eq!(out, [1.0, 1.5, 3.0]);
    }

    #[test]
    fn end_on_limb_takes_its_nearer_end_and_background_is_infinite() {
        let out = depth_of(&[0, 1], 2, DVec2::ONE, DVec2::ONE, [5., 3.], Interpolation::Linear);
        assert_eq!(out, [f32::INFINITY, 3.0]);
    }

    #[test]
    fn label_above_the_limbs_is_refused_with_its_place() {
        let mut out = [0.0; 4];
        let got = limb_depth(&[0, 0, 0, 2], 2, &[[DVec2::ZERO; 2]], &[[1.0; 2]], Interpolation::Linear, &mut out);
        assert!(matches!(got, Err(KernelError::Pixel { row: 1, column: 1, .. })));
    }

    #[test]
    fn runs_end_where_the_label_changes_whatever_their_length() {
        for length in 1..100 {
            let labels = [vec![3; length], vec![4; 40]].concat();
            assert_eq!((run_length(&labels), run_length(&labels[..length])), (length, length));
        }
    }
}
