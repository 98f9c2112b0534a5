//! A texture made ready for bilinear reading: premultiplied, cut to what is used, its last row and column doubled.
//!
//! Colours are kept as colour times alpha, both in 0..255, and alpha times 255: integers that 16 bits hold exactly, so
//! that a texture read at its own pixel centres comes back to the bit.

use crate::error::{KernelError, check_length};
use glam::{DVec2, I64Vec2, IVec2};
use multiversion::multiversion;
use rayon::prelude::*;

/// What full coverage is in the units kept here.
pub const FULL: f32 = 255.0 * 255.0;

/// A straight RGBA picture.
#[derive(Debug, Clone, Copy)]
pub struct Texture<'a> {
    /// Row-major.
    pub pixels: &'a [[u8; 4]],
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Parts of a pixel in which places are counted.
const PARTS: f64 = 65536.0;

/// Largest side of what is read: its places fit 32 bits.
const LARGEST_SIDE: usize = 1 << 14;

/// Places read at a time.
pub const LANES: usize = 16;

/// The part of a texture between two corners, premultiplied.
#[derive(Debug)]
pub struct Texels {
    data: Vec<[u16; 4]>,
    stride: u32,
    origin: DVec2,
    limit: DVec2,
}

/// A run of places with even steps, kept within bounds, in parts of a pixel.
#[derive(Debug, Clone, Copy)]
pub struct Run {
    start: IVec2,
    step: IVec2,
    low: IVec2,
    high: IVec2,
}

/// Places among the texels: the upper left one of four, and the shares of the others.
#[derive(Debug)]
pub struct Found {
    at: [u32; LANES],
    x: [f32; LANES],
    y: [f32; LANES],
}

impl Texels {
    /// Prepares what lies between `low` and `high`, in pixels of the texture.
    pub fn new(texture: Texture<'_>, low: DVec2, high: DVec2) -> Result<Self, KernelError> {
        let Texture { pixels, width, height } = texture;
        check_length("texture", width * height, pixels.len())?;
        if pixels.is_empty() || width.max(height) > LARGEST_SIDE {
            return Err(KernelError::Argument { argument: "texture", problem: "want 1 to 16384 pixels a side" });
        }
        let last = DVec2::new((width - 1) as f64, (height - 1) as f64);
        let (low, high) = (low.clamp(DVec2::ZERO, last).floor(), high.clamp(DVec2::ZERO, last).ceil());
        let [left, top, right, bottom] = [low.x, low.y, high.x, high.y].map(|side| side as usize);
        let stride = right - left + 2;
        let mut data = vec![[0; 4]; stride * (bottom - top + 2)];
        data.par_chunks_mut(stride).enumerate().for_each(|(row, out)| {
            let from = &pixels[(top + row).min(bottom) * width..][left..=right];
            premultiply(from, out);
            out[stride - 1] = out[stride - 2];
        });
        Ok(Texels { data, stride: stride as u32, origin: low, limit: high - low })
    }

    /// A place of the texture, moved to this part.
    pub fn local(&self, place: DVec2) -> DVec2 {
        place - self.origin
    }

    /// The nearest place that this part has, in parts of a pixel.
    pub fn clamped(&self, place: DVec2) -> IVec2 {
        parts(place.clamp(DVec2::ZERO, self.limit))
    }

    /// Where the places of a run are among the texels.
    #[inline(always)]
    pub fn look_up(&self, run: Run) -> Found {
        let mut found = Found { at: [0; LANES], x: [0.0; LANES], y: [0.0; LANES] };
        for i in 0..LANES {
            let u = (run.start.x + run.step.x * i as i32).max(run.low.x).min(run.high.x);
            let v = (run.start.y + run.step.y * i as i32).max(run.low.y).min(run.high.y);
            found.at[i] = (v >> 16) as u32 * self.stride + (u >> 16) as u32;
            found.x[i] = (u & 0xFFFF) as f32 * (1.0 / PARTS as f32);
            found.y[i] = (v & 0xFFFF) as f32 * (1.0 / PARTS as f32);
        }
        found
    }

    /// The premultiplied colour, of which `FULL` is one, at one of the places.
    #[inline(always)]
    pub fn read(&self, found: &Found, lane: usize) -> [f32; 4] {
        self.mix(found.at[lane] as usize, found.x[lane], found.y[lane])
    }

    /// The mean of four texels: the one at `at`, to its right, below, and both.
    #[inline(always)]
    fn mix(&self, at: usize, x: f32, y: f32) -> [f32; 4] {
        // One window over both rows: one bounds check.
        let window = self.data.get(at..at + self.stride as usize + 2).unwrap_or_default();
        let (Some([a, b]), Some([c, d])) = (window.first_chunk(), window.last_chunk()) else { return [0.0; 4] };
        let between = |from: f32, to: f32, share: f32| from + (to - from) * share;
        std::array::from_fn(|k| {
            let left = between(f32::from(a[k]), f32::from(c[k]), y);
            between(left, between(f32::from(b[k]), f32::from(d[k]), y), x)
        })
    }
}

/// A place, or a step from place to place, in parts of a pixel.
fn parts(place: DVec2) -> IVec2 {
    (place * PARTS).round().as_ivec2()
}

/// How places of a texture follow the pixels of a picture: linear, in 2^-32 of a texture's pixel.
#[derive(Debug, Clone, Copy)]
pub struct Ramp {
    origin: I64Vec2,
    along_x: I64Vec2,
    along_y: I64Vec2,
    step: IVec2,
}

