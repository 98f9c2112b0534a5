//! Renders a flat mesh with a texture: bilinear, premultiplied, triangle over triangle in the order given.
//!
//! Every pixel centre on an edge that triangles share is painted by exactly one of them (`scan.rs`): neither cracks nor
//! double blending. Bands of rows are worked alone, so neither bands nor threads change a bit of the result.

use crate::error::{KernelError, check_length};
use crate::scan::Outline;
use crate::texels::{FULL, LANES, Ramp, Texels, Texture, straight};
use glam::{DVec2, IVec2};
use multiversion::multiversion;
use rayon::prelude::*;
use std::ops::Range;

/// Rows of a band, before it is averaged down: its buffer should stay in a core's cache.
const BAND_ROWS: usize = 16;

/// Largest side of the picture, samples counted.
const LARGEST_SIDE: usize = 1 << 16;

/// A mesh: places in the picture and in the texture, both (x, y) in pixels with centres at integers.
#[derive(Debug, Clone, Copy)]
pub struct Sheet<'a> {
    /// Where each vertex is in the picture.
    pub vertices: &'a [DVec2],
    /// Where each vertex is in the texture.
    pub texture_coordinates: &'a [DVec2],
    /// Three vertices each, in painting order.
    pub triangles: &'a [[u32; 3]],
}

/// The picture to fill, straight RGBA and zero at first, and how finely it is sampled.
#[derive(Debug)]
pub struct Target<'a> {
    /// Row-major.
    pub pixels: &'a mut [[u8; 4]],
    /// Columns.
    pub width: usize,
    /// Samples a pixel along each side.
    pub samples: usize,
}

/// A triangle ready for its spans.
#[derive(Debug)]
struct Piece {
    outline: Outline,
    ramp: Ramp,
    low: IVec2,
    high: IVec2,
}

impl Piece {
    fn new(corners: [DVec2; 3], places: [DVec2; 3], texels: &Texels) -> Option<Self> {
        let outline = Outline::new(corners)?;
        let [a, b, c] = corners;
        let (p, q, r) = (places[0], places[1] - places[0], places[2] - places[0]);
        let twice_area = (b - a).perp_dot(c - a);
        let along_x = (q * (c.y - a.y) - r * (b.y - a.y)) / twice_area;
        let along_y = (r * (b.x - a.x) - q * (c.x - a.x)) / twice_area;
        let ramp = Ramp::new(a, p, along_x, along_y);
        let (low, high) = (p.min(p + q).min(p + r), p.max(p + q).max(p + r));
        let (low, high) = (texels.clamped(low), texels.clamped(high));
        Some(Piece { outline, ramp, low, high })
    }

    /// Paints a span over what is there.
    #[inline(always)]
    fn paint(&self, texels: &Texels, row: i64, column: usize, out: &mut [[f32; 4]]) {
        for (block, out) in out.chunks_mut(LANES).enumerate() {
            let found = texels.look_up(self.ramp.run(column + block * LANES, row, self.low, self.high));
            for (lane, below) in out.iter_mut().enumerate() {
                let color = texels.read(&found, lane);
                if color[3] == FULL {
                    *below = color;
                } else {
                    let through = 1.0 - color[3] * (1.0 / FULL);
                    *below = std::array::from_fn(|k| color[k] + below[k] * through);
                }
            }
        }
    }
}

/// Renders `sheet` into `target`.
pub fn render_sheet(sheet: Sheet<'_>, texture: Texture<'_>, target: Target<'_>) -> Result<(), KernelError> {
    let Target { pixels, width, samples } = target;
    check_length("texture_coordinates", sheet.vertices.len(), sheet.texture_coordinates.len())?;
    if let Some(index) = sheet.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= sheet.vertices.len())) {
        return Err(KernelError::Item { argument: "triangles", problem: "want indices of vertices", index });
    }
    let height = pixels.len().checked_div(width).unwrap_or(0);
    if samples == 0 || width.max(height).saturating_mul(samples) > LARGEST_SIDE {
        return Err(KernelError::Argument { argument: "size", problem: "want 1 to 65536 samples a side" });
    }
    if pixels.is_empty() || sheet.triangles.is_empty() {
        return Ok(());
    }
    let used = || sheet.triangles.iter().flatten().map(|vertex| sheet.texture_coordinates[*vertex as usize]);
    let (low, high) = used().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), place| (l.min(place), h.max(place)));
    let texels = Texels::new(texture, low, high)?;
    let pieces = pieces(sheet, &texels, samples);
    let rows = BAND_ROWS.div_ceil(samples);
    let bins = bins(&pieces, height * samples, rows * samples);
    let bands = pixels.par_chunks_mut(rows * width).zip(bins).enumerate();
    bands.for_each_init(Buffer::default, |buffer, (band, (out, bin))| {
        let first = band * rows * samples;
        buffer.prepare(out.len() / width * samples, width * samples);
        bin.iter().for_each(|piece| paint_piece(&pieces[*piece as usize], &texels, first, buffer));
        buffer.resolve(samples, out);
    });
    Ok(())
}

