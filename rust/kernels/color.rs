//! Display (sRGB) and linear colour.
//!
//! The piecewise curve of IEC 61966-2-1 in both directions, odd about zero and continued beyond one. Encoding reads a
//! table with straight lines between; its largest error is 2e-6 below one (0.0005 of an 8-bit step).

use crate::error::{KernelError, check_length};
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

/// The table has 2^7 steps in every octave from 2^-9 to 2^6: the top bits of the number itself are the index.
const STEP_BITS: u32 = 23 - 7;
const LOWEST: f32 = 1.0 / 512.0;
const HIGHEST: f32 = 64.0;
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

/// The encoding curve with its table at hand.
#[derive(Clone, Copy)]
struct Encoder(&'static [f32; COUNT + 1]);

impl Encoder {
    #[inline(always)]
    fn apply(self, linear: f32) -> f32 {
        let size = linear.abs();
        let encoded = if size < LOWEST {
            12.92 * size
        } else if size < HIGHEST {
            let bits = size.to_bits();
            let index = ((bits >> STEP_BITS) as usize - FIRST).min(COUNT - 1);
            let part = (bits & ((1 << STEP_BITS) - 1)) as f32 / (1u32 << STEP_BITS) as f32;
            let (low, high) = (self.0[index], self.0[index + 1]);
            low + part * (high - low)
        } else {
            encode_exact(f64::from(size)) as f32
        };
        encoded.copysign(linear)
    }
}

fn decode(display: f32) -> f32 {
    (decode_exact(f64::from(display.abs())) as f32).copysign(display)
}

/// Converts premultiplied samples in place: unpremultiplied, converted, premultiplied again.
///
/// Colour without coverage (a glow that only adds light) is converted as it is.
pub fn convert_premultiplied(conversion: Conversion, color: [&mut [f32]; 3], coverage: &[f32]) {
    match conversion {
        Conversion::Keep => {}
        Conversion::Encode => {
            let encoder = Encoder(&ENCODED);
            apply_unpremultiplied(|value| encoder.apply(value), color, coverage);
        }
        Conversion::Decode => apply_unpremultiplied(decode, color, coverage),
    }
}

#[inline(always)]
fn apply_unpremultiplied(curve: impl Fn(f32) -> f32, [red, green, blue]: [&mut [f32]; 3], coverage: &[f32]) {
    for (((red, green), blue), &coverage) in red.iter_mut().zip(green).zip(blue).zip(coverage) {
        if *red == 0.0 && *green == 0.0 && *blue == 0.0 {
            continue;
        }
        let scale = if coverage > 0.0 { coverage } else { 1.0 };
        for value in [red, green, blue] {
            let straight = (*value / scale).clamp(f32::MIN, f32::MAX);
            *value = (curve(straight) * scale).clamp(f32::MIN, f32::MAX);
        }
    }
}

/// Converts a premultiplied RGBA picture between display and linear light; alpha stays.
pub fn convert_picture(conversion: Conversion, pixels: &[f32], out: &mut [f32]) -> Result<(), KernelError> {
    const BLOCK: usize = 256;
    check_length("out", pixels.len(), out.len())?;
    let (source, _) = pixels.as_chunks::<4>();
    let (target, _) = out.as_chunks_mut::<4>();
    target.par_chunks_mut(BLOCK).zip(source.par_chunks(BLOCK)).for_each(|(target, source)| {
        let mut planes = [[0.0; BLOCK]; 4];
        for (i, pixel) in source.iter().enumerate() {
            (0..4).for_each(|channel| planes[channel][i] = pixel[channel]);
        }
        let [red, green, blue, coverage] = &mut planes;
        convert_premultiplied(conversion, [red, green, blue], coverage);
        for (i, pixel) in target.iter_mut().enumerate() {
            *pixel = [red[i], green[i], blue[i], coverage[i]];
        }
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_is_within_its_stated_error() {
        let encoder = Encoder(&ENCODED);
        let worst = |from: f32, to: f32| {
            let range = (from.to_bits()..to.to_bits()).step_by(997);
            range
                .map(f32::from_bits)
                .fold(0.0, |worst: f64, x| worst.max((f64::from(encoder.apply(x)) - encode_exact(f64::from(x))).abs()))
        };
        assert!(worst(0.0, 1.0) < 2e-6, "{}", worst(0.0, 1.0));
        assert!(worst(1.0, 100.0) < 2e-5, "{}", worst(1.0, 100.0));
    }

    #[test]
    fn curves_are_inverse_and_odd() {
        let encoder = Encoder(&ENCODED);
        for x in [0.0, 0.001, 0.0031, 0.0032, 0.18, 0.5, 1.0, 3.0, 63.9, 64.0, 1e6] {
            assert!((decode(encoder.apply(x)) - x).abs() <= 1e-5 * x.max(0.1), "{x}");
            assert_eq!(encoder.apply(-x), -encoder.apply(x));
        }
        assert_eq!(encoder.apply(f32::MAX), encode_exact(f64::from(f32::MAX)) as f32);
    }

    #[test]
    fn glow_without_coverage_is_kept_and_nothing_becomes_infinite() {
        let (mut red, mut green, mut blue) = ([0.0, 0.5, 0.5, f32::MAX], [0.0; 4], [0.0; 4]);
        let coverage = [0.0, 0.0, 1e-42, 1e-3];
        convert_premultiplied(Conversion::Encode, [&mut red, &mut green, &mut blue], &coverage);
        assert_eq!(red[0], 0.0);
        assert!((f64::from(red[1]) - encode_exact(0.5)).abs() < 2e-6);
        assert!(red.iter().chain(&green).chain(&blue).all(|value| value.is_finite()));
    }
}
