//! Depth composite of a drawing and a rendered picture.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, equations 16-17, as nearer over farther with premultiplied colours: the same on
//! an opaque render, and without the hole that the printed form cuts where a soft edge of the render is nearer. A
//! render k times larger is composited sample by sample and averaged, so that edges between both stay smooth.

use crate::checks::{WANT_ALPHA, WANT_DEPTH, alpha_is_fine, depth_is_fine, first_fault};
use crate::color::{Conversion, Space};
use crate::composite_block::{
    BLOCK, Hues, Pixel, Sample, Samples, Sums, alphas_are_fine, are_zero, block, depths_are_fine,
};
use crate::error::{KernelError, check_length};
use multiversion::multiversion;
use rayon::prelude::*;

/// A drawing: straight RGB or RGBA bytes (its own alpha is not used), coverage, and depth (+inf: none, in front).
#[derive(Clone, Copy)]
pub struct Layer<'a> {
    /// Row-major pixels of `channels` bytes.
    pub pixels: &'a [u8],
    /// 3 or 4.
    pub channels: usize,
    /// Columns.
    pub width: usize,
    /// Coverage of every pixel, 0..=1.
    pub alpha: &'a [f32],
    /// Depth of every pixel.
    pub depth: &'a [f32],
}

/// RGBA of a render: straight bytes, or premultiplied floats.
#[derive(Clone, Copy)]
pub enum Rendered<'a> {
    /// Straight.
    Bytes(&'a [u8]),
    /// Premultiplied.
    Floats(&'a [f32]),
}

/// A render `scale` times as wide and high as the drawing.
#[derive(Clone, Copy)]
pub struct Render<'a> {
    /// The picture.
    pub pixels: Rendered<'a>,
    /// Depth of every sample, +inf where there is nothing.
    pub depth: &'a [f32],
    /// Samples on a pixel's side.
    pub scale: usize,
    /// The space of its colours.
    pub space: Space,
}

/// Where the result goes, as large as the drawing.
pub enum Target<'a> {
    /// Straight.
    Bytes(&'a mut [u8]),
    /// Premultiplied.
    Floats(&'a mut [f32]),
}

/// Composites drawing and render into `out`, whose colours are in `space`. Rows are worked in parallel.
pub fn depth_composite(layer: &Layer, render: &Render, space: Space, out: Target) -> Result<(), KernelError> {
    match (render.pixels, out) {
        (Rendered::Bytes(pixels), Target::Bytes(out)) => Job::new(layer, render, pixels, space)?.run(out),
        (Rendered::Bytes(pixels), Target::Floats(out)) => Job::new(layer, render, pixels, space)?.run(out),
        (Rendered::Floats(pixels), Target::Bytes(out)) => Job::new(layer, render, pixels, space)?.run(out),
        (Rendered::Floats(pixels), Target::Floats(out)) => Job::new(layer, render, pixels, space)?.run(out),
    }
}

/// Pixels worked together where rows do not matter.
const RUN: usize = 64 * BLOCK;

/// Everything that a row needs, sizes checked.
struct Job<'a, S> {
    layer: &'a Layer<'a>,
    samples: &'a [[S; 4]],
    depth: &'a [f32],
    scale: usize,
    conversion: Conversion,
    drawn: Option<[f32; 256]>,
    rendered: Option<[f32; 256]>,
}

impl<'a, S: Sample> Job<'a, S> {
    fn new(layer: &'a Layer, render: &'a Render, pixels: &'a [S], space: Space) -> Result<Self, KernelError> {
        let (count, scale) = (layer.alpha.len(), render.scale);
        if scale == 0 || !matches!(layer.channels, 3 | 4) || (layer.width > 0 && count % layer.width != 0) {
            let problem = "want 3 or 4 channels, whole rows and a render at least as large";
            return Err(KernelError::Argument { argument: "drawing", problem });
        }
        check_length("drawing", count * layer.channels, layer.pixels.len())?;
        check_length("drawing_depth", count, layer.depth.len())?;
        check_length("rendered", count * scale * scale * 4, pixels.len())?;
        check_length("rendered_depth", count * scale * scale, render.depth.len())?;
        let table = |from| Some(Conversion::between(from, space)).filter(|how| *how != Conversion::Keep);
        Ok(Job {
            layer,
            samples: pixels.as_chunks().0,
            depth: render.depth,
            scale,
            conversion: Conversion::between(render.space, space),
            drawn: table(Space::Display).map(Conversion::bytes),
            rendered: table(render.space).map(Conversion::bytes),
        })
    }

