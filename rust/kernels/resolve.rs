//! Makes passes k times smaller: colours and coverage are averaged, depth and object are the nearest sample's.

use crate::error::{KernelError, check_length};
use crate::raster::Passes;
use glam::Vec4;
use rayon::prelude::*;

/// Passes to read, row-major, of one size.
#[derive(Clone, Copy)]
pub struct Samples<'a> {
    /// Premultiplied RGBA.
    pub beauty: &'a [[f32; 4]],
    /// Planar depth, +inf background.
    pub depth: &'a [f32],
    /// 0 to 1.
    pub coverage: &'a [f32],
    /// 0 background.
    pub object_id: &'a [u16],
}

/// Resolves `factor` x `factor` samples a pixel; `width` is the smaller picture's. Of equally near samples the first
/// counts.
pub fn resolve(samples: Samples<'_>, width: usize, factor: usize, mut out: Passes<'_>) -> Result<(), KernelError> {
    let size = out.depth.len();
    out.check(size)?;
    let wanted = size * factor * factor;
    check_length("beauty", wanted, samples.beauty.len())?;
    check_length("depth", wanted, samples.depth.len())?;
    check_length("coverage", wanted, samples.coverage.len())?;
    check_length("object_id", wanted, samples.object_id.len())?;
    out.bands(width.max(1)).enumerate().try_for_each(|(row, mut out)| {
        out.beauty.fill([0.0; 4]);
        out.depth.fill(f32::INFINITY);
        out.coverage.fill(0.0);
        out.object_id.fill(0);
        for line in row * factor..(row + 1) * factor {
            samples.line(line, width * factor).check(line)?.add_to(factor, &mut out);
        }
        let scale = ((factor * factor) as f32).recip();
        out.beauty.iter_mut().for_each(|color| *color = (Vec4::from_array(*color) * scale).to_array());
        out.coverage.iter_mut().for_each(|coverage| *coverage *= scale);
        Ok(())
    })
}

impl<'a> Samples<'a> {
    fn line(&self, row: usize, columns: usize) -> Samples<'a> {
        let line = row * columns..(row + 1) * columns;
        Samples {
            beauty: &self.beauty[line.clone()],
            depth: &self.depth[line.clone()],
            coverage: &self.coverage[line.clone()],
            object_id: &self.object_id[line],
        }
    }

    fn check(self, row: usize) -> Result<Self, KernelError> {
        let refuse = |argument, problem, column| Err(KernelError::Pixel { argument, problem, row, column });
        if let Some(value) = first(self.beauty.as_flattened(), |value| !value.is_finite()) {
            return refuse("beauty", "want finite numbers, got another", value / 4);
        }
        if let Some(column) = first(self.coverage, |value| !value.is_finite()) {
            return refuse("coverage", "want finite numbers, got another", column);
        }
        match first(self.depth, f32::is_nan) {
            Some(column) => refuse("depth", "want depths, got NaN", column),
            None => Ok(self),
        }
    }

    /// Adds one line of samples to the sums and nearest samples of its pixels.
    fn add_to(self, factor: usize, out: &mut Passes<'_>) {
        for (sum, colors) in out.beauty.iter_mut().zip(self.beauty.chunks_exact(factor)) {
            let total = colors.iter().fold(Vec4::from_array(*sum), |sum, color| sum + Vec4::from_array(*color));
            *sum = total.to_array();
        }
        for (sum, coverages) in out.coverage.iter_mut().zip(self.coverage.chunks_exact(factor)) {
            *sum = coverages.iter().fold(*sum, |sum, coverage| sum + coverage);
        }
        let samples = self.depth.chunks_exact(factor).zip(self.object_id.chunks_exact(factor));
        for ((depths, objects), nearest) in samples.zip(out.depth.iter_mut().zip(out.object_id.iter_mut())) {
            for (depth, object) in depths.iter().zip(objects) {
                if depth < nearest.0 {
                    (*nearest.0, *nearest.1) = (*depth, *object);
                }
            }
        }
    }
}

/// The place of the first wrong value; without one the values are read without branches.
fn first(values: &[f32], wrong: impl Fn(f32) -> bool) -> Option<usize> {
    if !values.iter().fold(false, |any, value| any | wrong(*value)) {
        return None;
    }
    values.iter().position(|value| wrong(*value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolved(depth: &[f32], object_id: &[u16], coverage: &[f32], width: usize) -> Result<[f32; 3], KernelError> {
        let beauty: Vec<[f32; 4]> = coverage.iter().map(|c| [*c; 4]).collect();
        let samples = Samples { beauty: &beauty, depth, coverage, object_id };
        let (mut color, mut z, mut cover, mut object) = ([[9.0; 4]], [9.0], [9.0], [9]);
        let out = Passes { beauty: &mut color, depth: &mut z, coverage: &mut cover, object_id: &mut object };
        resolve(samples, width, 2, out)?;
        assert_eq!(color[0], [cover[0]; 4]);
        Ok([z[0], f32::from(object[0]), cover[0]])
    }

    #[test]
    fn the_nearest_sample_gives_depth_and_object_and_the_first_of_equals() {
        let inf = f32::INFINITY;
        assert_eq!(resolved(&[inf, 3.0, 2.0, 2.0], &[0, 7, 8, 9], &[0.0, 1.0, 1.0, 1.0], 1), Ok([2.0, 8.0, 0.75]));
        assert_eq!(resolved(&[inf; 4], &[0; 4], &[0.0; 4], 1), Ok([inf, 0.0, 0.0]));
    }

    #[test]
    fn what_is_no_number_is_named_with_its_place() {
        let got = resolved(&[1.0, 1.0, f32::NAN, 1.0], &[1; 4], &[1.0; 4], 1);
        assert!(matches!(got, Err(KernelError::Pixel { argument: "depth", row: 1, column: 0, .. })));
        let got = resolved(&[1.0; 4], &[1; 4], &[1.0, f32::INFINITY, 1.0, 1.0], 1);
        assert!(matches!(got, Err(KernelError::Pixel { argument: "beauty", row: 0, column: 1, .. })));
        let got = resolved(&[1.0; 3], &[1; 3], &[1.0; 3], 1);
        assert!(matches!(got, Err(KernelError::Length { .. })));
    }
}
