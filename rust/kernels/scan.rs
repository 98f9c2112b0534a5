//! Which pixel centres a triangle covers, row by row: the top-left rule, exact in fixed point.
//!
//! A centre on a left or top edge is in, on a right or bottom edge out, so that of triangles that share an edge exactly
//! one covers each centre on it: no cracks, no pixel twice. Corners are snapped to 1/256 pixel and stepped exactly.

use glam::DVec2;
use std::ops::Range;

/// Parts of a pixel.
const PARTS: i64 = 256;

/// Farthest corner in pixels: products of two differences then fit 64 bits. Corners beyond are moved to it.
const REACH: f64 = (1 << 22) as f64;

type Corner = [i64; 2];

/// The left or right border of a triangle's part: the first column at or right of it, row by row.
#[derive(Debug, Clone, Copy)]
struct Border {
    column: i64,
    remainder: i64,
    step: i64,
    rest: i64,
    height: i64,
}

impl Border {
    /// The line from `a` down to `b` (lower by at least one part) at `row`.
    fn new(a: Corner, b: Corner, row: i64) -> Self {
        let (along, height) = (b[0] - a[0], (b[1] - a[1]) * PARTS);
        let place = a[0] * (b[1] - a[1]) + (row * PARTS - a[1]) * along + height - 1;
        let change = along * PARTS;
        Border {
            column: place.div_euclid(height),
            remainder: place.rem_euclid(height),
            step: change.div_euclid(height),
            rest: change.rem_euclid(height),
            height,
        }
    }

    #[inline(always)]
    fn advance(&mut self) {
        self.remainder += self.rest;
        let carry = i64::from(self.remainder >= self.height);
        self.remainder -= carry * self.height;
        self.column += self.step + carry;
    }
}

/// A triangle ready to be scanned.
#[derive(Debug, Clone, Copy)]
pub struct Outline {
    corners: [Corner; 3],
    middle_is_left: bool,
}

impl Outline {
    /// A triangle by its corners in pixels; None where it covers no area.
    pub fn new(corners: [DVec2; 3]) -> Option<Self> {
        let snap = |value: f64| (value.clamp(-REACH, REACH) * PARTS as f64).round() as i64;
        let mut corners = corners.map(|corner| [snap(corner.x), snap(corner.y)]);
        corners.sort_unstable_by_key(|corner| corner[1]);
        let [a, b, c] = corners;
        let turn = (c[0] - a[0]) * (b[1] - a[1]) - (c[1] - a[1]) * (b[0] - a[0]);
        (turn != 0).then_some(Outline { corners, middle_is_left: turn > 0 })
    }

    /// The rows whose centres the triangle may cover.
    pub fn rows(&self) -> Range<i64> {
        first(self.corners[0][1])..first(self.corners[2][1])
    }

    /// The columns whose centres the triangle may cover.
    pub fn columns(&self) -> Range<i64> {
        let (low, high) = self.corners.iter().fold((i64::MAX, i64::MIN), |(l, h), c| (l.min(c[0]), h.max(c[0])));
        first(low)..first(high)
    }

    /// Calls `paint` with row and columns of every span inside `rows` and columns 0 to `width`.
    #[inline(always)]
    pub fn scan(&self, rows: Range<i64>, width: usize, mut paint: impl FnMut(i64, Range<usize>)) {
        let [a, b, c] = self.corners;
        let bend = first(b[1]);
        for (top, bottom, from, to) in [(a, b, first(a[1]), bend), (b, c, bend, first(c[1]))] {
            let (from, to) = (from.max(rows.start), to.min(rows.end));
            if from >= to {
                continue;
            }
            let (mut short, mut long) = (Border::new(top, bottom, from), Border::new(a, c, from));
            for row in from..to {
                let (left, right) = if self.middle_is_left { (short, long) } else { (long, short) };
                let clip = |column: i64| column.clamp(0, width as i64) as usize;
                let (left, right) = (clip(left.column), clip(right.column));
                if left < right {
                    paint(row, left..right);
                }
                short.advance();
                long.advance();
            }
        }
    }
}

/// The first pixel centre at or after a place in parts.
fn first(parts: i64) -> i64 {
    (parts + PARTS - 1).div_euclid(PARTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How often each of 40 x 40 pixels is covered.
    fn counts(triangles: &[[DVec2; 3]]) -> Vec<u8> {
        let mut out = vec![0; 1600];
        for outline in triangles.iter().filter_map(|corners| Outline::new(*corners)) {
            outline.scan(0..40, 40, |row, columns| {
                out[row as usize * 40..][columns].iter_mut().for_each(|count| *count += 1);
            });
        }
        out
    }

    #[test]
    fn a_square_covers_its_left_and_top_centres_only() {
        let [a, b, c, d] = [(3., 4.), (9., 4.), (9., 12.), (3., 12.)].map(DVec2::from);
        let got = counts(&[[a, b, c], [a, c, d]]);
        for (index, count) in got.iter().enumerate() {
            let (x, y) = (index % 40, index / 40);
            assert_eq!(*count, u8::from((3..9).contains(&x) && (4..12).contains(&y)), "{x} {y}");
        }
    }

    #[test]
    fn a_fan_covers_each_centre_once_wherever_its_hub_lies() {
        let ring: Vec<DVec2> =
            (0..17).map(|k| DVec2::splat(20.0) + DVec2::from_angle(f64::from(k) * 0.37) * 60.0).collect();
        for hub in [DVec2::new(20.0, 20.0), DVec2::new(3.5, 30.25), DVec2::new(19.999, 7.0001)] {
            let fan: Vec<_> = (0..17).map(|k| [hub, ring[k], ring[(k + 1) % 17]]).collect();
            assert!(counts(&fan).iter().all(|count| *count == 1), "{hub}");
        }
    }

    #[test]
    fn far_corners_and_flat_triangles_stay_finite() {
        let far = [DVec2::splat(-1e300), DVec2::new(1e300, -1e300), DVec2::new(0.0, 1e300)];
        assert!(counts(&[far]).iter().all(|count| *count == 1));
        assert!(Outline::new([DVec2::ZERO, DVec2::ONE, DVec2::splat(2.0)]).is_none());
    }
}
