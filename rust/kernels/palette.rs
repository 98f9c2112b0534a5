//! Limb colours to labels.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, section 3.3.1: "the pixels belonging to a given limb are obtained by color
//! segmentation". The exact reading takes flat colours as they are. With a tolerance, for scanned or antialiased
//! colours, every pixel is read as the nearest colour first; `settle` then looks at its neighbours.

use crate::error::{KernelError, check_length};
use crate::settle::{CLEAR, NONE, Palette, settle};
use glam::Vec3;
use rayon::prelude::*;

/// A flat colour and the label it stands for. The background's colours have label 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Swatch {
    /// Red, green, blue.
    pub color: [u8; 3],
    /// 0 none, v + 1 limb v.
    pub label: u8,
}

/// What matched nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unmatched {
    /// How many pixels.
    pub count: usize,
    /// The first one's row and column, in reading order.
    pub first: Option<[usize; 2]>,
}

/// Pixels with less alpha than this are background.
const OPAQUE: u8 = 128;

/// The most swatches: classes are bytes.
pub const MOST_SWATCHES: usize = CLEAR as usize;

/// Labels a segmentation of `channels` (3 or 4) bytes a pixel; pixels that match no swatch get 0 and are counted.
///
/// `tolerance` is a Euclidean distance in 8-bit RGB, 0 for exact colours. Rows are worked in parallel.
pub fn palette_labels(
    image: &[u8],
    channels: usize,
    width: usize,
    swatches: &[Swatch],
    tolerance: f64,
    out: &mut [u8],
) -> Result<Unmatched, KernelError> {
    check_length("out", image.len() / channels.max(1), out.len())?;
    if swatches.len() > MOST_SWATCHES {
        return Err(KernelError::Argument { argument: "colors", problem: "more than 254 colours" });
    }
    let width = width.max(1);
    match channels {
        3 => Ok(label::<3>(image, width, swatches, tolerance, out)),
        4 => Ok(label::<4>(image, width, swatches, tolerance, out)),
        _ => Err(KernelError::Argument { argument: "segmentation", problem: "want 3 or 4 channels" }),
    }
}

fn label<const C: usize>(image: &[u8], width: usize, swatches: &[Swatch], tolerance: f64, out: &mut [u8]) -> Unmatched {
    let pixels = image.as_chunks::<C>().0;
    if tolerance > 0.0 {
        let mut classes = vec![NONE; out.len()];
        let nearest = Nearest::new(swatches, tolerance);
        classes.par_chunks_mut(width).zip(pixels.par_chunks(width)).for_each(|(classes, pixels)| {
            let mut last = 0;
            classify(pixels, NONE, classes, |color| nearest.class(color, &mut last));
        });
        return label_settled(pixels, width, &classes, swatches, tolerance, out);
    }
    let exact = Exact::new(swatches);
    let rows = out.par_chunks_mut(width).zip(pixels.par_chunks(width)).enumerate();
    rows.map(|(row, (out, pixels))| classify(pixels, 0, out, |color| exact.label(color)).at_row(row))
        .reduce(Unmatched::default, Unmatched::merge)
}

fn label_settled<const C: usize>(
    pixels: &[[u8; C]],
    width: usize,
    classes: &[u8],
    swatches: &[Swatch],
    tolerance: f64,
    out: &mut [u8],
) -> Unmatched {
    let color = |swatch: &Swatch| Vec3::from_array(swatch.color.map(f32::from));
    let background = (0u8..).zip(swatches).filter(|(_, swatch)| swatch.label == 0);
    let palette = Palette {
        colors: swatches.iter().map(color).collect(),
        background: background.map(|(class, _)| class).collect(),
        tolerance: tolerance as f32,
    };
    let mut settled = vec![NONE; classes.len()];
    settle(pixels, width, classes, &palette, &mut settled);
    let label = |class: u8| match class {
        NONE => None,
        CLEAR => Some(0),
        class => swatches.get(usize::from(class)).map(|swatch| swatch.label),
    };
    let rows = out.par_chunks_mut(width).zip(settled.par_chunks(width)).enumerate();
    rows.map(|(row, (out, settled))| classify(settled.as_chunks::<1>().0, 0, out, |[class]| label(*class)).at_row(row))
        .reduce(Unmatched::default, Unmatched::merge)
}

impl Unmatched {
    fn add(&mut self, found: Option<u8>, column: usize, count: usize) {
        if found.is_none() {
            self.count += count;
            self.first = self.first.or(Some([0, column]));
        }
    }

