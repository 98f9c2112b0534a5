//! The matte of a painted figure: opaque inside its limbs, unmixed from the paper outside.
//!
//! After Jain, Sheikh, Mahler, Hodgins 2010, equations 14 and 15, whose darkness turns a light skin into glass. The
//! limbs' border pixels are part paint and part paper: opaque, they would carry a rim of paper onto any other plate. So a
//! border pixel takes its explanation from the paint farther in and from the ink of the outline: the one whose colour, laid
//! over white with some alpha, comes nearest to it, and of ink that comes about as near the darkest. For the grey beside a thin
//! line may be light paint or half-covered black, and light paint would carry the paper along. Assumes white paper; colours
//! as stored, without gamma.

use crate::error::{KernelError, check_length};
use crate::matte::{BLOCK, OPACITY, over_white, shade, unmix, without_white};
use rayon::prelude::*;

/// How far inside the paint of a border pixel is looked for.
const INWARD: usize = 2;

/// How far along the outline its ink is looked for.
const ALONG: usize = 5;

/// Ink is at least this far from white in every channel.
const INK: u8 = 128;

/// Squared distance in 8-bit RGB within which ink explains a pixel as well as the best does.
const CLOSE: i32 = 6 * 6;

/// Paint beside the outside that is at most this much lighter than a pixel, in 8-bit levels, leaves it no paper.
const PALER: u8 = 16;

/// Squared distance in 8-bit RGB: paint nearer to white than this tells nothing of alpha, and paint over white that comes
/// no nearer to a pixel does not explain it.
const FAINT: i32 = 24 * 24;

/// How deep in the labels a pixel lies.
mod depth {
    pub const OUTSIDE: u8 = 0;
    /// One of its four neighbours is outside.
    pub const SIDE: u8 = 1;
    /// Only diagonal neighbours are outside.
    pub const CORNER: u8 = 2;
    pub const INSIDE: u8 = 3;
}

/// Writes straight colour, three bytes a pixel, and alpha of a picture of `channels` (3 or 4) bytes a pixel.
///
/// `labels` are not zero inside the limbs. Row-major, `width` columns; rows are worked in parallel.
pub fn fill_matte(
    image: &[u8],
    channels: usize,
    width: usize,
    labels: &[u8],
    color: &mut [u8],
    alpha: &mut [f32],
) -> Result<(), KernelError> {
    check_length("alpha", image.len() / channels.max(1), alpha.len())?;
    check_length("color", alpha.len() * 3, color.len())?;
    check_length("labels", alpha.len(), labels.len())?;
    match channels {
        _ if width == 0 => {}
        3 => fill_rows::<3>(image.as_chunks().0, width, labels, color, alpha),
        4 => fill_rows::<4>(image.as_chunks().0, width, labels, color, alpha),
        _ => return Err(KernelError::Argument { argument: "image", problem: "want 3 or 4 channels" }),
    }
    Ok(())
}

fn fill_rows<const C: usize>(pixels: &[[u8; C]], width: usize, labels: &[u8], color: &mut [u8], alpha: &mut [f32]) {
    let mut depths = vec![depth::OUTSIDE; labels.len()];
    let rows = depths.par_chunks_mut(width).enumerate();
    rows.for_each_init(|| vec![0; width + 2], |around, (row, depths)| depth_row(labels, row, around, depths));
    let rows = color.as_chunks_mut::<3>().0.par_chunks_mut(width).zip(alpha.par_chunks_mut(width)).enumerate();
    rows.for_each(|(row, (colors, alphas))| {
        let blocks = colors.chunks_mut(BLOCK).zip(alphas.chunks_mut(BLOCK)).enumerate();
        for (block, (colors, alphas)) in blocks {
            let start = row * width + block * BLOCK;
            let (pixels_here, depths_here) = (&pixels[start..][..colors.len()], &depths[start..][..colors.len()]);
            if all(depths_here, depth::INSIDE) {
                shade(pixels_here, colors, alphas, |pixel| (over_white(pixel), 1.0));
            } else if all(depths_here, depth::OUTSIDE) {
                shade(pixels_here, colors, alphas, |pixel| unmix(over_white(pixel)));
            } else {
                for (i, (color, alpha)) in colors.iter_mut().zip(alphas).enumerate() {
                    let drawn = over_white(&pixels_here[i]);
                    (*color, *alpha) = match depths_here[i] {
                        depth::INSIDE => (drawn, 1.0),
                        depth::OUTSIDE => unmix(drawn),
                        _ => border(pixels, width, &depths, [row, block * BLOCK + i], drawn),
                    };
                }
            }
        }
    });
}

fn all(depths: &[u8], depth: u8) -> bool {
    // Not `all`: the fold is worked on many bytes at a time.
    depths.iter().fold(true, |same, other| same & (*other == depth))
}

/// The pixel above or below lies outside.
const BESIDE: u8 = 1;

/// The pixel itself lies outside.
const ITSELF: u8 = 2;