impl Ramp {
    /// What bounds a step in the texture from pixel to pixel: `LANES` of them fit 32 bits.
    const STEEPEST: f64 = 512.0;

    /// The ramp that has `place` at `pixel` and changes by so much along the picture's axes.
    pub fn new(pixel: DVec2, place: DVec2, along_x: DVec2, along_y: DVec2) -> Self {
        let fixed = |value: DVec2, most: f64| {
            let most = DVec2::splat(most);
            (value.clamp(-most, most) * (1u64 << 32) as f64).round().as_i64vec2()
        };
        let slope = |change: DVec2| if change.is_finite() { change } else { DVec2::ZERO };
        let (along_x, along_y) = (slope(along_x), slope(along_y));
        let origin = slope(place - along_x * pixel.x - along_y * pixel.y);
        let most = DVec2::splat(Self::STEEPEST);
        Ramp {
            origin: fixed(origin, (1 << 27) as f64),
            along_x: fixed(along_x, Self::STEEPEST),
            along_y: fixed(along_y, Self::STEEPEST),
            step: parts(along_x.clamp(-most, most)),
        }
    }

    /// The run of places from a pixel to the right, kept within bounds.
    #[inline(always)]
    pub fn run(&self, column: usize, row: i64, low: IVec2, high: IVec2) -> Run {
        let place = self.origin + self.along_x * column as i64 + self.along_y * row + I64Vec2::splat(1 << 15);
        // A place farther out than that is bounded anyway.
        let near: I64Vec2 = place >> 16;
        let start = near.clamp(I64Vec2::splat(-(1 << 30)), I64Vec2::splat(1 << 30)).as_ivec2();
        Run { start, step: self.step, low, high }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn premultiply(from: &[[u8; 4]], out: &mut [[u16; 4]]) {
    out.iter_mut().zip(from).for_each(|(out, pixel)| *out = premultiplied(*pixel));
}

#[inline(always)]
fn premultiplied([r, g, b, a]: [u8; 4]) -> [u16; 4] {
    [r, g, b, 255].map(|value| u16::from(value) * u16::from(a))
}

/// Adding this to a number of 0 to 255 rounds it and leaves it in the lowest byte.
const ROUNDER: f32 = (1 << 23) as f32;

/// Premultiplied colours, of which `FULL` is one, as straight bytes.
#[inline(always)]
pub fn straight(colors: &[[f32; 4]; LANES]) -> [[u8; 4]; LANES] {
    let mut out = [[0; 4]; LANES];
    let (from, to) = (colors.as_flattened(), out.as_flattened_mut());
    if colors.iter().fold(true, |opaque, color| opaque & (color[3] == FULL)) {
        // Most blocks: no division.
        to.iter_mut().zip(from).for_each(|(to, from)| *to = (from * (1.0 / 255.0) + ROUNDER).to_bits() as u8);
        return out;
    }
    for i in 0..4 * LANES {
        let alpha = from[i | 3];
        let factor = if i & 3 == 3 { 1.0 / 255.0 } else { 255.0 / alpha };
        let value = (from[i] * factor).min(255.0);
        let value = if alpha > 0.0 { value } else { 0.0 };
        to[i] = (value + ROUNDER).to_bits() as u8;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(color: [f32; 4]) -> [u8; 4] {
        straight(&[color; LANES])[0]
    }

    #[test]
    fn every_straight_colour_comes_back() {
        for alpha in 1..=255 {
            for value in 0..=255 {
                let pixel = [value, 255 - value, value / 2, alpha];
                assert_eq!(one(premultiplied(pixel).map(f32::from)), pixel);
            }
        }
        assert_eq!(one([9.0, 9.0, 9.0, 0.0]), [0; 4]);
    }

    #[test]
    fn reading_mixes_premultiplied_neighbours_and_repeats_the_rim() {
        let pixels = [[200, 0, 0, 255], [0, 99, 0, 0], [0, 0, 255, 255], [0, 0, 0, 255]];
        let texture = Texture { pixels: &pixels, width: 2, height: 2 };
        let Ok(texels) = Texels::new(texture, DVec2::splat(-9.0), DVec2::splat(9.0)) else { unreachable!() };
        let (low, high) = (texels.clamped(DVec2::splat(-9.0)), texels.clamped(DVec2::splat(9.0)));
        let run = |x: f64, y: f64, step: f64| {
            let ramp = Ramp::new(DVec2::ZERO, DVec2::new(x, y), DVec2::new(step, 0.0), DVec2::ZERO);
            let found = texels.look_up(ramp.run(0, 0, low, high));
            straight(&std::array::from_fn(|lane| texels.read(&found, lane)))
        };
        assert_eq!(run(0.5, 0.0, 0.0)[7], [200, 0, 0, 128]);
        assert_eq!(run(0.0, 0.5, 0.0)[0], [100, 0, 128, 255]);
        assert_eq!((run(-3.0, -1.0, 1.0)[0], run(7.0, 7.0, 0.0)[0]), (pixels[0], pixels[3]));
        assert_eq!(run(-3.0, 1.0, 0.5)[5..9], [pixels[2], pixels[2], [0, 0, 128, 255], pixels[3]]);
        assert_eq!(run(-1e300, 1e300, 1.0)[15], pixels[2]);
    }
}
