//! Which of the colours around it a pixel of an antialiased or scanned segmentation belongs to.
//!
//! A pixel between two limbs may have just the colour of a third one: half red and half yellow is orange. So a colour
//! counts as it reads only where it is solid nearby (the middle of a 3 x 3 block of it); elsewhere a pixel is first
//! explained as a mixture of the solid colours around it and the background, and goes to the colour that covers most of
//! it. Only where no mixture explains it does the pixel's own reading count: a part of the drawing thinner than 3
//! pixels. Assumes that colours were mixed as they are stored, without gamma.

use glam::Vec3;
use rayon::prelude::*;

/// Class of a pixel that is no colour of the palette. Other classes are indices into the palette.
pub(crate) const NONE: u8 = u8::MAX;

/// Class of a transparent pixel: background whatever its colour.
pub(crate) const CLEAR: u8 = u8::MAX - 1;

/// How far solid colours are looked for: an antialiased border is about two pixels wide, and the middle of a solid block
/// lies one further in.
const AROUND: usize = 3;

/// How far single pixels of a colour are looked for when solid ones explain nothing: along a sliver too thin to be solid.
const FARTHER: usize = 5;

/// Pixels looked at together: most blocks are solid throughout.
const BLOCK: usize = 32;

/// The colours of the classes. Those of `background` may be mixed in anywhere.
pub(crate) struct Palette {
    pub colors: Vec<Vec3>,
    pub background: Vec<u8>,
    pub tolerance: f32,
}

/// Writes the settled classes of pixels that read as `classes`. Row-major, `width` columns, rows in parallel.
pub(crate) fn settle<const C: usize>(
    pixels: &[[u8; C]],
    width: usize,
    classes: &[u8],
    palette: &Palette,
    out: &mut [u8],
) {
    let mut solid = vec![NONE; classes.len()];
    let rows = solid.par_chunks_mut(width).enumerate();
    rows.for_each_init(|| vec![NONE; width + 2], |upright, (row, solid)| solid_row(classes, row, upright, solid));
    let map = Map { classes, solid: &solid, width };
    let rows = out.par_chunks_mut(width).zip(pixels.par_chunks(width)).enumerate();
    rows.for_each_init(Vec::new, |seen, (row, (out, pixels))| settle_row(palette, map, row, pixels, seen, out));
}

/// The class of every pixel whose eight neighbours have it too, else NONE. Beyond the picture it goes on as at its
/// border. `upright` is room for one row and a pixel on either side.
fn solid_row(classes: &[u8], row: usize, upright: &mut [u8], out: &mut [u8]) {
    let width = out.len();
    let line = |row: usize| &classes[row * width..(row + 1) * width];
    let (above, here) = (line(row.saturating_sub(1)), line(row));
    let below = line((row + 1).min(classes.len() / width - 1));
    for (upright, ((above, here), below)) in upright[1..].iter_mut().zip(above.iter().zip(here).zip(below)) {
        *upright = if (above ^ here) | (below ^ here) == 0 { *here } else { NONE };
    }
    (upright[0], upright[width + 1]) = (upright[1], upright[width]);
    let sides = upright.iter().zip(&upright[1..]).zip(&upright[2..]);
    for (out, ((left, here), right)) in out.iter_mut().zip(sides) {
        *out = if (left ^ here) | (right ^ here) == 0 { *here } else { NONE };
    }
}

/// How the pixels read, and where that is solid.
#[derive(Clone, Copy)]
struct Map<'a> {
    classes: &'a [u8],
    solid: &'a [u8],
    width: usize,
}

/// Adds the classes within `around` pixels to `seen`, each once, in reading order.
fn look_around(classes: &[u8], width: usize, [row, column]: [usize; 2], around: usize, seen: &mut Vec<u8>) {
    let columns = column.saturating_sub(around)..(column + around + 1).min(width);
    let rows = row.saturating_sub(around)..(row + around + 1).min(classes.len() / width);
    for row in rows {
        for class in &classes[row * width..][columns.clone()] {
            if *class < CLEAR && !seen.contains(class) {
                seen.push(*class);
            }
        }
    }
}

fn settle_row<const C: usize>(
    palette: &Palette,
    map: Map,
    row: usize,
    pixels: &[[u8; C]],
    seen: &mut Vec<u8>,
    out: &mut [u8],
) {
    let range = row * map.width..(row + 1) * map.width;
    out.copy_from_slice(&map.classes[range.clone()]);
    for (block, solid) in map.solid[range].chunks(BLOCK).enumerate() {
        // Not `contains`: the fold is worked on many bytes at a time.
        if !solid.iter().fold(false, |open, class| open | (*class == NONE)) {
            continue;
        }
        for column in (block * BLOCK..).zip(solid).filter(|(_, class)| **class == NONE).map(|(column, _)| column) {
            if out[column] != CLEAR {
                out[column] = settle_pixel(palette, map, [row, column], &pixels[column], seen);
            }
        }
    }
}