/// How deep every pixel of a row lies; beyond the picture the figure goes on. `around` is room for what is outside in one
/// row and a pixel on either side.
fn depth_row(labels: &[u8], row: usize, around: &mut [u8], out: &mut [u8]) {
    let width = out.len();
    let line = |row: usize| &labels[row * width..(row + 1) * width];
    let (above, here) = (line(row.saturating_sub(1)), line(row));
    let below = line((row + 1).min(labels.len() / width - 1));
    for (around, ((above, here), below)) in around[1..].iter_mut().zip(above.iter().zip(here).zip(below)) {
        // Not `||`: without branches many bytes are worked at a time.
        let beside = if (*above == 0) | (*below == 0) { BESIDE } else { 0 };
        *around = beside | if *here == 0 { ITSELF } else { 0 };
    }
    (around[0], around[width + 1]) = (around[1], around[width]);
    let sides = around.iter().zip(&around[1..]).zip(&around[2..]);
    for (out, ((left, here), right)) in out.iter_mut().zip(sides) {
        let corner = if (left | right) & BESIDE == 0 { depth::INSIDE } else { depth::CORNER };
        let side = if ((left | right) & ITSELF) | (here & BESIDE) == 0 { corner } else { depth::SIDE };
        *out = if here & ITSELF == 0 { side } else { depth::OUTSIDE };
    }
}

/// Paint and alpha of a border pixel, from the paint that explains it; opaque where none does.
fn border<const C: usize>(
    pixels: &[[u8; C]],
    width: usize,
    depths: &[u8],
    [row, column]: [usize; 2],
    drawn: [u8; 3],
) -> ([u8; 3], f32) {
    let own = depths[row * width + column];
    let outward = outward(depths, width, [row, column]);
    if own == depth::CORNER && has_paint_outward(pixels, width, [row, column], outward, drawn) {
        return (drawn, 1.0);
    }
    let (mut best, mut ink) = ((i32::MAX, usize::MAX, u8::MAX), u8::MAX);
    for [y, x] in around([row, column], ALONG, [depths.len() / width, width]) {
        let [down, right] = [y as i32 - row as i32, x as i32 - column as i32];
        let deep = depths[y * width + x];
        let farther_in = deep > own && down.abs().max(right.abs()) <= INWARD as i32;
        let along = matches!(deep, depth::SIDE | depth::CORNER) && down * outward[0] + right * outward[1] <= 0;
        if !farther_in && !along || [y, x] == [row, column] {
            continue;
        }
        let color = over_white(&pixels[y * width + x]);
        let is_ink = color.iter().all(|value| *value <= u8::MAX - INK);
        if (farther_in || is_ink)
            && let Some((miss, alpha)) = explain(drawn, color)
        {
            // Equally good ones: the nearest, then the more opaque.
            best = best.min((miss, y.abs_diff(row).pow(2) + x.abs_diff(column).pow(2), u8::MAX - alpha));
            if is_ink && miss <= CLOSE {
                ink = ink.min(alpha);
            }
        }
    }
    let alpha = if best.0 == i32::MAX { u8::MAX } else { ink.min(u8::MAX - best.2) };
    let alpha = alpha.max(u8::MAX - darkest(drawn));
    (without_white(drawn, alpha), OPACITY[usize::from(alpha)])
}

/// The pixels of a picture of `size` within `reach` of one in rows and columns.
fn around([row, column]: [usize; 2], reach: usize, size: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    let near = |at: usize, end: usize| at.saturating_sub(reach)..(at + reach + 1).min(end);
    let columns = near(column, size[1]);
    near(row, size[0]).flat_map(move |y| columns.clone().map(move |x| [y, x]))
}

/// Where the outside lies: the steps to the outside neighbours, added up; beyond the picture the figure goes on.
fn outward(depths: &[u8], width: usize, [row, column]: [usize; 2]) -> [i32; 2] {
    let on = |at: usize, step: i32, end: usize| at.saturating_add_signed(step as isize).min(end - 1);
    let mut sum = [0, 0];
    for [down, right] in [-1, 0, 1].into_iter().flat_map(|down| [-1, 0, 1].map(|right| [down, right])) {
        if depths[on(row, down, depths.len() / width) * width + on(column, right, width)] == depth::OUTSIDE {
            sum = [sum[0] + down, sum[1] + right];
        }
    }
    sum
}

/// Whether paint lies between a pixel and the outside: a side neighbour towards it is darker or hardly lighter.
fn has_paint_outward<const C: usize>(
    pixels: &[[u8; C]],
    width: usize,
    at: [usize; 2],
    outward: [i32; 2],
    drawn: [u8; 3],
) -> bool {
    around(at, 1, [pixels.len() / width, width]).any(|[y, x]| {
        let [down, right] = [y as i32 - at[0] as i32, x as i32 - at[1] as i32];
        down.abs() + right.abs() == 1
            && down * outward[0] + right * outward[1] > 0
            && darkest(over_white(&pixels[y * width + x])) < darkest(drawn).saturating_add(PALER)
    })
}

/// The least of the channels.
fn darkest([r, g, b]: [u8; 3]) -> u8 {
    r.min(g).min(b)
}

