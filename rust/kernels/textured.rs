//! Renders a flat mesh with a texture: bilinear, premultiplied, triangle over triangle in the order given.
//!
//! Every pixel centre on an edge that triangles share is painted by exactly one of them (`scan.rs`): neither cracks nor
//! double blending. Bands of rows are worked alone, so neither bands nor threads change a bit of the result.

use crate::error::{KernelError, check_length};
use crate::scan::Outline;
use crate::texels::{FULL, Texels, Texture, straight};
use glam::{DVec2, Vec2, Vec4};
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
    corner: DVec2,
    place: DVec2,
    along_x: DVec2,
    along_y: DVec2,
    low: Vec2,
    high: Vec2,
}

impl Piece {
    fn new(corners: [DVec2; 3], places: [DVec2; 3], texels: &Texels) -> Option<Self> {
        let outline = Outline::new(corners)?;
        let [a, b, c] = corners;
        let (p, q, r) = (places[0], places[1] - places[0], places[2] - places[0]);
        let twice_area = (b - a).perp_dot(c - a);
        let slope = |change: DVec2| if change.is_finite() { change } else { DVec2::ZERO };
        let along_x = slope((q * (c.y - a.y) - r * (b.y - a.y)) / twice_area);
        let along_y = slope((r * (b.x - a.x) - q * (c.x - a.x)) / twice_area);
        let (low, high) = (p.min(p + q).min(p + r), p.max(p + q).max(p + r));
        let (low, high) = (texels.clamped(low), texels.clamped(high));
        Some(Piece { outline, corner: a, place: p, along_x, along_y, low, high })
    }

    /// Paints a span over what is there.
    #[inline(always)]
    fn paint(&self, texels: &Texels, row: i64, column: usize, out: &mut [[f32; 4]]) {
        let away = DVec2::new(column as f64, row as f64) - self.corner;
        let start = (self.place + self.along_x * away.x + self.along_y * away.y).as_vec2();
        let step = self.along_x.as_vec2();
        for (i, pixel) in out.iter_mut().enumerate() {
            let place = (start + step * i as f32).max(self.low).min(self.high);
            let color = texels.read(place);
            *pixel = (color + Vec4::from_array(*pixel) * (1.0 - color.w * (1.0 / FULL))).to_array();
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
    pixels.par_chunks_mut(rows * width).zip(bins).enumerate().for_each(|(band, (out, bin))| {
        let first = band * rows * samples;
        let mut buffer = Buffer::new(out.len() / width * samples, width * samples);
        bin.iter().for_each(|piece| buffer.paint(&pieces[*piece as usize], &texels, first));
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

/// Samples of a band and the columns that were painted in each row.
struct Buffer {
    colors: Vec<[f32; 4]>,
    painted: Vec<Range<usize>>,
    width: usize,
}

impl Buffer {
    fn new(rows: usize, width: usize) -> Self {
        Buffer { colors: vec![[0.0; 4]; rows * width], painted: vec![usize::MAX..0; rows], width }
    }

    fn paint(&mut self, piece: &Piece, texels: &Texels, first: usize) {
        paint_piece(piece, texels, first, self);
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
    let share = 1.0 / (samples * samples) as f32;
    for column in columns {
        let mut sum = Vec4::ZERO;
        for line in colors.chunks_exact(width) {
            for color in &line[column * samples..(column + 1) * samples] {
                sum += Vec4::from_array(*color);
            }
        }
        out[column] = straight(sum * share);
    }
}
