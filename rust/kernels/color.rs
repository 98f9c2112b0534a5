//! Display (sRGB) and linear colour.
//!
//! The piecewise curve of IEC 61966-2-1 in both directions, odd about zero and continued beyond one. Encoding reads a
//! table with straight lines between; its largest error is 2e-6 below one (0.0005 of an 8-bit step).

use crate::checks::first_fault;
use crate::error::{KernelError, check_length};
use multiversion::multiversion;
use rayon::prelude::*;
use std::sync::LazyLock;

/// What the numbers of a picture mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// sRGB: as drawn, as shown on a monitor.
    Display,
    /// Proportional to light.
    Linear,
}

/// What brings colours from one space to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conversion {
    /// They stay as they are.
    Keep,
    /// Linear to display.
    Encode,
    /// Display to linear.
    Decode,
}

impl Conversion {
    /// The conversion between two spaces.
    pub fn between(from: Space, to: Space) -> Self {
        match (from, to) {
            (Space::Linear, Space::Display) => Conversion::Encode,
            (Space::Display, Space::Linear) => Conversion::Decode,
            _ => Conversion::Keep,
        }
    }

    /// The straight colour of every byte, 0..=1 after conversion.
    pub fn bytes(self) -> [f32; 256] {
        std::array::from_fn(|byte| {
            let value = byte as f64 / 255.0;
            match self {
                Conversion::Keep => value as f32,
                Conversion::Encode => encode_exact(value) as f32,
                Conversion::Decode => decode_exact(value) as f32,
            }
        })
    }
}

/// The table has 2^7 steps in every octave from 2^-9 to 2^16 (the largest half float): the top bits of the number itself are the index.
const STEP_BITS: u32 = 23 - 7;
const LOWEST: f32 = 1.0 / 512.0;
const HIGHEST: f32 = 65536.0;
const FIRST: usize = (LOWEST.to_bits() >> STEP_BITS) as usize;
const COUNT: usize = (HIGHEST.to_bits() >> STEP_BITS) as usize - FIRST;

static ENCODED: LazyLock<[f32; COUNT + 1]> = LazyLock::new(|| {
    std::array::from_fn(|i| encode_exact(f64::from(f32::from_bits(((FIRST + i) as u32) << STEP_BITS))) as f32)
});

