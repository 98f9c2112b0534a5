//! How opaque every drawn pixel is, and its colour without the paper.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, equations 14 and 15: alpha is the inverse of the grey value. docs/papers.md names what
//! goes wrong with it and the other mattes. A picture with an alpha channel is put over white paper first, but for the
//! matte that is this channel. Integers all the way, so that white is exactly 0 and black exactly 1.

use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// The weights of red, green and blue in grey, in thousandths (BT.601; equation 14 prints 298 for red).
const GRAY: [i32; 3] = [299, 587, 114];

/// One over the darkness of black. Multiplying is four times as quick as dividing, and black still comes out as exactly 1.
const PER_BLACK: f32 = 1.0 / 255_000.0;

/// Where a matte's alpha and colour come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Equations 14 and 15: darkness; colour as drawn.
    Ink,
    /// Colour to alpha: the least alpha that explains the pixel over white, and the colour that does.
    Unmix,
}

fn ink<const C: usize>(pixel: &[u8; C]) -> f32 {
    let dark: i32 = (0..3).map(|i| GRAY[i] * i32::from(255 - pixel[i])).sum();
    let alpha = dark as f32 * PER_BLACK;
    if C == 4 { alpha * OPACITY[usize::from(pixel[C - 1])] } else { alpha }
}

/// The pixel over white, to the nearest.
pub(crate) fn over_white<const C: usize>(pixel: &[u8; C]) -> [u8; 3] {
    let alpha = if C == 4 { u32::from(pixel[3]) } else { 255 };
    [0, 1, 2].map(|i| 255 - ((u32::from(255 - pixel[i]) * alpha + 127) / 255) as u8)
}

/// 255 / alpha in 2^20ths, rounded up: exact enough for all 8-bit values, as a test says.
const UNMIX: [u32; 256] = {
    let mut table = [0; 256];
    let mut alpha = 1;
    while alpha < 256 {
        table[alpha] = (255u32 << 20).div_ceil(alpha as u32);
        alpha += 1;
    }
    table
};

/// An 8-bit alpha as a number in 0..1.
pub(crate) const OPACITY: [f32; 256] = {
    let mut table = [0.0; 256];
    let mut alpha = 0;
    while alpha < 256 {
        table[alpha] = alpha as f32 / 255.0;
        alpha += 1;
    }
    table
};

/// The colour of which `alpha` 255ths over white give `color`, to the nearest; alpha must leave it possible.
pub(crate) fn without_white(color: [u8; 3], alpha: u8) -> [u8; 3] {
    let scale = UNMIX[usize::from(alpha)];
    color.map(|value| 255 - ((u32::from(255 - value) * scale + (1 << 19)) >> 20) as u8)
}

/// Colour to alpha: how far the pixel is from white at most, and the colour that is left.
pub(crate) fn unmix([r, g, b]: [u8; 3]) -> ([u8; 3], f32) {
    let alpha = 255 - r.min(g).min(b);
    (without_white([r, g, b], alpha), OPACITY[usize::from(alpha)])
}

/// Pixels looked at together: a block of one colour, as paper and flat paint are, is worked once.
pub(crate) const BLOCK: usize = 16;

/// Writes colour and alpha of every pixel; the slices are equally long.
pub(crate) fn shade<const C: usize>(
    pixels: &[[u8; C]],
    colors: &mut [[u8; 3]],
    alphas: &mut [f32],
    paint: impl Fn(&[u8; C]) -> ([u8; 3], f32),
) {
    let blocks = pixels.chunks(BLOCK).zip(colors.chunks_mut(BLOCK)).zip(alphas.chunks_mut(BLOCK));
    for ((pixels, colors), alphas) in blocks {
        let bytes = pixels.as_flattened();
        // Equal to itself one pixel on: all of one colour.
        if bytes[C..] == bytes[..bytes.len() - C] {
            let (color, alpha) = paint(&pixels[0]);
            colors.fill(color);
            alphas.fill(alpha);
        } else {
            for ((pixel, color), alpha) in pixels.iter().zip(colors).zip(alphas) {
                (*color, *alpha) = paint(pixel);
            }
        }
    }
}

/// Writes equations 14 and 15 for a picture of `channels` (3 or 4) bytes a pixel.
pub fn ink_alpha(image: &[u8], channels: usize, width: usize, out: &mut [f32]) -> Result<(), KernelError> {
    check_length("out", image.len() / channels.max(1), out.len())?;
    match channels {
        3 => ink_rows::<3>(image, width, out),
        4 => ink_rows::<4>(image, width, out),
        _ => return Err(KernelError::Argument { argument: "image", problem: "want 3 or 4 channels" }),
    }
    Ok(())
}

