//! A texture made ready for bilinear reading: premultiplied, cut to what is used, its last row and column doubled.
//!
//! Colours are kept as colour times alpha, both in 0..255, and alpha times 255: integers that 16 bits hold exactly, so
//! that a texture read at its own pixel centres comes back to the bit.

use crate::error::{KernelError, check_length};
use glam::{DVec2, Vec2, Vec4};
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

/// The part of a texture between two corners, premultiplied.
#[derive(Debug)]
pub struct Texels {
    data: Vec<[u16; 4]>,
    stride: usize,
    origin: DVec2,
    limit: DVec2,
}

impl Texels {
    /// Prepares what lies between `low` and `high`, in pixels of the texture.
    pub fn new(texture: Texture<'_>, low: DVec2, high: DVec2) -> Result<Self, KernelError> {
        let Texture { pixels, width, height } = texture;
        check_length("texture", width * height, pixels.len())?;
        if pixels.is_empty() {
            return Err(KernelError::Argument { argument: "texture", problem: "want at least one pixel" });
        }
        let last = DVec2::new((width - 1) as f64, (height - 1) as f64);
        let (low, high) = (low.clamp(DVec2::ZERO, last).floor(), high.clamp(DVec2::ZERO, last).ceil());
        let [left, top, right, bottom] = [low.x, low.y, high.x, high.y].map(|side| side as usize);
        let stride = right - left + 2;
        let mut data = vec![[0; 4]; stride * (bottom - top + 2)];
        data.par_chunks_mut(stride).enumerate().for_each(|(row, out)| {
            let from = &pixels[(top + row).min(bottom) * width..][left..=right];
            out.iter_mut().zip(from).for_each(|(out, pixel)| *out = premultiplied(*pixel));
            out[stride - 1] = out[stride - 2];
        });
        Ok(Texels { data, stride, origin: low, limit: high - low })
    }

    /// A place of the texture, moved to this part.
    pub fn local(&self, place: DVec2) -> DVec2 {
        place - self.origin
    }

    /// The nearest places that this part has.
    pub fn clamped(&self, place: DVec2) -> Vec2 {
        place.clamp(DVec2::ZERO, self.limit).as_vec2()
    }

    /// The premultiplied colour, of which `FULL` is one, at a local place that `clamped` has let through.
    #[inline(always)]
    pub fn read(&self, place: Vec2) -> Vec4 {
        let (column, row) = (place.x as usize, place.y as usize);
        let (x, y) = (place.x - column as f32, place.y - row as f32);
        let at = row * self.stride + column;
        let pair = |at: usize| match self.data.get(at..at + 2) {
            Some([left, right]) => (wide(*left), wide(*right)),
            _ => (Vec4::ZERO, Vec4::ZERO),
        };
        let ((a, b), (c, d)) = (pair(at), pair(at + self.stride));
        let (upper, lower) = (a + (b - a) * x, c + (d - c) * x);
        upper + (lower - upper) * y
    }
}

#[inline(always)]
fn wide(texel: [u16; 4]) -> Vec4 {
    Vec4::from_array(texel.map(f32::from))
}

fn premultiplied([r, g, b, a]: [u8; 4]) -> [u16; 4] {
    [r, g, b, 255].map(|value| u16::from(value) * u16::from(a))
}

/// A premultiplied colour, of which `FULL` is one, as straight bytes.
#[inline(always)]
pub fn straight(color: Vec4) -> [u8; 4] {
    if color.w <= 0.0 {
        return [0; 4];
    }
    let scaled = (color * (255.0 / color.w)).min(Vec4::splat(255.0));
    [scaled.x, scaled.y, scaled.z, color.w * (1.0 / 255.0)].map(|value| (value + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_straight_colour_comes_back() {
        for alpha in 1..=255 {
            for value in 0..=255 {
                let pixel = [value, 255 - value, value / 2, alpha];
                assert_eq!(straight(wide(premultiplied(pixel))), pixel);
            }
        }
        assert_eq!(straight(wide(premultiplied([9, 9, 9, 0]))), [0; 4]);
    }

    #[test]
    fn reading_mixes_premultiplied_neighbours_and_repeats_the_rim() {
        let pixels = [[200, 0, 0, 255], [0, 99, 0, 0], [0, 0, 255, 255], [0, 0, 0, 255]];
        let texture = Texture { pixels: &pixels, width: 2, height: 2 };
        let Ok(texels) = Texels::new(texture, DVec2::splat(-9.0), DVec2::splat(9.0)) else { unreachable!() };
        let at = |x: f64, y: f64| straight(texels.read(texels.clamped(DVec2::new(x, y))));
        assert_eq!(at(0.5, 0.0), [200, 0, 0, 128]);
        assert_eq!(at(0.0, 0.5), [100, 0, 128, 255]);
        assert_eq!((at(-3.0, -1.0), at(7.0, 7.0)), (pixels[0], pixels[3]));
    }
}