fn pieces(sheet: Sheet<'_>, texels: &Texels, samples: usize) -> Vec<Piece> {
    let scale = samples as f64;
    let corner = |vertex: u32| sheet.vertices[vertex as usize] * scale + (scale - 1.0) / 2.0;
    let place = |vertex: u32| texels.local(sheet.texture_coordinates[vertex as usize]);
    let piece = |triangle: &[u32; 3]| Piece::new(triangle.map(corner), triangle.map(place), texels);
    sheet.triangles.iter().filter_map(piece).collect()
}

/// The pieces that may touch each band, in painting order.
fn bins(pieces: &[Piece], height: usize, rows: usize) -> Vec<Vec<u32>> {
    let mut bins = vec![Vec::new(); height.div_ceil(rows)];
    for (index, piece) in pieces.iter().enumerate() {
        let Range { start, end } = piece.outline.rows();
        let (start, end) = (start.clamp(0, height as i64) as usize, end.clamp(0, height as i64) as usize);
        if start < end {
            bins[start / rows..=(end - 1) / rows].iter_mut().for_each(|bin| bin.push(index as u32));
        }
    }
    bins
}

/// Samples of a band and the columns that were painted in each row. Clear outside of them.
#[derive(Default)]
struct Buffer {
    colors: Vec<[f32; 4]>,
    painted: Vec<Range<usize>>,
    width: usize,
}

impl Buffer {
    /// Clears what was painted and takes the size of the next band.
    fn prepare(&mut self, rows: usize, width: usize) {
        for (line, columns) in self.colors.chunks_mut(self.width.max(1)).zip(&self.painted) {
            line.get_mut(columns.clone()).unwrap_or_default().fill([0.0; 4]);
        }
        self.colors.resize(rows * width, [0.0; 4]);
        self.painted.clear();
        self.painted.resize(rows, Range { start: usize::MAX, end: 0 });
        self.width = width;
    }