fn ink_rows<const C: usize>(image: &[u8], width: usize, out: &mut [f32]) {
    let (pixels, _) = image.as_chunks::<C>();
    out.par_chunks_mut(width.max(1)).zip(pixels.par_chunks(width.max(1))).for_each(|(out, pixels)| {
        for (out, pixel) in out.iter_mut().zip(pixels) {
            *out = ink(pixel);
        }
    });
}

/// Whether the alpha channel says anything: some pixel is not opaque.
pub fn has_alpha(image: &[u8], channels: usize) -> bool {
    channels == 4 && image.as_chunks::<4>().0.iter().any(|pixel| pixel[3] != 255)
}

/// Writes the alpha channel of RGBA `image`.
pub fn own_alpha(image: &[u8], width: usize, out: &mut [f32]) -> Result<(), KernelError> {
    check_length("alpha", image.len() / 4, out.len())?;
    let (pixels, _) = image.as_chunks::<4>();
    out.par_chunks_mut(width.max(1)).zip(pixels.par_chunks(width.max(1))).for_each(|(out, pixels)| {
        for (alpha, pixel) in out.iter_mut().zip(pixels) {
            *alpha = OPACITY[usize::from(pixel[3])];
        }
    });
    Ok(())
}

/// Writes a matte: straight colour, three bytes a pixel, and alpha.
pub fn matte(
    mode: Mode,
    image: &[u8],
    channels: usize,
    width: usize,
    color: &mut [u8],
    alpha: &mut [f32],
) -> Result<(), KernelError> {
    check_length("alpha", image.len() / channels.max(1), alpha.len())?;
    check_length("color", alpha.len() * 3, color.len())?;
    match (channels, mode) {
        (3, _) => matte_rows::<3>(mode, image, width, color, alpha),
        (4, _) => matte_rows::<4>(mode, image, width, color, alpha),
        _ => return Err(KernelError::Argument { argument: "image", problem: "want 3 or 4 channels" }),
    }
    Ok(())
}

fn matte_rows<const C: usize>(mode: Mode, image: &[u8], width: usize, color: &mut [u8], alpha: &mut [f32]) {
    let width = width.max(1);
    let rows = image.as_chunks::<C>().0.par_chunks(width).zip(color.as_chunks_mut::<3>().0.par_chunks_mut(width));
    rows.zip(alpha.par_chunks_mut(width)).for_each(|((pixels, colors), alphas)| match mode {
        Mode::Ink => shade(pixels, colors, alphas, |pixel| (over_white(pixel), ink(pixel))),
        Mode::Unmix => shade(pixels, colors, alphas, |pixel| unmix(over_white(pixel))),
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_exactly_clear_and_black_exactly_opaque() {
        let mut alpha = [9.0; 4];
        let image = [[255, 255, 255, 255], [0, 0, 0, 255], [0, 0, 0, 0], [0, 0, 0, 51]];
        assert_eq!(ink_alpha(image.as_flattened(), 4, 4, &mut alpha), Ok(()));
        assert_eq!(alpha, [0.0, 1.0, 0.0, 0.2]);
        assert_eq!(ink_alpha(&image.as_flattened()[4..10], 3, 2, &mut alpha[..2]), Ok(()));
        assert!(alpha[0] == 1.0 && (alpha[1] - 0.701).abs() < 1e-6);
    }

    #[test]
    fn unmixing_rounds_to_the_nearest_for_every_value() {
        for alpha in 1..=255u32 {
            for dark in 0..=alpha {
                let want = 255 - (2 * dark * 255 + alpha) / (2 * alpha);
                let value = (255 - dark) as u8;
                assert_eq!(u32::from(without_white([value; 3], alpha as u8)[0]), want, "{dark} of {alpha}");
            }
        }
    }

    #[test]
    fn unmixed_colour_over_white_is_the_pixel() {
        for color in [[255, 255, 255], [200, 230, 255], [1, 2, 3], [254, 255, 255], [90, 90, 90]] {
            let (unmixed, alpha) = unmix(color);
            for i in 0..3 {
                let back = f64::from(unmixed[i]) * f64::from(alpha) + 255.0 * (1.0 - f64::from(alpha));
                assert!((back - f64::from(color[i])).abs() <= 0.50001, "{color:?} came back as {back}");
            }
        }
    }

    #[test]
    fn own_alpha_is_the_fourth_channel() {
        let mut alpha = [9.0; 2];
        assert_eq!(own_alpha(&[9, 9, 9, 255, 0, 0, 0, 51], 2, &mut alpha), Ok(()));
        assert_eq!(alpha, [1.0, 0.2]);
        assert!(own_alpha(&[0; 4], 1, &mut alpha).is_err());
        assert!(!has_alpha(&[0, 0, 0, 255], 4) && has_alpha(&[0, 0, 0, 254], 4) && !has_alpha(&[0; 3], 3));
    }
}