    fn at_row(self, row: usize) -> Self {
        Unmatched { count: self.count, first: self.first.map(|[_, column]| [row, column]) }
    }

    fn merge(self, below: Self) -> Self {
        let first = [self.first, below.first].into_iter().flatten().min();
        Unmatched { count: self.count + below.count, first }
    }
}

/// Pixels looked at together: a block of one colour is looked up once.
const BLOCK: usize = 16;

/// Reads a row of colours by `lookup`; `absent` is written where it finds nothing.
fn classify<const C: usize>(
    pixels: &[[u8; C]],
    absent: u8,
    out: &mut [u8],
    mut lookup: impl FnMut(&[u8; C]) -> Option<u8>,
) -> Unmatched {
    let mut unmatched = Unmatched::default();
    let mut known: Option<([u8; C], Option<u8>)> = None;
    let mut read = |pixel: &[u8; C]| match known {
        Some((color, found)) if color == *pixel => found,
        _ => known.insert((*pixel, lookup(pixel))).1,
    };
    let (blocks, rest) = pixels.as_chunks::<BLOCK>();
    let (block_labels, rest_labels) = out.as_chunks_mut::<BLOCK>();
    for (block, (pixels, out)) in blocks.iter().zip(block_labels).enumerate() {
        let bytes = pixels.as_flattened();
        // Equal to itself one pixel on: all of one colour.
        if bytes[C..] == bytes[..bytes.len() - C] {
            let found = read(&pixels[0]);
            *out = [found.unwrap_or(absent); BLOCK];
            unmatched.add(found, block * BLOCK, BLOCK);
            continue;
        }
        for (i, (pixel, out)) in pixels.iter().zip(out).enumerate() {
            let found = read(pixel);
            *out = found.unwrap_or(absent);
            unmatched.add(found, block * BLOCK + i, 1);
        }
    }
    for (i, (pixel, out)) in rest.iter().zip(rest_labels).enumerate() {
        let found = read(pixel);
        *out = found.unwrap_or(absent);
        unmatched.add(found, blocks.len() * BLOCK + i, 1);
    }
    unmatched
}

fn packed(color: &[u8]) -> u32 {
    u32::from_le_bytes([color[0], color[1], color[2], 0])
}

fn is_clear<const C: usize>(pixel: &[u8; C]) -> bool {
    C == 4 && pixel[C - 1] < OPAQUE
}

/// Colour to label by open addressing; at least half of the places are free, so that every search ends.
struct Exact {
    places: Vec<Option<(u32, u8)>>,
    bits: u32,
}

impl Exact {
    fn new(swatches: &[Swatch]) -> Self {
        let bits = (2 * swatches.len() + 2).next_power_of_two().ilog2();
        let mut table = Exact { places: vec![None; 1 << bits], bits };
        for swatch in swatches {
            let key = packed(&swatch.color);
            let place = table.place(key);
            table.places[place] = table.places[place].or(Some((key, swatch.label)));
        }
        table
    }

    fn place(&self, key: u32) -> usize {
        // Multiplicative hashing: spreads the 24 bits of a colour over the top ones.
        let mut place = (key.wrapping_mul(0x9E37_79B1) >> (32 - self.bits)) as usize;
        while self.places[place].is_some_and(|(other, _)| other != key) {
            place = (place + 1) % self.places.len();
        }
        place
    }

    fn label<const C: usize>(&self, pixel: &[u8; C]) -> Option<u8> {
        if is_clear(pixel) { Some(0) } else { self.places[self.place(packed(pixel))].map(|(_, label)| label) }
    }
}

/// Colour to the nearest swatch within the tolerance.
struct Nearest<'a> {
    swatches: &'a [Swatch],
    /// The largest squared distance that matches.
    most: i32,
    /// Nearer than this (squared) to a swatch no other can be nearer: half the way to the next one.
    sure: Vec<i32>,
}

impl<'a> Nearest<'a> {
    fn new(swatches: &'a [Swatch], tolerance: f64) -> Self {
        let most = (tolerance * tolerance) as i32;
        let next = |i: usize| {
            let others = swatches.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, other)| squared(&swatches[i].color, &other.color)).min()
        };
        let sure = (0..swatches.len()).map(|i| next(i).map_or(most, |next| (next / 4).min(most)));
        Nearest { swatches, most, sure: sure.collect() }
    }

    /// `last` is the class of the pixel before: as a rule this one's too.
    fn class<const C: usize>(&self, pixel: &[u8; C], last: &mut usize) -> Option<u8> {
        if is_clear(pixel) {
            return Some(CLEAR);
        }
        if squared(&self.swatches.get(*last)?.color, pixel) >= self.sure[*last] {
            let distance = |swatch: &Swatch| squared(&swatch.color, pixel);
            let (distance, class) = self.swatches.iter().map(distance).zip(0..).min()?;
            if distance > self.most {
                return None;
            }
            *last = class;
        }
        u8::try_from(*last).ok()
    }
}