    fn run<T: Pixel>(&self, out: &mut [T]) -> Result<(), KernelError> {
        check_length("out", self.layer.alpha.len() * 4, out.len())?;
        if out.is_empty() {
            return Ok(());
        }
        let width = if self.scale == 1 { RUN } else { self.layer.width };
        let rows = out.as_chunks_mut().0.par_chunks_mut(width).enumerate();
        let fine = if self.layer.channels == 3 {
            rows.map(|(row, out)| composite_row::<S, T, 3>(self, row, width, out)).reduce(|| true, |a, b| a & b)
        } else {
            rows.map(|(row, out)| composite_row::<S, T, 4>(self, row, width, out)).reduce(|| true, |a, b| a & b)
        };
        if fine { Ok(()) } else { Err(self.fault()) }
    }

    /// The first value that is not allowed.
    fn fault(&self) -> KernelError {
        let (layer, width, large) = (self.layer, self.layer.width, self.layer.width * self.scale);
        first_fault("alpha", WANT_ALPHA, layer.alpha, width, |a| alpha_is_fine(*a))
            .or_else(|| first_fault("drawing_depth", WANT_DEPTH, layer.depth, width, |z| depth_is_fine(*z)))
            .or_else(|| first_fault("rendered", "want finite colours", self.samples, large, S::allowed))
            .or_else(|| first_fault("rendered_depth", WANT_DEPTH, self.depth, large, |z| depth_is_fine(*z)))
            .unwrap_or(KernelError::Argument { argument: "rendered", problem: "changed while it was read" })
    }
}

/// Composites one row of `width` pixels; tells whether all its values are allowed.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn composite_row<S: Sample, T: Pixel, const CHANNELS: usize>(
    job: &Job<S>,
    row: usize,
    width: usize,
    out: &mut [[T; 4]],
) -> bool {
    let (layer, scale) = (job.layer, job.scale);
    let mut spare = Spare::<S, T, CHANNELS>::new();
    let (mut samples, mut sums, mut hues) = (Samples::EMPTY, Sums::EMPTY, Hues::EMPTY);
    let mut fine = true;
    for (index, out) in out.chunks_mut(BLOCK).enumerate() {
        let (first, count) = (index * BLOCK, out.len());
        let place = row * width + first;
        let alpha = block(&layer.alpha[place..], 1, count, &mut spare.alpha);
        let depth = block(&layer.depth[place..], 1, count, &mut spare.depth);
        fine &= alphas_are_fine(alpha) & depths_are_fine(depth);
        if are_zero(alpha) {
            // Most of a picture shows neither drawing nor render.
            let rows = (0..scale).map(|sub| (row * scale + sub) * width * scale + first * scale);
            let mut rows = rows.map(|start| start..start + count * scale);
            if rows.clone().all(|samples| S::are_zero(&job.samples[samples])) {
                fine &= rows.all(|samples| depths_are_fine(&job.depth[samples]));
                out.fill(T::NONE);
                continue;
            }
        }
        for sub in 0..scale * scale {
            let start = (row * scale + sub / scale) * width * scale + first * scale + sub % scale;
            let rendered = block(&job.depth[start..], scale, count, &mut spare.rendered);
            let pixels = block(&job.samples[start..], scale, count, &mut spare.samples);
            fine &= depths_are_fine(rendered) & S::read(pixels, job.rendered.as_ref(), &mut samples);
            if !S::BYTES {
                samples.convert(job.conversion);
                if T::CLIPS {
                    samples.clip();
                }
            }
            if sub == 0 {
                sums.add::<true>(alpha, depth, &samples, rendered);
            } else {
                sums.add::<false>(alpha, depth, &samples, rendered);
            }
        }
        let drawing = &layer.pixels.as_chunks().0[place..];
        hues.read::<CHANNELS>(block(drawing, 1, count, &mut spare.drawing), job.drawn.as_ref());
        let share = 1.0 / (scale * scale) as f32;
        if let Ok(whole) = out.try_into() {
            T::write(&sums, &hues, share, whole);
        } else {
            T::write(&sums, &hues, share, &mut spare.out);
            out.copy_from_slice(&spare.out[..count]);
        }
    }
    fine
}

/// Where values are put together that do not lie in memory as a whole block.
struct Spare<S, T, const CHANNELS: usize> {
    alpha: [f32; BLOCK],
    depth: [f32; BLOCK],
    rendered: [f32; BLOCK],
    samples: [[S; 4]; BLOCK],
    drawing: [[u8; CHANNELS]; BLOCK],
    out: [[T; 4]; BLOCK],
}