fn encode_exact(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

fn decode_exact(display: f64) -> f64 {
    if display <= 0.040_45 { display / 12.92 } else { ((display + 0.055) / 1.055).powf(2.4) }
}

/// Encodes in three passes, so that all but the reading of the table becomes vectors.
#[inline(always)]
fn encode_plane<const N: usize>(plane: &mut [f32; N]) {
    let table = &*ENCODED;
    let (mut index, mut part, mut low, mut high) = ([0; N], [0.0; N], [0.0; N], [0.0; N]);
    for i in 0..N {
        let bits = plane[i].abs().clamp(LOWEST, f32::from_bits(HIGHEST.to_bits() - 1)).to_bits();
        index[i] = (bits >> STEP_BITS) - FIRST as u32;
        part[i] = (bits & ((1 << STEP_BITS) - 1)) as i32 as f32 * (1.0 / (1u32 << STEP_BITS) as f32);
    }
    for i in 0..N {
        let index = (index[i] as usize).min(COUNT - 1);
        (low[i], high[i]) = (table[index], table[index + 1]);
    }
    let mut beyond = false;
    for i in 0..N {
        let size = plane[i].abs();
        let curved = low[i] + part[i] * (high[i] - low[i]);
        low[i] = if size < LOWEST { 12.92 * size } else { curved };
        beyond |= size >= HIGHEST;
    }
    if beyond {
        let values = low.iter_mut().zip(&*plane).filter(|(_, value)| value.abs() >= HIGHEST);
        values.for_each(|(encoded, value)| *encoded = encode_exact(f64::from(value.abs())) as f32);
    }
    plane.iter_mut().zip(&low).for_each(|(value, encoded)| *value = encoded.copysign(*value));
}

fn decode_plane<const N: usize>(plane: &mut [f32; N]) {
    plane.iter_mut().for_each(|value| *value = decode_exact(f64::from(value.abs())).copysign(f64::from(*value)) as f32);
}

/// Converts premultiplied samples in place: unpremultiplied, converted, premultiplied again.
///
/// Colour without coverage (a glow that only adds light) is converted as it is. Numbers stay finite.
#[inline(always)]
pub fn convert_premultiplied<const N: usize>(conversion: Conversion, color: &mut [[f32; N]; 3], coverage: &[f32; N]) {
    if conversion == Conversion::Keep || color.as_flattened().iter().all(|value| *value == 0.0) {
        return;
    }
    // Below the smallest normal number the reciprocal would be infinite.
    let scale = coverage.map(|value| if value >= f32::MIN_POSITIVE { value } else { 1.0 });
    let inverse = scale.map(f32::recip);
    for plane in color {
        let values = plane.iter_mut().zip(&inverse);
        values.for_each(|(value, inverse)| *value = (*value * inverse).clamp(f32::MIN, f32::MAX));
        if conversion == Conversion::Encode {
            encode_plane(plane)
        } else {
            decode_plane(plane)
        }
        let values = plane.iter_mut().zip(&scale);
        values.for_each(|(value, scale)| *value = (*value * scale).clamp(f32::MIN, f32::MAX));
    }
}

/// Pixels of a picture converted at a time.
const BLOCK: usize = 64;

/// Converts a premultiplied RGBA picture of `width` columns between display and linear light; alpha stays.
pub fn convert_picture(
    conversion: Conversion,
    pixels: &[f32],
    width: usize,
    out: &mut [f32],
) -> Result<(), KernelError> {
    check_length("out", pixels.len(), out.len())?;
    let (source, target) = (pixels.as_chunks::<4>().0, out.as_chunks_mut::<4>().0);
    let runs = target.par_chunks_mut(64 * BLOCK).zip(source.par_chunks(64 * BLOCK));
    let fine = runs.map(|(target, source)| convert_run(conversion, source, target)).reduce(|| true, |a, b| a & b);
    let finite = |pixel: &[f32; 4]| pixel.iter().all(|value| value.is_finite());
    let fault = || first_fault("pixels", "want finite colours", source, width, finite);
    if fine { Ok(()) } else { fault().map_or(Ok(()), Err) }
}

/// Converts some pixels; tells whether all were finite.
#[multiversion(targets("x86_64+avx2"))]
fn convert_run(conversion: Conversion, source: &[[f32; 4]], target: &mut [[f32; 4]]) -> bool {
    let mut fine = true;
    for (target, source) in target.chunks_mut(BLOCK).zip(source.chunks(BLOCK)) {
        let (mut color, mut coverage) = ([[0.0; BLOCK]; 3], [0.0; BLOCK]);
        for (i, &[red, green, blue, alpha]) in source.iter().enumerate() {
            [color[0][i], color[1][i], color[2][i], coverage[i]] = [red, green, blue, alpha];
        }
        fine &= source.as_flattened().iter().fold(true, |fine, value| fine & value.is_finite());
        convert_premultiplied(conversion, &mut color, &coverage);
        for (i, pixel) in target.iter_mut().enumerate() {
            *pixel = [color[0][i], color[1][i], color[2][i], coverage[i]];
        }
    }
    fine
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encode(x: f32) -> f32 {
        let mut plane = [x];
        encode_plane(&mut plane);
        plane[0]
    }

    #[test]
    fn table_is_within_its_stated_error() {
        let worst = |from: f32, to: f32| {
            let range = (from.to_bits()..to.to_bits()).step_by(997);
            range
                .map(f32::from_bits)
                .fold(0.0, |worst: f64, x| worst.max((f64::from(encode(x)) - encode_exact(f64::from(x))).abs()))
        };
        assert!(worst(0.0, 1.0) < 2e-6, "{}", worst(0.0, 1.0));
        assert!(worst(1.0, 100.0) < 2e-5, "{}", worst(1.0, 100.0));
    }

    #[test]
    fn curves_are_inverse_and_odd() {
        for x in [0.0, 0.001, 0.0031, 0.0032, 0.18, 0.5, 1.0, 3.0, 63.9, 64.0, 1e6] {
            let mut plane = [encode(x)];
            decode_plane(&mut plane);
            assert!((plane[0] - x).abs() <= 1e-5 * x.max(0.1), "{x}");
            assert_eq!(encode(-x), -encode(x));
        }
        assert_eq!(encode(f32::MAX), encode_exact(f64::from(f32::MAX)) as f32);
    }

    #[test]
    fn glow_without_coverage_is_kept_and_nothing_becomes_infinite() {
        let mut color = [[0.0, 0.5, 0.5, f32::MAX], [0.0; 4], [0.0; 4]];
        let coverage = [0.0, 0.0, 1e-42, 1e-3];
        convert_premultiplied(Conversion::Encode, &mut color, &coverage);
        assert_eq!(color[0][0], 0.0);
        assert!((f64::from(color[0][1]) - encode_exact(0.5)).abs() < 2e-6);
        assert!(color.as_flattened().iter().all(|value| value.is_finite()));
    }
}