/// The alpha with which `paint` over white comes nearest to `drawn`, and by how much it misses it (squared).
fn explain(drawn: [u8; 3], paint: [u8; 3]) -> Option<(i32, u8)> {
    let dark = |color: [u8; 3]| color.map(|value| 255 - i32::from(value));
    let (drawn, paint) = (dark(drawn), dark(paint));
    let dot = |a: [i32; 3], b: [i32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let whole = dot(paint, paint);
    if whole < FAINT {
        return None;
    }
    let alpha = ((dot(drawn, paint) * 255 + whole / 2) / whole).min(255);
    let miss = [0, 1, 2].map(|i| drawn[i] - (paint[i] * alpha + 127) / 255);
    let miss = dot(miss, miss);
    (miss <= FAINT).then_some((miss, alpha as u8))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKIN: [u8; 3] = [240, 200, 170];

    /// A row of paint over white with these alphas (255ths), three rows high, labelled where `labels` says.
    fn fill(paint: [u8; 3], alphas: &[u8], labels: &[u8]) -> (Vec<[u8; 3]>, Vec<f32>) {
        let drawn =
            |alpha: &u8| paint.map(|value| 255 - ((u32::from(255 - value) * u32::from(*alpha) + 127) / 255) as u8);
        let row: Vec<[u8; 3]> = alphas.iter().map(drawn).collect();
        let (image, labels) = ([&row[..]; 3].concat(), [labels; 3].concat());
        let (mut color, mut alpha) = (vec![0; image.len() * 3], vec![9.0; image.len()]);
        let got = fill_matte(image.as_flattened(), 3, alphas.len(), &labels, &mut color, &mut alpha);
        assert_eq!(got, Ok(()));
        (color.as_chunks::<3>().0[..alphas.len()].to_vec(), alpha[..alphas.len()].to_vec())
    }

    #[test]
    fn a_soft_border_gets_its_alpha_and_its_paint_back() {
        let (color, alpha) = fill(SKIN, &[255, 255, 255, 153, 0], &[1, 1, 1, 1, 0]);
        assert_eq!((&alpha[..3], alpha[4]), (&[1.0; 3][..], 0.0));
        assert!((alpha[3] - 0.6).abs() < 0.02, "{}", alpha[3]);
        assert!(color[3].iter().zip(SKIN).all(|(got, want)| got.abs_diff(want) <= 3), "{:?}", color[3]);
    }

    #[test]
    fn hard_light_paint_stays_opaque_to_its_border() {
        for paint in [SKIN, [250, 250, 250], [255, 255, 255], [0, 0, 0]] {
            let (color, alpha) = fill(paint, &[255; 4], &[1, 1, 1, 0]);
            assert_eq!((&color[..3], &alpha[..3]), (&[paint; 3][..], &[1.0; 3][..]));
        }
    }

    #[test]
    fn grey_beside_an_outline_is_half_covered_ink_and_not_light_paint() {
        // Below, the outline is black; above, the line is thin, and the grey farther in would explain the border too.
        let row = |line: u8| [SKIN, SKIN, [130; 3], [line; 3], [255; 3]];
        let image = [row(120), row(120), row(0)].concat();
        let (mut color, mut alpha) = ([0; 45], [9.0; 15]);
        assert_eq!(
            fill_matte(image.as_flattened(), 3, 5, &[[1, 1, 1, 1, 0]; 3].concat(), &mut color, &mut alpha),
            Ok(())
        );
        assert_eq!((alpha[2], alpha[13]), (1.0, 1.0));
        assert_eq!((alpha[3], &color[9..12]), (OPACITY[135], &[0; 3][..]));
    }

    #[test]
    fn paint_behind_the_corner_of_an_outline_is_opaque() {
        let image = [[[255; 3], [20; 3], [0; 3]], [[20; 3], [110; 3], [0; 3]], [[0; 3], [0; 3], [0; 3]]].concat();
        let (mut color, mut alpha) = ([0; 27], [9.0; 9]);
        assert_eq!(
            fill_matte(image.as_flattened(), 3, 3, &[0, 1, 1, 1, 1, 1, 1, 1, 1], &mut color, &mut alpha),
            Ok(())
        );
        assert_eq!((alpha[4], &color[12..15]), (1.0, &[110; 3][..]));
    }

    #[test]
    fn a_figure_cut_by_the_picture_has_no_border_there() {
        let (_, alpha) = fill(SKIN, &[120, 255, 255], &[1, 1, 1]);
        assert_eq!(alpha, [1.0; 3]);
    }

    #[test]
    fn sides_are_shallower_than_corners() {
        let labels = [[0, 1, 1, 1], [1, 1, 1, 1], [1, 1, 1, 1]].concat();
        let mut out = vec![9; 12];
        (0..3).for_each(|row| depth_row(&labels, row, &mut [0; 6], &mut out[row * 4..row * 4 + 4]));
        assert_eq!(out, [[0, 1, 3, 3], [1, 2, 3, 3], [3, 3, 3, 3]].concat());
    }

    #[test]
    fn paint_that_explains_nothing_leaves_the_border_opaque() {
        assert_eq!(explain([10, 200, 10], [200, 10, 10]), None);
        assert_eq!(explain(SKIN, SKIN), Some((0, 255)));
    }
}
