//! A band of rows with its depth buffer, and the exact filling of faces into it.
//!
//! A sample belongs to a face when it lies right of or on its left outline and left of its right one, below or on its
//! upper end and above its lower one: the top-left rule. The outlines' columns are walked row by row in integers without
//! rounding, so two faces with a common edge never leave out and never share a sample.

use crate::surface::{Face, SUBPIXELS, Surface, View};
use std::ops::Range;

/// The first sample at or right of an edge, row by row: `column` is the exact ceiling of the edge's place.
struct Edge {
    column: i64,
    /// How much the column times the denominator exceeds the true place.
    excess: i64,
    denominator: i64,
    step: i64,
    step_rest: i64,
}

impl Edge {
    /// The edge from an upper to a lower corner, at a row between them.
    fn new(from: [i32; 2], to: [i32; 2], row: i32) -> Self {
        let [x, y] = from.map(i64::from);
        let (across, down) = (i64::from(to[0]) - x, i64::from(to[1]) - y);
        let scale = i64::from(SUBPIXELS);
        let place = x * down + (i64::from(row) * scale - y) * across;
        let denominator = down * scale;
        let column = -(-place).div_euclid(denominator);
        let step = across.div_euclid(down);
        let step_rest = (across - step * down) * scale;
        Edge { column, excess: column * denominator - place, denominator, step, step_rest }
    }

    fn next_row(&mut self) {
        self.column += self.step;
        self.excess -= self.step_rest;
        if self.excess < 0 {
            self.column += 1;
            self.excess += self.denominator;
        }
    }
}

/// Rows of a picture with its margin: the nearest surface of every sample and its 1/z.
pub struct Band {
    /// Picture row of the first row held.
    pub top: i32,
    /// Rows held.
    pub rows: usize,
    /// Columns held, the margins' included.
    pub width: usize,
    /// Columns left of the picture's first.
    pub margin: i32,
    /// 1/z, 0 where nothing is.
    pub reciprocal: Vec<f32>,
    /// Index of the surface and one, 0 where nothing is.
    pub surface: Vec<u32>,
}

impl Band {
    /// A band for at most `rows` rows of a view.
    pub fn new(view: &View, rows: usize) -> Self {
        let width = view.width + 2 * view.margin;
        let size = width * rows;
        Band { top: 0, rows: 0, width, margin: view.margin as i32, reciprocal: vec![0.0; size], surface: vec![0; size] }
    }

    /// Empties the band and puts it over other rows.
    pub fn place(&mut self, rows: &Range<i32>) {
        (self.top, self.rows) = (rows.start, rows.len());
        let size = self.width * self.rows;
        self.reciprocal[..size].fill(0.0);
        self.surface[..size].fill(0);
    }

    /// Column and row in the picture of a sample held.
    pub fn place_of(&self, sample: usize) -> [i32; 2] {
        [(sample % self.width) as i32 - self.margin, (sample / self.width) as i32 + self.top]
    }

    /// The samples held of the picture's columns in one of its rows.
    pub fn samples_of(&self, row: i32) -> Range<usize> {
        let (start, margin) = ((row - self.top) as usize * self.width, self.margin as usize);
        start + margin..start + self.width - margin
    }

    /// Draws the faces in turn: the nearer stays, of equals the earlier.
    pub fn draw<'a>(&mut self, faces: impl Iterator<Item = &'a Face>, surfaces: &[Surface]) {
        for face in faces {
            self.draw_face(face, &surfaces[face.surface as usize]);
        }
    }

    fn draw_face(&mut self, face: &Face, surface: &Surface) {
        let [upper, middle, lower] = face.corners;
        let (first, last) = face.rows();
        let turn = crate::surface::first_sample(middle[1]);
        let (top, bottom) = (first.max(self.top), last.min(self.top + self.rows as i32));
        if top >= bottom {
            return;
        }
        let mut long = Edge::new(upper, lower, top);
        let turns_right = is_right(upper, lower, middle);
        for (from, to, rows) in [(upper, middle, top..turn.min(bottom)), (middle, lower, turn.max(top)..bottom)] {
            if rows.is_empty() {
                continue;
            }
            let mut short = Edge::new(from, to, rows.start);
            for row in rows {
                let (left, right) = if turns_right { (long.column, short.column) } else { (short.column, long.column) };
                self.draw_span(row, left, right, surface, face.surface + 1);
                long.next_row();
                short.next_row();
            }
        }
    }

    fn draw_span(&mut self, row: i32, left: i64, right: i64, surface: &Surface, name: u32) {
        let margin = i64::from(self.margin);
        let (left, right) = (left.max(-margin), right.min(self.width as i64 - margin));
        if left >= right {
            return;
        }
        let start = (row - self.top) as usize * self.width;
        let span = start + (left + margin) as usize..start + (right + margin) as usize;
        let (from, step) = surface.reciprocal(left as i32, row);
        let (from, step) = (from as f32, step as f32);
        let (least, most) = surface.range();
        let (least, most) = (least as f32, most as f32);
        let samples = self.reciprocal[span.clone()].iter_mut().zip(&mut self.surface[span]);
        for (i, (nearest, owner)) in samples.enumerate() {
            let here = from + i as i32 as f32 * step;
            let here = if here < least { least } else { here };
            let here = if here > most { most } else { here };
            let wins = here > *nearest;
            *nearest = if wins { here } else { *nearest };
            *owner = if wins { name } else { *owner };
        }
    }
}

/// Whether a corner lies right of the edge from an upper to a lower corner.
fn is_right(upper: [i32; 2], lower: [i32; 2], corner: [i32; 2]) -> bool {
    let [x, y] = [0, 1].map(|k| i64::from(lower[k]) - i64::from(upper[k]));
    let [u, v] = [0, 1].map(|k| i64::from(corner[k]) - i64::from(upper[k]));
    u * y > v * x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_is_the_exact_ceiling_in_every_row() {
        for (from, to) in
            [([3, 5], [1000, 2560]), ([1000, -700], [-5000, 2561]), ([0, 0], [0, 512]), ([7, 0], [9, 256])]
        {
            let rows = crate::surface::first_sample(from[1])..crate::surface::first_sample(to[1]);
            let mut edge = Edge::new(from, to, rows.start);
            for row in rows {
                let (across, down) = (i64::from(to[0] - from[0]), i64::from(to[1] - from[1]));
                let place = i64::from(from[0]) * down + i64::from(row * SUBPIXELS - from[1]) * across;
                let whole = down * i64::from(SUBPIXELS);
                assert!(edge.column * whole >= place && (edge.column - 1) * whole < place, "row {row}");
                edge.next_row();
            }
        }
    }

    #[test]
    fn an_edge_started_further_down_is_the_same_edge() {
        let (from, to) = ([-333, 17], [70001, 9999]);
        let mut walked = Edge::new(from, to, 1);
        (1..20).for_each(|_| walked.next_row());
        let fresh = Edge::new(from, to, 20);
        assert_eq!((walked.column, walked.excess), (fresh.column, fresh.excess));
    }
}
