//! A band of rows with its depth buffer, and the exact filling of faces into it.
//!
//! A sample belongs to a face when it lies right of or on its left outline and left of its right one, below or on its
//! upper end and above its lower one: the top-left rule. The outlines' columns are walked row by row in integers without
//! rounding, so two faces with a common edge never leave out and never share a sample.

use crate::surface::{Face, SUBPIXELS, Surface, View, first_sample};
use glam::Vec4;
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

/// Samples that are compared at a time; rows begin and end at whole groups.
pub const LANES: usize = 4;

/// Rows of a picture with its margin: the nearest surface of every sample and its 1/z.
pub struct Band {
    /// Picture row of the first row held.
    pub top: i32,
    /// Rows held.
    pub rows: usize,
    /// Columns held, the margins' included.
    pub width: usize,
    /// 1/z, 0 where nothing is.
    pub reciprocal: Vec<f32>,
    /// Index of the surface and one, 0 where nothing is.
    pub surface: Vec<u32>,
    /// Columns left of the picture's first.
    margin: usize,
    /// Columns of the picture.
    picture: usize,
}

impl Band {
    /// A band for at most `rows` rows of a view.
    pub fn new(view: &View, rows: usize) -> Self {
        let margin = view.margin.next_multiple_of(LANES);
        let width = (margin + view.width + view.margin).next_multiple_of(LANES);
        let (reciprocal, surface) = (vec![0.0; width * rows], vec![0; width * rows]);
        Band { top: 0, rows: 0, width, reciprocal, surface, margin, picture: view.width }
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
        [(sample % self.width) as i32 - self.margin as i32, (sample / self.width) as i32 + self.top]
    }

    /// The samples held of the picture's columns in one of its rows.
    pub fn samples_of(&self, row: i32) -> Range<usize> {
        let start = (row - self.top) as usize * self.width + self.margin;
        start..start + self.picture
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
        let turn = first_sample(middle[1]);
        let (top, bottom) = (first.max(self.top), last.min(self.top + self.rows as i32));
        if top >= bottom {
            return;
        }
        let pen = Pen::new(surface, face.surface + 1);
        let mut long = Edge::new(upper, lower, top);
        let turns_right = is_right(upper, lower, middle);
        for (from, to, rows) in [(upper, middle, top..turn.min(bottom)), (middle, lower, turn.max(top)..bottom)] {
            if rows.is_empty() {
                continue;
            }
            let mut short = Edge::new(from, to, rows.start);
            for row in rows {
                let (left, right) = if turns_right { (&long, &short) } else { (&short, &long) };
                self.draw_span(row, left.column, right.column, &pen);
                long.next_row();
                short.next_row();
            }
        }
    }

    fn draw_span(&mut self, row: i32, left: i64, right: i64, pen: &Pen) {
        let margin = self.margin as i64;
        let (left, right) = (left.max(-margin), right.min(self.width as i64 - margin));
        if left >= right {
            return;
        }
        let start = (row - self.top) as usize * self.width;
        let (first, last) = ((left + margin) as usize, (right + margin) as usize);
        let groups = first / LANES * LANES..last.next_multiple_of(LANES);
        let nearest = self.reciprocal[start + groups.start..start + groups.end].as_chunks_mut::<LANES>().0;
        let owners = self.surface[start + groups.start..start + groups.end].as_chunks_mut::<LANES>().0;
        pen.fill([left as i32, row], (last - first) as f32, first - groups.start, nearest, owners);
    }
}

/// What a span of one face writes.
struct Pen<'a> {
    surface: &'a Surface,
    least: Vec4,
    most: Vec4,
    name: Vec4,
}

impl<'a> Pen<'a> {
    fn new(surface: &'a Surface, name: u32) -> Self {
        let (least, most) = surface.range();
        // Names travel as the bits of floats, so that one selection serves depths and names.
        let [least, most, name] = [least as f32, most as f32, f32::from_bits(name)].map(Vec4::splat);
        Pen { surface, least, most, name }
    }

    /// Fills `length` samples from `place` on, which is the `lead`-th of the groups given.
    fn fill(
        &self,
        place: [i32; 2],
        length: f32,
        lead: usize,
        nearest: &mut [[f32; LANES]],
        owners: &mut [[u32; LANES]],
    ) {
        let (from, step) = self.surface.reciprocal(place[0], place[1]);
        let (from, step, length) = (Vec4::splat(from as f32), Vec4::splat(step as f32), Vec4::splat(length));
        let mut along = Vec4::new(0.0, 1.0, 2.0, 3.0) - lead as f32;
        for (nearest, owner) in nearest.iter_mut().zip(owners) {
            let here = (from + along * step).max(self.least).min(self.most);
            let held = Vec4::from_array(*nearest);
            let wins = here.cmpgt(held) & along.cmpge(Vec4::ZERO) & along.cmplt(length);
            *nearest = Vec4::select(wins, here, held).to_array();
            let name = Vec4::select(wins, self.name, Vec4::from_array(owner.map(f32::from_bits)));
            *owner = name.to_array().map(f32::to_bits);
            along += LANES as f32;
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
            let rows = first_sample(from[1])..first_sample(to[1]);
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
