//! One run of pixels of the depth composite: read, weigh, write, in planes that the compiler turns into vectors.
//!
//! Within a block colours are premultiplied and in 0..=1. No order of floating point sums depends on the machine's
//! vector width, so results are the same bits everywhere.

use crate::checks::{alpha_is_fine, depth_is_fine, in_front};
use crate::color::{Conversion, convert_premultiplied};

/// Pixels worked at a time: all planes together stay in the first-level cache.
pub const BLOCK: usize = 64;

type Plane = [f32; BLOCK];

/// `BLOCK` values, every `step`-th of `values`, as they lie in memory where possible; `spare` fills up a short block.
#[inline(always)]
pub fn block<'a, T: Copy>(values: &'a [T], step: usize, count: usize, spare: &'a mut [T; BLOCK]) -> &'a [T; BLOCK] {
    if step == 1
        && count == BLOCK
        && let Some(whole) = values.first_chunk()
    {
        return whole;
    }
    spare.iter_mut().zip(values.iter().step_by(step)).take(count).for_each(|(slot, value)| *slot = *value);
    spare
}

/// Whether all depths are allowed: not NaN, not -inf.
#[inline(always)]
pub fn depths_are_fine(depth: &[f32]) -> bool {
    depth.iter().fold(true, |fine, &z| fine & depth_is_fine(z))
}

/// Whether all of a drawing's alphas are in 0..=1.
#[inline(always)]
pub fn alphas_are_fine(alpha: &Plane) -> bool {
    alpha.iter().fold(true, |fine, &a| fine & alpha_is_fine(a))
}

/// Whether all values are 0.
#[inline(always)]
pub fn are_zero(values: &[f32]) -> bool {
    values.iter().fold(0, |bits, value| bits | value.to_bits()) == 0
}

/// Samples of the render: premultiplied colour, and coverage.
pub struct Samples {
    color: [Plane; 3],
    coverage: Plane,
}

impl Samples {
    /// Room for one block.
    pub const EMPTY: Samples = Samples { color: [[0.0; BLOCK]; 3], coverage: [0.0; BLOCK] };

    /// Brings the colours to the result's space.
    #[inline(always)]
    pub fn convert(&mut self, conversion: Conversion) {
        convert_premultiplied(conversion, &mut self.color, &self.coverage);
    }

    /// What a monitor cannot show is cut off before samples are averaged, so that edges of highlights stay smooth.
    #[inline(always)]
    pub fn clip(&mut self) {
        for plane in &mut self.color {
            plane.iter_mut().for_each(|value| *value = value.clamp(0.0, 1.0));
        }
    }
}

/// A type of the render's samples.
pub trait Sample: Copy + Sync {
    /// Whether samples are bytes: straight, within 0..=1 and converted by table.
    const BYTES: bool;

    /// No light.
    const NONE: [Self; 4];

    /// Reads a block, premultiplied; `table` holds the colour of each byte where it is not byte / 255. Tells whether
    /// all values are allowed.
    fn read(pixels: &[[Self; 4]; BLOCK], table: Option<&[f32; 256]>, out: &mut Samples) -> bool;

    /// Whether all values of all pixels are 0.
    fn are_zero(pixels: &[[Self; 4]]) -> bool;

    /// Whether the values of one pixel are allowed.
    fn allowed(pixel: &[Self; 4]) -> bool;
}

impl Sample for u8 {
    const BYTES: bool = true;
    const NONE: [u8; 4] = [0; 4];

    #[inline(always)]
    fn read(pixels: &[[u8; 4]; BLOCK], table: Option<&[f32; 256]>, out: &mut Samples) -> bool {
        let [red, green, blue] = &mut out.color;
        for (i, pixel) in pixels.iter().enumerate() {
            let [r, g, b, a] = unpack(*pixel);
            let coverage = a * (1.0 / 255.0);
            let scale = coverage * (1.0 / 255.0);
            (red[i], green[i], blue[i], out.coverage[i]) = (r * scale, g * scale, b * scale, coverage);
        }
        if let Some(table) = table {
            for (i, pixel) in pixels.iter().enumerate() {
                let [r, g, b, _] = pixel.map(|byte| table[usize::from(byte)] * out.coverage[i]);
                (red[i], green[i], blue[i]) = (r, g, b);
            }
        }
        true
    }

    #[inline(always)]
    fn are_zero(pixels: &[[u8; 4]]) -> bool {
        pixels.iter().fold(0, |bits, pixel| bits | u32::from_ne_bytes(*pixel)) == 0
    }

    fn allowed(_: &[u8; 4]) -> bool {
        true
    }
}

impl Sample for f32 {
    const BYTES: bool = false;
    const NONE: [f32; 4] = [0.0; 4];

    #[inline(always)]
    fn read(pixels: &[[f32; 4]; BLOCK], _: Option<&[f32; 256]>, out: &mut Samples) -> bool {
        let [red, green, blue] = &mut out.color;
        for (i, &[r, g, b, a]) in pixels.iter().enumerate() {
            (red[i], green[i], blue[i], out.coverage[i]) = (r, g, b, a.clamp(0.0, 1.0));
        }
        pixels.as_flattened().iter().fold(true, |fine, value| fine & value.is_finite())
    }

