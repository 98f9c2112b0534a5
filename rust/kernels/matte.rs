//! How opaque every drawn pixel is, and its colour without the paper.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, equations 14 and 15: alpha is the inverse of the grey value. PAPERS.md names what
//! goes wrong with it and the other mattes. A picture with an alpha channel is put over white paper first, but for the
//! matte that is this channel. Integers all the way, so that white is exactly 0 and black exactly 1.

use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// The weights of red, green and blue in grey, in thousandths (BT.601; equation 14 prints 298 for red).
const GRAY: [u32; 3] = [299, 587, 114];

/// The darkness of black over the alpha 255: `GRAY`'s sum times 255 times 255.
const BLACK: f32 = 65_025_000.0;

/// Where a matte's alpha and colour come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode<'a> {
    /// Equations 14 and 15: darkness; colour as drawn.
    Ink,
    /// Colour to alpha: the least alpha that explains the pixel over white, and the colour that does.
    Unmix,
    /// Opaque where the labels are not zero, darkness outside with the colour unmixed by it.
    Fill(&'a [u8]),
    /// The picture's own alpha channel and colour.
    Alpha,
}

/// A pixel over white: how much of each of red, green and blue is missing, times its alpha (0 to 65025).
fn darkness<const C: usize>(pixel: &[u8; C]) -> [u32; 3] {
    let alpha = if C == 4 { u32::from(pixel[3]) } else { 255 };
    [0, 1, 2].map(|i| u32::from(255 - pixel[i]) * alpha)
}

fn ink<const C: usize>(pixel: &[u8; C]) -> f32 {
    // At most 255000 before the alpha: exact in float32, so that only the last product rounds.
    let alpha = if C == 4 { f32::from(pixel[3]) } else { 255.0 };
    let dark = (0..3).map(|i| GRAY[i] * u32::from(255 - pixel[i])).sum::<u32>();
    dark as f32 * alpha / BLACK
}

/// The pixel over white, to the nearest.
fn over_white<const C: usize>(pixel: &[u8; C]) -> [u8; 3] {
    darkness(pixel).map(|dark| 255 - ((dark + 127) / 255) as u8)
}

fn unmix<const C: usize>(pixel: &[u8; C]) -> ([u8; 3], f32) {
    let dark = darkness(pixel);
    let most = dark[0].max(dark[1]).max(dark[2]);
    if most == 0 {
        return ([255; 3], 0.0);
    }
    let scale = 255.0 / most as f32;
    (dark.map(|dark| 255 - (dark as f32 * scale + 0.5) as u8), most as f32 / 65_025.0)
}

/// Ink with the colour that gives the pixel over white, as far as there is one: what has none is cut off.
fn unmix_ink<const C: usize>(pixel: &[u8; C]) -> ([u8; 3], f32) {
    let alpha = ink(pixel);
    let unmixed = |dark: u32| 255 - (dark as f32 / (255.0 * alpha) + 0.5).min(255.0) as u8;
    if alpha > 0.0 { (darkness(pixel).map(unmixed), alpha) } else { ([255; 3], 0.0) }
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
    if let Mode::Fill(labels) = mode {
        check_length("labels", alpha.len(), labels.len())?;
    }
    match (channels, mode) {
        (3, Mode::Alpha) => {
            return Err(KernelError::Argument {
                argument: "image",
                problem: "no alpha channel, and the matte asks for it",
            });
        }
        (3, _) => matte_rows::<3>(mode, image, width, color, alpha),
        (4, _) => matte_rows::<4>(mode, image, width, color, alpha),
        _ => return Err(KernelError::Argument { argument: "image", problem: "want 3 or 4 channels" }),
    }
    Ok(())
}

fn matte_rows<const C: usize>(mode: Mode, image: &[u8], width: usize, color: &mut [u8], alpha: &mut [f32]) {
    let width = width.max(1);
    let rows = image.as_chunks::<C>().0.par_chunks(width).zip(color.as_chunks_mut::<3>().0.par_chunks_mut(width));
    rows.zip(alpha.par_chunks_mut(width)).enumerate().for_each(|(row, ((pixels, colors), alphas))| {
        let pixels = pixels.iter().zip(colors).zip(alphas);
        match mode {
            Mode::Ink => pixels.for_each(|((pixel, color), alpha)| (*color, *alpha) = (over_white(pixel), ink(pixel))),
            Mode::Unmix => pixels.for_each(|((pixel, color), alpha)| (*color, *alpha) = unmix(pixel)),
            Mode::Fill(labels) => pixels.zip(&labels[row * width..]).for_each(|(((pixel, color), alpha), label)| {
                (*color, *alpha) = if *label > 0 { (over_white(pixel), 1.0) } else { unmix_ink(pixel) };
            }),
            Mode::Alpha => pixels.for_each(|((pixel, color), alpha)| {
                (*color, *alpha) = ([pixel[0], pixel[1], pixel[2]], f32::from(pixel[C - 1]) / 255.0);
            }),
        }
    });
}
