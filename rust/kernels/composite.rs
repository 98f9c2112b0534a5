//! Depth composite of a drawing and a rendered picture.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, equations 16-17, as nearer over farther with premultiplied colours: the same on
//! an opaque render, and without the hole that the printed form cuts where a soft edge of the render is nearer. A
//! render k times larger is composited sample by sample and averaged, so that edges between both stay smooth.

use crate::color::{Conversion, Space};
use crate::composite_block::{BLOCK, Hues, Pixel, Sample, Samples, Sums};
use crate::error::{KernelError, check_length};
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
        let rows = out.as_chunks_mut().0.par_chunks_mut(self.layer.width).enumerate();
        let fine = match (self.scale, self.layer.channels) {
            (1, 3) => rows.map(|(row, out)| self.row::<T, 1, 3>(row, out)).reduce(|| true, |a, b| a & b),
            (1, _) => rows.map(|(row, out)| self.row::<T, 1, 4>(row, out)).reduce(|| true, |a, b| a & b),
            (_, 3) => rows.map(|(row, out)| self.row::<T, 0, 3>(row, out)).reduce(|| true, |a, b| a & b),
            _ => rows.map(|(row, out)| self.row::<T, 0, 4>(row, out)).reduce(|| true, |a, b| a & b),
        };
        if fine { Ok(()) } else { Err(self.fault()) }
    }

    /// Composites one row; tells whether all its values are allowed.
    fn row<T: Pixel, const STEP: usize, const CHANNELS: usize>(&self, row: usize, out: &mut [[T; 4]]) -> bool {
        let (width, scale) = (self.layer.width, self.scale);
        let (mut samples, mut sums, mut hues) = (Samples::EMPTY, Sums::EMPTY, Hues::EMPTY);
        let mut fine = true;
        for (block, out) in out.chunks_mut(BLOCK).enumerate() {
            let (first, count) = (block * BLOCK, out.len());
            let place = row * width + first..row * width + first + count;
            let (alpha, depth) = (&self.layer.alpha[place.clone()], &self.layer.depth[place.clone()]);
            fine &= layer_is_fine(alpha, depth);
            for sub in 0..scale * scale {
                let start = (row * scale + sub / scale) * width * scale + first * scale + sub % scale;
                fine &= samples.read_depth::<STEP>(count, scale, &self.depth[start..]);
                fine &= S::read::<STEP>(&self.samples[start..], count, scale, self.rendered.as_ref(), &mut samples);
                if !S::BYTES {
                    samples.convert(self.conversion, count);
                    if T::CLIPS {
                        samples.clip(count);
                    }
                }
                if sub == 0 {
                    sums.add::<true>(alpha, depth, &samples);
                } else {
                    sums.add::<false>(alpha, depth, &samples);
                }
            }
            hues.read::<CHANNELS>(&self.layer.pixels.as_chunks().0[place], self.drawn.as_ref());
            T::write(&sums, &hues, 1.0 / (scale * scale) as f32, out);
        }
        fine
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

fn depth_is_fine(z: f32) -> bool {
    z > f32::NEG_INFINITY
}

fn layer_is_fine(alpha: &[f32], depth: &[f32]) -> bool {
    let mut fine = true;
    for (&a, &z) in alpha.iter().zip(depth) {
        fine &= (a >= 0.0) & (a <= 1.0) & depth_is_fine(z);
    }
    fine
}