    #[inline(always)]
    fn are_zero(pixels: &[[f32; 4]]) -> bool {
        are_zero(pixels.as_flattened())
    }

    fn allowed(pixel: &[f32; 4]) -> bool {
        pixel.iter().all(|value| value.is_finite())
    }
}

#[inline(always)]
fn unpack(pixel: [u8; 4]) -> [f32; 4] {
    // Through one word, and through i32: SSE2 converts nothing narrower, and no unsigned word.
    let word = u32::from_le_bytes(pixel);
    [0, 8, 16, 24].map(|shift| ((word >> shift) & 0xff) as i32 as f32)
}

/// Weights of the drawing and light of the render, summed over a pixel's samples.
pub struct Sums {
    drawing: Plane,
    color: [Plane; 3],
    coverage: Plane,
}

impl Sums {
    /// Room for one block.
    pub const EMPTY: Sums = Sums { drawing: [0.0; BLOCK], color: [[0.0; BLOCK]; 3], coverage: [0.0; BLOCK] };

    /// Adds one sample of every pixel: nearer over farther, ties to the render (eqs. 16-17, PAPERS.md).
    #[inline(always)]
    pub fn add<const FIRST: bool>(&mut self, alpha: &Plane, depth: &Plane, samples: &Samples, rendered: &Plane) {
        let add = |sum: &mut f32, value: f32| *sum = if FIRST { value } else { *sum + value };
        for i in 0..BLOCK {
            let (a, z, covered) = (alpha[i], depth[i], samples.coverage[i]);
            let front = in_front(z, rendered[i]);
            let drawing = if front { a } else { a - a * covered };
            let render = if front { 1.0 - a } else { 1.0 };
            add(&mut self.drawing[i], drawing);
            add(&mut self.coverage[i], render * covered);
            for (sum, plane) in self.color.iter_mut().zip(&samples.color) {
                add(&mut sum[i], render * plane[i]);
            }
        }
    }
}

/// Straight colours of the drawing's pixels, 0..=1.
pub struct Hues([Plane; 3]);

impl Hues {
    /// Room for one block.
    pub const EMPTY: Hues = Hues([[0.0; BLOCK]; 3]);

    /// Reads pixels of `CHANNELS` bytes; `table` as in [`Sample::read`].
    #[inline(always)]
    pub fn read<const CHANNELS: usize>(&mut self, pixels: &[[u8; CHANNELS]; BLOCK], table: Option<&[f32; 256]>) {
        let [red, green, blue] = &mut self.0;
        if let Some(table) = table {
            for (i, pixel) in pixels.iter().enumerate() {
                [red[i], green[i], blue[i]] = [0, 1, 2].map(|channel| table[usize::from(pixel[channel])]);
            }
        } else {
            for (i, pixel) in pixels.iter().enumerate() {
                let last = if CHANNELS == 4 { pixel[CHANNELS - 1] } else { 0 };
                let [r, g, b, _] = unpack([pixel[0], pixel[1], pixel[2], last]);
                [red[i], green[i], blue[i]] = [r, g, b].map(|value| value * (1.0 / 255.0));
            }
        }
    }
}

/// A type of the result's pixels.
pub trait Pixel: Copy + Send {
    /// Whether samples are clipped to what the type can hold.
    const CLIPS: bool;

    /// An empty pixel.
    const NONE: [Self; 4];

    /// Writes a block: drawing and render added, divided by the number of samples.
    fn write(sums: &Sums, hues: &Hues, share: f32, out: &mut [[Self; 4]; BLOCK]);
}

impl Pixel for u8 {
    const CLIPS: bool = true;
    const NONE: [u8; 4] = [0; 4];

    #[inline(always)]
    fn write(sums: &Sums, hues: &Hues, share: f32, out: &mut [[u8; 4]; BLOCK]) {
        for (i, pixel) in out.iter_mut().enumerate() {
            let drawing = sums.drawing[i];
            let coverage = drawing + sums.coverage[i];
            let scale = if coverage > 0.0 { 255.0 / coverage } else { 0.0 };
            let straight = |channel: usize| {
                let value = (hues.0[channel][i] * drawing + sums.color[channel][i]) * scale;
                nearest(if value < 255.0 { value } else { 255.0 })
            };
            let word = straight(0) | straight(1) << 8 | straight(2) << 16 | nearest(coverage * (255.0 * share)) << 24;
            *pixel = word.to_le_bytes();
        }
    }
}

/// The nearest whole number of a value in 0..=255: adding 2^23 leaves it in the lowest bits.
#[inline(always)]
fn nearest(value: f32) -> u32 {
    (value + 8_388_608.0).to_bits() & 0xff
}

impl Pixel for f32 {
    const CLIPS: bool = false;
    const NONE: [f32; 4] = [0.0; 4];

    #[inline(always)]
    fn write(sums: &Sums, hues: &Hues, share: f32, out: &mut [[f32; 4]; BLOCK]) {
        for (i, pixel) in out.iter_mut().enumerate() {
            let drawing = sums.drawing[i];
            let color = |channel: usize| (hues.0[channel][i] * drawing + sums.color[channel][i]) * share;
            *pixel = [color(0), color(1), color(2), ((drawing + sums.coverage[i]) * share).min(1.0)];
        }
    }
}
