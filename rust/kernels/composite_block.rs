//! One run of pixels of the depth composite: read, weigh, write, in planes that the compiler turns into vectors.
//!
//! Within a block colours are premultiplied and in 0..=1. No order of floating point sums depends on the machine's
//! vector width, so results are the same bits everywhere.

use crate::color::{Conversion, convert_premultiplied};

/// Pixels worked at a time: all planes together stay in the first-level cache.
pub const BLOCK: usize = 64;

type Plane = [f32; BLOCK];

/// Samples of the render: colour, coverage, depth.
pub struct Samples {
    color: [Plane; 3],
    coverage: Plane,
    depth: Plane,
}

/// Weights of the drawing and light of the render, summed over a pixel's samples.
pub struct Sums {
    drawing: Plane,
    color: [Plane; 3],
    coverage: Plane,
}

impl Samples {
    /// Room for one block.
    pub const EMPTY: Samples = Samples { color: [[0.0; BLOCK]; 3], coverage: [0.0; BLOCK], depth: [0.0; BLOCK] };

    /// Takes every `step`-th depth; tells whether all are allowed (not NaN, not -inf).
    pub fn read_depth<const STEP: usize>(&mut self, count: usize, step: usize, depth: &[f32]) -> bool {
        let mut fine = true;
        for (out, &z) in self.depth[..count].iter_mut().zip(every::<_, STEP>(depth, step)) {
            *out = z;
            fine &= z > f32::NEG_INFINITY;
        }
        fine
    }

    /// Brings the colours to the result's space.
    pub fn convert(&mut self, conversion: Conversion, count: usize) {
        if conversion != Conversion::Keep {
            let color = self.color.each_mut().map(|plane| &mut plane[..count]);
            convert_premultiplied(conversion, color, &self.coverage[..count]);
        }
    }

    /// What a monitor cannot show is cut off before samples are averaged, so that edges of highlights stay smooth.
    pub fn clip(&mut self, count: usize) {
        for plane in &mut self.color {
            plane[..count].iter_mut().for_each(|value| *value = value.clamp(0.0, 1.0));
        }
    }
}

/// Every `STEP`-th value, or every `step`-th where `STEP` is 0.
#[inline(always)]
fn every<T, const STEP: usize>(values: &[T], step: usize) -> impl Iterator<Item = &T> {
    values.iter().step_by(if STEP == 0 { step } else { STEP })
}

/// A type of the render's samples.
pub trait Sample: Copy + Sync {
    /// Whether samples are bytes: straight, within 0..=1 and converted by table.
    const BYTES: bool;

    /// Reads every `step`-th pixel, premultiplied; `table` holds the colour of each byte where it is not byte / 255.
    fn read<const STEP: usize>(
        pixels: &[[Self; 4]],
        count: usize,
        step: usize,
        table: Option<&[f32; 256]>,
        out: &mut Samples,
    ) -> bool;

    /// Whether the values of one pixel are allowed.
    fn allowed(pixel: &[Self; 4]) -> bool;
}

impl Sample for u8 {
    const BYTES: bool = true;

    #[inline(always)]
    fn read<const STEP: usize>(
        pixels: &[[u8; 4]],
        count: usize,
        step: usize,
        table: Option<&[f32; 256]>,
        out: &mut Samples,
    ) -> bool {
        let count = count.min(BLOCK);
        let [red, green, blue] = &mut out.color;
        if let Some(table) = table {
            for (i, pixel) in every::<_, STEP>(pixels, step).take(count).enumerate() {
                let coverage = f32::from(pixel[3]) / 255.0;
                let [r, g, b, _] = pixel.map(|byte| table[usize::from(byte)] * coverage);
                (red[i], green[i], blue[i], out.coverage[i]) = (r, g, b, coverage);
            }
        } else {
            for (i, pixel) in every::<_, STEP>(pixels, step).take(count).enumerate() {
                let [r, g, b, a] = unpack(*pixel);
                let coverage = a * (1.0 / 255.0);
                let scale = coverage * (1.0 / 255.0);
                (red[i], green[i], blue[i], out.coverage[i]) = (r * scale, g * scale, b * scale, coverage);
            }
        }
        true
    }