    /// Averages the samples of each pixel and writes straight bytes.
    fn resolve(&self, samples: usize, out: &mut [[u8; 4]]) {
        let width = self.width / samples;
        for (row, out) in out.chunks_mut(width).enumerate() {
            let lines = row * samples..(row + 1) * samples;
            let (left, right) = self.painted[lines.clone()]
                .iter()
                .fold((usize::MAX, 0), |(left, right), range| (left.min(range.start), right.max(range.end)));
            if left < right {
                let columns = left / samples..right.div_ceil(samples);
                resolve_row(
                    &self.colors[lines.start * self.width..lines.end * self.width],
                    self.width,
                    samples,
                    columns,
                    out,
                );
            }
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn paint_piece(piece: &Piece, texels: &Texels, first: usize, buffer: &mut Buffer) {
    let Buffer { colors, painted, width } = buffer;
    let rows = first as i64..(first + painted.len()) as i64;
    piece.outline.scan(rows, *width, |row, columns| {
        let line = row as usize - first;
        painted[line] = painted[line].start.min(columns.start)..painted[line].end.max(columns.end);
        let start = columns.start;
        piece.paint(texels, row, start, &mut colors[line * *width..][columns]);
    });
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn resolve_row(colors: &[[f32; 4]], width: usize, samples: usize, columns: Range<usize>, out: &mut [[u8; 4]]) {
    if samples == 1 {
        let (from, to) = (colors[columns.clone()].as_chunks::<LANES>(), out[columns].as_chunks_mut::<LANES>());
        from.0.iter().zip(to.0).for_each(|(colors, out)| *out = straight(colors));
        let mut rest = [[0.0; 4]; LANES];
        rest[..from.1.len()].copy_from_slice(from.1);
        to.1.iter_mut().zip(straight(&rest)).for_each(|(out, pixel)| *out = pixel);
        return;
    }
    let first = columns.start;
    for (block, out) in out[columns].chunks_mut(LANES).enumerate() {
        let mut means = [[0.0; 4]; LANES];
        for (lane, mean) in means[..out.len()].iter_mut().enumerate() {
            *mean = pixel_mean(colors, width, samples, first + block * LANES + lane);
        }
        out.iter_mut().zip(straight(&means)).for_each(|(out, pixel)| *out = pixel);
    }
}

/// The mean of a pixel's samples.
#[inline(always)]
fn pixel_mean(colors: &[[f32; 4]], width: usize, samples: usize, column: usize) -> [f32; 4] {
    let mut sum = [0.0; 4];
    for line in colors.chunks_exact(width) {
        for color in &line[column * samples..(column + 1) * samples] {
            (0..4).for_each(|k| sum[k] += color[k]);
        }
    }
    sum.map(|sum| sum / (samples * samples) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec2; 4] =
        [DVec2::new(-0.5, -0.5), DVec2::new(4.5, -0.5), DVec2::new(4.5, 3.5), DVec2::new(-0.5, 3.5)];
    const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    fn checkerboard() -> Vec<[u8; 4]> {
        (0..20u8).map(|i| if (i % 5 + i / 5) % 2 == 0 { [9 * i, 255, 0, 255] } else { [40, 0, 7 * i, 90] }).collect()
    }

    fn render(vertices: &[DVec2], triangles: &[[u32; 3]], samples: usize) -> Result<Vec<[u8; 4]>, KernelError> {
        let pixels = checkerboard();
        let sheet = Sheet { vertices, texture_coordinates: &CORNERS, triangles };
        let mut out = vec![[0; 4]; 20];
        let target = Target { pixels: &mut out, width: 5, samples };
        render_sheet(sheet, Texture { pixels: &pixels, width: 5, height: 4 }, target).map(|()| out)
    }

    #[test]
    fn a_checkerboard_in_place_is_kept_to_the_bit() {
        assert_eq!(render(&CORNERS, &HALVES, 1), Ok(checkerboard()));
    }

    #[test]
    fn a_whole_step_moves_every_pixel_and_leaves_nothing_behind() {
        let moved = CORNERS.map(|corner| corner + DVec2::new(2.0, 1.0));
        let texture = checkerboard();
        let wanted: Vec<[u8; 4]> =
            (0..20).map(|i| if i % 5 >= 2 && i >= 5 { texture[i - 7] } else { [0; 4] }).collect();
        assert_eq!(render(&moved, &HALVES, 1), Ok(wanted));
    }

    #[test]
    fn a_buffer_is_clear_again_for_the_next_band() {
        let mut buffer = Buffer::default();
        buffer.prepare(2, 3);
        buffer.colors[4] = [1.0; 4];
        buffer.painted[1] = 1..2;
        for (rows, width) in [(3, 4), (1, 2)] {
            buffer.prepare(rows, width);
            assert_eq!(buffer.colors, vec![[0.0; 4]; rows * width]);
            assert!(buffer.painted.iter().all(Range::is_empty));
        }
    }

    #[test]
    fn samples_of_a_pixel_are_averaged() {
        // A quad over the left half of the first column: two of its four samples.
        let half = [(-0.5, -0.5), (0.0, -0.5), (0.0, 3.5), (-0.5, 3.5)].map(DVec2::from);
        let alphas = |out: Vec<[u8; 4]>| out.iter().map(|pixel| pixel[3] > 0).collect::<Vec<_>>();
        let wanted: Vec<bool> = (0..20).map(|i| i % 5 == 0).collect();
        assert_eq!(render(&half, &HALVES, 2).map(alphas), Ok(wanted));
    }

    #[test]
    fn wrong_sizes_and_corners_are_refused() {
        assert!(matches!(render(&CORNERS, &[[0, 1, 4]], 1), Err(KernelError::Item { argument: "triangles", .. })));
        assert!(matches!(render(&CORNERS[..3], &[], 1), Err(KernelError::Length { .. })));
        assert!(matches!(render(&CORNERS, &HALVES, 0), Err(KernelError::Argument { argument: "size", .. })));
    }
}
