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
pub fn resolve(samples: Samples<'_>, width: usize, factor: usize, out: Passes<'_>) -> Result<(), KernelError> {
    let size = out.depth.len();
    let wanted = size * factor * factor;
    check_length("beauty", wanted, samples.beauty.len())?;
    check_length("depth", wanted, samples.depth.len())?;
    check_length("coverage", wanted, samples.coverage.len())?;
    check_length("object_id", wanted, samples.object_id.len())?;
    check_length("beauty", size, out.beauty.len())?;
    check_length("coverage", size, out.coverage.len())?;
    check_length("object_id", size, out.object_id.len())?;
    if let Some(place) = samples.depth.par_iter().position_first(|z| z.is_nan()) {
        let columns = width * factor;
        let (row, column) = (place / columns, place % columns);
        return Err(KernelError::Pixel { argument: "depth", problem: "not a number", row, column });
    }
    let width = width.max(1);
    let colors = out.beauty.par_chunks_mut(width).zip(out.depth.par_chunks_mut(width));
    let others = out.coverage.par_chunks_mut(width).zip(out.object_id.par_chunks_mut(width));
    colors.zip(others).enumerate().for_each(|(row, ((beauty, depth), (coverage, object_id)))| {
        resolve_row(samples, row, factor, Passes { beauty, depth, coverage, object_id });
    });
    Ok(())
}

fn resolve_row(samples: Samples<'_>, row: usize, factor: usize, out: Passes<'_>) {
    let columns = out.depth.len() * factor;
    let scale = ((factor * factor) as f32).recip();
    for column in 0..out.depth.len() {
        let (mut beauty, mut coverage) = (Vec4::ZERO, 0.0);
        let (mut depth, mut object) = (f32::INFINITY, 0);
        for line in 0..factor {
            let start = (row * factor + line) * columns + column * factor;
            for at in start..start + factor {
                beauty += Vec4::from_array(samples.beauty[at]);
                coverage += samples.coverage[at];
                if samples.depth[at] < depth {
                    (depth, object) = (samples.depth[at], samples.object_id[at]);
                }
            }
        }
        out.beauty[column] = (beauty * scale).to_array();
        out.coverage[column] = coverage * scale;
        (out.depth[column], out.object_id[column]) = (depth, object);
    }
}