fn squared(a: &[u8; 3], b: &[u8]) -> i32 {
    (0..3).map(|i| i32::from(a[i]) - i32::from(b[i])).map(|d| d * d).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: [u8; 3] = [255, 0, 0];
    const ORANGE: [u8; 3] = [255, 128, 0];
    const YELLOW: [u8; 3] = [255, 255, 0];
    const BLACK: [u8; 3] = [0, 0, 0];

    fn swatches() -> Vec<Swatch> {
        [(RED, 1), (ORANGE, 2), (YELLOW, 3), (BLACK, 0)].map(|(color, label)| Swatch { color, label }).to_vec()
    }

    fn labels(image: &[[u8; 3]], width: usize, tolerance: f64) -> (Vec<u8>, Unmatched) {
        let mut out = vec![99; image.len()];
        let unmatched = palette_labels(image.as_flattened(), 3, width, &swatches(), tolerance, &mut out);
        (out, unmatched.unwrap_or_default())
    }

    #[test]
    fn exact_colours_keep_their_labels_and_strangers_are_counted() {
        let image = [RED, ORANGE, [1, 2, 3], YELLOW, BLACK, [9, 9, 9]];
        let (out, unmatched) = labels(&image, 3, 0.0);
        assert_eq!(out, [1, 2, 0, 3, 0, 0]);
        assert_eq!(unmatched, Unmatched { count: 2, first: Some([0, 2]) });
    }

    #[test]
    fn long_runs_of_strangers_are_counted_from_their_first_pixel() {
        let mut image = [BLACK; 100];
        image[40..90].fill([7, 7, 7]);
        assert_eq!(labels(&image, 50, 0.0).1, Unmatched { count: 50, first: Some([0, 40]) });
        assert_eq!(labels(&image, 100, 0.0).1, Unmatched { count: 50, first: Some([0, 40]) });
    }

    #[test]
    fn a_border_of_red_and_yellow_is_not_orange() {
        let row = [RED, RED, RED, RED, [255, 120, 0], [255, 140, 0], YELLOW, YELLOW, YELLOW, YELLOW];
        let (out, unmatched) = labels(&[row; 5].concat(), 10, 20.0);
        assert_eq!(out, [[1, 1, 1, 1, 1, 3, 3, 3, 3, 3]; 5].concat());
        assert_eq!(unmatched.count, 0);
    }

    #[test]
    fn solid_and_thin_orange_stays_orange() {
        let (out, _) = labels(&[[255, 122, 5]; 9], 3, 20.0);
        assert_eq!(out, [2; 9]);
        let (out, _) = labels(&[[BLACK; 5], [ORANGE; 5], [BLACK; 5]].concat(), 5, 20.0);
        assert_eq!(out, [[0; 5], [2; 5], [0; 5]].concat());
    }

    #[test]
    fn transparent_is_background_whatever_its_colour() {
        let image = [[255, 0, 0, 127], [255, 0, 0, 128], [3, 3, 3, 0]];
        for tolerance in [0.0, 10.0] {
            let mut out = [9; 3];
            let got = palette_labels(image.as_flattened(), 4, 3, &swatches(), tolerance, &mut out);
            assert_eq!((out, got), ([0, 1, 0], Ok(Unmatched::default())));
        }
    }

    #[test]
    fn every_colour_of_a_full_palette_is_found() {
        let color = |i: usize| [(i * 37 % 256) as u8, (i * 91 % 256) as u8, i as u8];
        let swatches: Vec<_> = (0..MOST_SWATCHES).map(|i| Swatch { color: color(i), label: i as u8 }).collect();
        let image: Vec<_> = (0..MOST_SWATCHES).map(color).collect();
        let mut out = vec![0; image.len()];
        let got = palette_labels(image.as_flattened(), 3, image.len(), &swatches, 0.0, &mut out);
        assert_eq!(got, Ok(Unmatched::default()));
        assert_eq!(out, (0..MOST_SWATCHES).map(|i| i as u8).collect::<Vec<_>>());
    }
}