impl<S: Sample, T: Pixel, const CHANNELS: usize> Spare<S, T, CHANNELS> {
    fn new() -> Self {
        Spare {
            alpha: [0.0; BLOCK],
            depth: [0.0; BLOCK],
            rendered: [0.0; BLOCK],
            samples: [S::NONE; BLOCK],
            drawing: [[0; CHANNELS]; BLOCK],
            out: [T::NONE; BLOCK],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(alpha: f32, z: f32, rendered: [f32; 4], rendered_depth: f32) -> [f32; 4] {
        let (alpha, depth, rendered_depth, mut out) = ([alpha], [z], [rendered_depth], [9.0; 4]);
        let layer = Layer { pixels: &[255, 0, 255], channels: 3, width: 1, alpha: &alpha, depth: &depth };
        let pixels = Rendered::Floats(&rendered);
        let render = Render { pixels, depth: &rendered_depth, scale: 1, space: Space::Display };
        assert_eq!(depth_composite(&layer, &render, Space::Display, Target::Floats(&mut out)), Ok(()));
        out
    }

    #[test]
    fn nearer_is_over_farther_and_ties_go_to_the_render() {
        let render = [0.25, 0.5, 0.0, 0.5];
        assert_eq!(one(0.5, 1.0, render, 2.0), [0.625, 0.25, 0.5, 0.75]);
        assert_eq!(one(0.5, 3.0, render, 2.0), [0.5, 0.5, 0.25, 0.75]);
        assert_eq!(one(0.5, 2.0, render, 2.0), one(0.5, 3.0, render, 2.0));
        assert_eq!(one(0.5, f32::INFINITY, render, 2.0), one(0.5, 1.0, render, 2.0));
    }

    #[test]
    fn an_opaque_plate_stays_exactly_opaque_and_coverage_beyond_one_is_cut() {
        for step in 0..=1000u16 {
            let alpha = f32::from(step) / 1000.0;
            for z in [1.0, 3.0] {
                assert_eq!(one(alpha, z, [0.5, 0.5, 0.5, 1.0], 2.0)[3], 1.0);
                assert_eq!(one(alpha, z, [0.5, 0.5, 0.5, 4.0], 2.0)[3], 1.0);
                assert!(one(1.0, z, [0.0, 0.0, 0.0, alpha], 2.0)[3] <= 1.0);
            }
        }
    }

    #[test]
    fn a_block_across_the_end_of_a_row_is_the_same_as_pixel_by_pixel() {
        let count = 3 * BLOCK + 7;
        let value = |i: usize, by: usize| (i * by % 256) as u8;
        let drawing: Vec<u8> = (0..count * 4).map(|i| value(i, 37)).collect();
        let rendered: Vec<u8> = (0..count * 4).map(|i| value(i, 91)).collect();
        let planes = [11, 13, 17].map(|by| (0..count).map(|i| f32::from(value(i, by)) / 255.0).collect::<Vec<_>>());
        let composite = |place: std::ops::Range<usize>, out: &mut [u8]| {
            let [alpha, depth, rendered_depth] = planes.each_ref().map(|plane| &plane[place.clone()]);
            let bytes = place.start * 4..place.end * 4;
            let layer = Layer { pixels: &drawing[bytes.clone()], channels: 4, width: place.len(), alpha, depth };
            let pixels = Rendered::Bytes(&rendered[bytes]);
            let render = Render { pixels, depth: rendered_depth, scale: 1, space: Space::Display };
            assert_eq!(depth_composite(&layer, &render, Space::Display, Target::Bytes(out)), Ok(()));
        };
        let (mut whole, mut single) = (vec![0; count * 4], vec![0; count * 4]);
        composite(0..count, &mut whole);
        single.chunks_mut(4).enumerate().for_each(|(i, out)| composite(i..i + 1, out));
        assert_eq!(whole, single);
    }

    #[test]
    fn wrong_sizes_are_refused() {
        let layer = Layer { pixels: &[0; 6], channels: 3, width: 2, alpha: &[0.0; 2], depth: &[0.0; 2] };
        let render = Render { pixels: Rendered::Bytes(&[0; 8]), depth: &[0.0; 8], scale: 2, space: Space::Display };
        let got = depth_composite(&layer, &render, Space::Display, Target::Bytes(&mut [0; 8]));
        assert_eq!(got, Err(KernelError::Length { argument: "rendered", wanted: 32, got: 8 }));
    }
}
