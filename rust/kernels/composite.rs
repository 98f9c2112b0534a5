//! Depth composite of a drawing and a rendered picture.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, equations 16-17, as nearer over farther with premultiplied colours: the same on
//! an opaque render, and without the hole that the printed form cuts where a soft edge of the render is nearer. A
//! render k times larger is composited sample by sample and averaged, so that edges between both stay smooth.

use crate::color::{Conversion, Space};
use crate::composite_block::{BLOCK, Hues, Pixel, Sample, Samples, Sums, alphas_are_fine, block, depths_are_fine};
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
        let (layer, width) = (self.layer, self.layer.width);
        let pixel = |argument, problem, index: Option<usize>, width: usize| {
            index.map(|index| KernelError::Pixel { argument, problem, row: index / width, column: index % width })
        };
        let depth = "want metres or +inf, got NaN or -inf";
        let alpha = layer.alpha.iter().position(|a| !(0.0..=1.0).contains(a));
        let drawn = layer.depth.iter().position(|z| !depth_is_fine(*z));
        let sample = self.samples.iter().position(|sample| !S::allowed(sample));
        let rendered = self.depth.iter().position(|z| !depth_is_fine(*z));
        pixel("alpha", "want 0 to 1", alpha, width)
            .or_else(|| pixel("drawing_depth", depth, drawn, width))
            .or_else(|| pixel("rendered", "want finite colours", sample, width * self.scale))
            .or_else(|| pixel("rendered_depth", depth, rendered, width * self.scale))
            .unwrap_or(KernelError::Argument { argument: "rendered", problem: "changed while it was read" })
    }
}

/// Composites one row of `width` pixels; tells whether all its values are allowed.
#[multiversion(targets("x86_64+avx2"))]
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

fn depth_is_fine(z: f32) -> bool {
    z > f32::NEG_INFINITY
}