/// The class of a pixel that is not solid.
fn settle_pixel(palette: &Palette, map: Map, place: [usize; 2], pixel: &[u8], seen: &mut Vec<u8>) -> u8 {
    let read = map.classes[place[0] * map.width + place[1]];
    seen.clear();
    look_around(map.solid, map.width, place, AROUND, seen);
    if seen.contains(&read) {
        return read;
    }
    for class in &palette.background {
        if !seen.contains(class) {
            seen.push(*class);
        }
    }
    let color = Vec3::new(f32::from(pixel[0]), f32::from(pixel[1]), f32::from(pixel[2]));
    let mut mixed = palette.unmix(color, seen);
    if mixed.is_none() && read == NONE {
        look_around(map.classes, map.width, place, FARTHER, seen);
        mixed = palette.unmix(color, seen);
    }
    mixed.unwrap_or(read)
}

impl Palette {
    /// The class that covers most of a mixture of two or, failing that, three of the colours `among`.
    fn unmix(&self, color: Vec3, among: &[u8]) -> Option<u8> {
        let corners = || among.iter().map(|class| (*class, self.colors[usize::from(*class)])).enumerate();
        let mut best = (self.tolerance, None);
        for (i, a) in corners() {
            for (_, b) in corners().skip(i + 1) {
                closer(&mut best, mixture_of_two(color, a, b));
            }
        }
        if best.1.is_some() {
            return best.1;
        }
        for (i, a) in corners() {
            for (j, b) in corners().skip(i + 1) {
                for (_, c) in corners().skip(j + 1) {
                    closer(&mut best, mixture_of_three(color, a, b, c));
                }
            }
        }
        best.1
    }
}

/// Keeps the mixture that misses the colour least; the first of equally good ones.
fn closer(best: &mut (f32, Option<u8>), (miss, class): (f32, u8)) {
    if miss < best.0 || (miss == best.0 && best.1.is_none()) {
        *best = (miss, Some(class));
    }
}

type Corner = (u8, Vec3);

fn mixture_of_two(color: Vec3, a: Corner, b: Corner) -> (f32, u8) {
    let way = b.1 - a.1;
    let part = ((color - a.1).dot(way) / way.length_squared()).clamp(0.0, 1.0);
    ((color - a.1 - way * part).length(), if part > 0.5 { b.0 } else { a.0 })
}

/// The mixture of three colours with no negative part; an infinite miss where there is none.
fn mixture_of_three(color: Vec3, a: Corner, b: Corner, c: Corner) -> (f32, u8) {
    let (u, v, w) = (b.1 - a.1, c.1 - a.1, color - a.1);
    let (uu, uv, vv, uw, vw) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let area = uu * vv - uv * uv;
    let (s, t) = ((uw * vv - vw * uv) / area, (vw * uu - uw * uv) / area);
    let first = 1.0 - s - t;
    // Colours in one line have no area: the comparison with NaN fails, and their pairs have been tried already.
    if area > 0.0 && s >= 0.0 && t >= 0.0 && first >= 0.0 {
        let class = if first >= s && first >= t { a.0 } else { [b.0, c.0][usize::from(t > s)] };
        ((w - u * s - v * t).length(), class)
    } else {
        (f32::INFINITY, a.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn palette(tolerance: f32) -> Palette {
        let colors = vec![Vec3::ZERO, Vec3::new(255., 0., 0.), Vec3::new(0., 255., 0.), Vec3::new(0., 0., 255.)];
        Palette { colors, background: vec![0], tolerance }
    }

    #[test]
    fn a_mixture_goes_to_the_colour_that_covers_most_of_it() {
        let palette = palette(3.0);
        assert_eq!(palette.unmix(Vec3::new(160., 95., 1.), &[0, 1, 2]), Some(1));
        assert_eq!(palette.unmix(Vec3::new(95., 160., 1.), &[0, 1, 2]), Some(2));
        assert_eq!(palette.unmix(Vec3::new(60., 0., 0.), &[0, 1, 2]), Some(0));
        assert_eq!(palette.unmix(Vec3::new(80., 100., 75.), &[1, 2, 3]), Some(2));
        assert_eq!(palette.unmix(Vec3::new(80., 75., 100.), &[1, 2, 3]), Some(3));
    }

    #[test]
    fn what_no_mixture_explains_is_nothing() {
        assert_eq!(palette(3.0).unmix(Vec3::new(250., 250., 250.), &[0, 1, 2]), None);
        assert_eq!(palette(3.0).unmix(Vec3::new(80., 100., 75.), &[0, 2]), None);
    }

    #[test]
    fn solid_is_the_middle_of_a_block_and_the_border_goes_on() {
        let classes = [[1, 1, 1, 2], [1, 1, 1, 2], [1, 1, 3, 2]].concat();
        let mut out = vec![9; 12];
        (0..3).for_each(|row| solid_row(&classes, row, &mut [0; 6], &mut out[row * 4..row * 4 + 4]));
        assert_eq!(out, [[1, 1, NONE, NONE], [1, NONE, NONE, NONE], [1, NONE, NONE, NONE]].concat());
    }
}