    fn allowed(_: &[u8; 4]) -> bool {
        true
    }
}

impl Sample for f32 {
    const BYTES: bool = false;

    #[inline(always)]
    fn read<const STEP: usize>(
        pixels: &[[f32; 4]],
        count: usize,
        step: usize,
        _: Option<&[f32; 256]>,
        out: &mut Samples,
    ) -> bool {
        let count = count.min(BLOCK);
        let [red, green, blue] = &mut out.color;
        let mut zero = 0.0;
        for (i, &[r, g, b, a]) in every::<_, STEP>(pixels, step).take(count).enumerate() {
            zero += (r * 0.0 + g * 0.0) + (b * 0.0 + a * 0.0);
            (red[i], green[i], blue[i], out.coverage[i]) = (r, g, b, a.clamp(0.0, 1.0));
        }
        zero == 0.0
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

impl Sums {
    /// Room for one block.
    pub const EMPTY: Sums = Sums { drawing: [0.0; BLOCK], color: [[0.0; BLOCK]; 3], coverage: [0.0; BLOCK] };

    /// Adds one sample of every pixel: nearer over farther, ties to the render (eqs. 16-17, PAPERS.md).
    #[inline(always)]
    pub fn add<const FIRST: bool>(&mut self, alpha: &[f32], depth: &[f32], samples: &Samples) {
        let count = alpha.len().min(BLOCK);
        let (alpha, depth) = (&alpha[..count], &depth[..count]);
        let add = |sum: &mut f32, value: f32| *sum = if FIRST { value } else { *sum + value };
        for i in 0..count {
            let (a, z, covered) = (alpha[i], depth[i], samples.coverage[i]);
            let front = (z < samples.depth[i]) | (z == f32::INFINITY);
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
    pub fn read<const CHANNELS: usize>(&mut self, pixels: &[[u8; CHANNELS]], table: Option<&[f32; 256]>) {
        let count = pixels.len().min(BLOCK);
        let [red, green, blue] = &mut self.0;
        for (i, pixel) in pixels[..count].iter().enumerate() {
            let rgb = match table {
                Some(table) => [0, 1, 2].map(|channel| table[usize::from(pixel[channel])]),
                None => {
                    let [r, g, b, _] = unpack([pixel[0], pixel[1], pixel[2], 0]);
                    [r, g, b].map(|value| value * (1.0 / 255.0))
                }
            };
            [red[i], green[i], blue[i]] = rgb;
        }
    }
}

/// A type of the result's pixels.
pub trait Pixel: Copy + Send {
    /// Whether samples are clipped to what the type can hold.
    const CLIPS: bool;

    /// Writes a block: drawing and render added, divided by the number of samples.
    fn write(sums: &Sums, hues: &Hues, share: f32, out: &mut [[Self; 4]]);
}

impl Pixel for u8 {
    const CLIPS: bool = true;

    #[inline(always)]
    fn write(sums: &Sums, hues: &Hues, share: f32, out: &mut [[u8; 4]]) {
        let count = out.len().min(BLOCK);
        for (i, pixel) in out[..count].iter_mut().enumerate() {
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

    #[inline(always)]
    fn write(sums: &Sums, hues: &Hues, share: f32, out: &mut [[f32; 4]]) {
        let count = out.len().min(BLOCK);
        for (i, pixel) in out[..count].iter_mut().enumerate() {
            let drawing = sums.drawing[i];
            let color = |channel: usize| (hues.0[channel][i] * drawing + sums.color[channel][i]) * share;
            *pixel = [color(0), color(1), color(2), ((drawing + sums.coverage[i]) * share).min(1.0)];
        }
    }
}
