//! Direct solves along a chain of points: its lengths, and its resistance to bending.
//!
//! Lengths: Newton steps of an implicit Euler step of very stiff springs, with all of their second derivative that is not
//! negative (Baraff and Witkin 1998, section 4; where a spring is short its sideways part is left out, as in Choi and Ko
//! 2002). The matrix is block tridiagonal and solved at once, so a thread holds a heavy bob at its length and a rope that
//! is pulled too long lies still on its line; links one by one, or Newton steps of constraints, do neither.
//! Bending: an implicit step of a rod that is straight at rest, with the energy B/2 * curvature^2 per metre. It is linear
//! in the points, the same along x, y and z, and its matrix has two bands; it is factored once a frame.

use crate::symmetric::Symmetric;
use glam::DVec3;

/// Links grow by this share where the strand's whole mass, its bob's too, pulls with `LOAD`.
const GROWTH: f64 = 1e-3;

/// Ten times its weight, m/s^2.
const LOAD: f64 = 100.0;

/// Shorter than this (metres) a link has no direction.
const SHORT: f64 = 1e-9;

/// A point of a chain and the link to the next point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// 1/kg, 0 where it is pinned.
    pub weight: f64,
    /// Metres kept clear around it.
    pub radius: f64,
    /// Metres to the next point.
    pub length: f64,
    /// Metres per newton by which the link to the next point grows.
    pub compliance: f64,
    /// Bending stiffness at the point, newton metre squared.
    pub bend: f64,
    /// How much of gravity acts: less than all in air, below zero what rises.
    pub gravity: f64,
    /// Newtons of drag per (m/s)^2.
    pub drag: f64,
    /// Share of the drag along the chain; 1 for what is round.
    pub cling: f64,
}

impl Point {
    /// Of a row in the order of the fields.
    pub fn new(row: &[f64; 8]) -> Self {
        let [weight, radius, length, compliance, bend, gravity, drag, cling] = *row;
        Point { weight, radius, length, compliance, bend, gravity, drag, cling }
    }
}

/// Brings all links of a chain to their lengths.
pub struct Lengths {
    masses: Vec<f64>,
    /// Newtons per metre by link, times the substep squared: kilogrammes.
    springs: Vec<f64>,
    start: Vec<DVec3>,
    diagonal: Vec<Symmetric>,
    /// The block between a point and the next with its sign turned; zero where either is pinned.
    beside: Vec<Symmetric>,
    right: Vec<DVec3>,
}

impl Lengths {
    /// For a chain, in substeps of `step` seconds.
    pub fn new(points: &[Point], step: f64) -> Self {
        let mass = |point: &Point| if point.weight > 0.0 { 1.0 / point.weight } else { 0.0 };
        let masses: Vec<f64> = points.iter().map(mass).collect();
        let pull = LOAD * masses.iter().sum::<f64>();
        let give = |point: &Point| point.compliance + GROWTH * point.length / pull;
        let springs = points.iter().map(|point| step * step / give(point).max(f64::MIN_POSITIVE)).collect();
        let (zero, count) = (DVec3::ZERO, points.len());
        let blocks = || vec![Symmetric::ZERO; count];
        Lengths {
            masses,
            springs,
            start: vec![zero; count],
            diagonal: blocks(),
            beside: blocks(),
            right: vec![zero; count],
        }
    }

    /// Moves `places`, where the points would be without links, by `rounds` Newton steps.
    pub fn restore(&mut self, points: &[Point], rounds: usize, places: &mut [DVec3]) {
        self.start.copy_from_slice(places);
        for _ in 0..rounds {
            self.assemble(points, places);
            self.solve(places);
        }
    }

    fn assemble(&mut self, points: &[Point], places: &[DVec3]) {
        for (k, mass) in self.masses.iter().enumerate() {
            self.diagonal[k] = Symmetric::scaled_identity(*mass);
            self.right[k] = *mass * (self.start[k] - places[k]);
        }
        for (link, pair) in places.windows(2).enumerate() {
            let (way, length, spring) = (pair[1] - pair[0], points[link].length, self.springs[link]);
            let now = way.length();
            let free = [self.masses[link] > 0.0, self.masses[link + 1] > 0.0];
            self.beside[link] = Symmetric::ZERO;
            if now <= SHORT || free == [false; 2] {
                continue;
            }
            let along = way / now;
            let turning = (1.0 - length / now).max(0.0);
            let block = Symmetric::stiffness(along, spring * (1.0 - turning), spring * turning);
            let pull = spring * (now - length) * along;
            self.diagonal[link] += block;
            self.diagonal[link + 1] += block;
            self.right[link] += pull;
            self.right[link + 1] -= pull;
            if free == [true; 2] {
                self.beside[link] = block;
            }
        }
    }

    /// Block tridiagonal elimination; pinned points stay.
    fn solve(&mut self, places: &mut [DVec3]) {
        let count = places.len();
        for k in 0..count {
            if self.masses[k] == 0.0 {
                continue;
            }
            if k > 0 && self.masses[k - 1] > 0.0 {
                let (inverse, block) = (self.diagonal[k - 1], self.beside[k - 1]);
                inverse.take_between(block, &mut self.diagonal[k]);
                let before = inverse * self.right[k - 1];
                self.right[k] += block * before;
            }
            self.diagonal[k] = self.diagonal[k].inverse();
        }
        let mut after = DVec3::ZERO;
        for k in (0..count).rev() {
            if self.masses[k] == 0.0 {
                after = DVec3::ZERO;
                continue;
            }
            after = self.diagonal[k] * (self.right[k] + self.beside[k] * after);
            places[k] += after;
        }
    }
}

/// The factored matrix of an implicit bending step of one chain: masses and h^2 times the stiffness.
pub struct Bending {
    masses: Vec<f64>,
    /// The matrix's bands one and two below the diagonal.
    bands: Vec<[f64; 2]>,
    /// Its factors: the diagonal and the bands.
    diagonal: Vec<f64>,
    factors: Vec<[f64; 2]>,
    /// Room for the right side.
    right: Vec<DVec3>,
}

impl Bending {
    /// Of a chain, for substeps of `step` seconds; None where nothing resists.
    pub fn new(points: &[Point], step: f64) -> Option<Self> {
        let count = points.len();
        if !points.iter().any(|point| point.bend > 0.0) {
            return None;
        }
        let mass = |point: &Point| if point.weight > 0.0 { 1.0 / point.weight } else { 0.0 };
        let masses: Vec<f64> = points.iter().map(mass).collect();
        let (mut diagonal, mut bands) = (masses.clone(), vec![[0.0; 2]; count]);
        for middle in 1..count.saturating_sub(1) {
            let (first, second) = (points[middle - 1].length.max(SHORT), points[middle].length.max(SHORT));
            let row = [1.0 / first, -1.0 / first - 1.0 / second, 1.0 / second];
            let stiff = step * step * points[middle].bend * 2.0 / (first + second);
            for (i, a) in row.iter().enumerate() {
                diagonal[middle + i - 1] += stiff * a * a;
            }
            bands[middle][0] += stiff * row[0] * row[1];
            bands[middle + 1][0] += stiff * row[1] * row[2];
            bands[middle + 1][1] += stiff * row[0] * row[2];
        }
        let mut made = Bending { masses, bands, diagonal, factors: vec![[0.0; 2]; count], right: Vec::new() };
        made.factor();
        Some(made)
    }

    /// L D L^T with two bands; rows of pinned points are the identity.
    fn factor(&mut self) {
        for row in 0..self.diagonal.len() {
            if self.is_held(row) {
                (self.diagonal[row], self.factors[row]) = (1.0, [0.0; 2]);
                continue;
            }
            let far = if row > 1 && !self.is_held(row - 2) { self.bands[row][1] / self.diagonal[row - 2] } else { 0.0 };
            if row > 1 {
                self.diagonal[row] -= far * far * self.diagonal[row - 2];
            }
            if row > 0 && !self.is_held(row - 1) {
                let across = if row > 1 { far * self.diagonal[row - 2] * self.factors[row - 1][0] } else { 0.0 };
                let near = (self.bands[row][0] - across) / self.diagonal[row - 1];
                self.diagonal[row] -= near * near * self.diagonal[row - 1];
                self.factors[row][0] = near;
            }
            self.factors[row][1] = far;
        }
    }

    fn is_held(&self, row: usize) -> bool {
        self.masses[row] == 0.0
    }

    /// Moves `places` to where bending brings them at the end of the substep.
    pub fn relax(&mut self, places: &mut [DVec3]) {
        let count = places.len();
        let mut right = std::mem::take(&mut self.right);
        let held = |row: usize| if self.is_held(row) { places[row] } else { DVec3::ZERO };
        right.clear();
        right.extend((0..count).map(|row| {
            if self.is_held(row) {
                return places[row];
            }
            let mut sum = self.masses[row] * places[row];
            for back in 1..=row.min(2) {
                sum -= self.bands[row][back - 1] * held(row - back);
            }
            for ahead in 1..=(count - 1 - row).min(2) {
                sum -= self.bands[row + ahead][ahead - 1] * held(row + ahead);
            }
            sum
        }));
        for row in 1..count {
            for back in 1..=row.min(2) {
                let known = right[row - back];
                right[row] -= self.factors[row][back - 1] * known;
            }
        }
        for row in (0..count).rev() {
            let mut place = right[row] / self.diagonal[row];
            for ahead in 1..=(count - 1 - row).min(2) {
                place -= self.factors[row + ahead][ahead - 1] * places[row + ahead];
            }
            places[row] = place;
        }
        self.right = right;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(weight: f64, bend: f64) -> Point {
        Point { weight, radius: 0.0, length: 0.1, compliance: 0.0, bend, gravity: 1.0, drag: 0.0, cling: 0.0 }
    }

    #[test]
    fn a_thread_holds_what_is_a_million_times_heavier() {
        let mut points = vec![point(0.0, 0.0)];
        points.extend((0..20).map(|_| point(1e6, 0.0)));
        points.push(point(1.0, 0.0));
        let mut places: Vec<DVec3> = (0..22).map(|k| DVec3::new(0.1 * f64::from(k), 0.0, 0.0)).collect();
        // In a hundredth of a second the bob falls outwards by a millimetre, and its thread sways.
        places[21].x += 1e-3;
        places[10].y = 1e-4;
        let mut lengths = Lengths::new(&points, 0.01);
        let off = |places: &[DVec3]| {
            places.windows(2).map(|pair| (pair[1].distance(pair[0]) - 0.1).abs()).fold(0.0, f64::max)
        };
        // As many rounds as a string that holds a bob gets: the bob hangs at the thread's length.
        let mut hanging = places.clone();
        lengths.restore(&points, 4, &mut hanging);
        assert_eq!(hanging[0], DVec3::ZERO);
        assert!(off(&hanging) < 4e-5 && (hanging[21].x - 2.1).abs() < 3e-3, "{hanging:?}");
        // What next to no mass holds back swings far in single Newton steps, and comes to lie straight with more.
        lengths.restore(&points, 16, &mut places);
        assert!(off(&places) < 2e-5 && places.iter().all(|place| place.y.abs() < 1e-3), "{places:?}");
    }

    #[test]
    fn a_link_gives_way_by_its_compliance() {
        // 1 kg on a spring of 100 N/m, pulled 0.2 m long: implicit Euler takes back 0.2 * k h^2 / (m + k h^2).
        let (mut anchor, end) = (point(0.0, 0.0), point(1.0, 0.0));
        anchor.compliance = 0.01;
        let mut places = [DVec3::ZERO, DVec3::new(0.3, 0.0, 0.0)];
        Lengths::new(&[anchor, end], 0.1).restore(&[anchor, end], 1, &mut places);
        assert!((places[1].x - 0.2).abs() < 1e-5, "{places:?}");
    }

    #[test]
    fn what_is_pulled_too_long_lies_straight_and_even() {
        let mut points = vec![point(10.0, 0.0); 9];
        (points[0].weight, points[8].weight) = (0.0, 0.0);
        let mut places: Vec<DVec3> =
            (0..9).map(|k| DVec3::new(0.12 * f64::from(k), 0.01 * f64::from(k % 2), 0.0)).collect();
        places[8].y = 0.0;
        let mut lengths = Lengths::new(&points, 0.001);
        for _ in 0..20 {
            lengths.restore(&points, 2, &mut places);
        }
        assert!(places.windows(2).all(|pair| (pair[1].x - pair[0].x - 0.12).abs() < 1e-4), "{places:?}");
        assert!(places.iter().all(|place| place.y.abs() < 2e-3), "{places:?}");
    }

    #[test]
    fn bending_solves_its_own_equations() {
        let points: Vec<Point> = [0.0, 2.0, 3.0, 0.0, 1.0, 4.0]
            .iter()
            .zip([0.0, 1.0, 2.0, 3.0, 0.5, 0.0])
            .map(|(w, b)| point(*w, b))
            .collect();
        let step = 0.2;
        let before: Vec<DVec3> = (0..6).map(|k| DVec3::new(f64::from(k) * 0.1, f64::from(k * k % 5), 1.0)).collect();
        let Some(mut bending) = Bending::new(&points, step) else { unreachable!() };
        let mut after = before.clone();
        bending.relax(&mut after);
        // M (x - x*) + h^2 sum of B / l * g (g . x) = 0 at every free point, with g = (1, -2, 1) / l.
        let mut force = [DVec3::ZERO; 6];
        for (k, point) in points.iter().enumerate().skip(1).take(4) {
            let bow = (after[k - 1] - 2.0 * after[k] + after[k + 1]) * (point.bend / 0.1 / 0.01);
            for (at, g) in [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)] {
                force[at] -= g * bow;
            }
        }
        for (k, point) in points.iter().enumerate() {
            let free = point.weight > 0.0;
            let want = if free { before[k] + force[k] * (point.weight * step * step) } else { before[k] };
            assert!(after[k].distance(want) < 1e-8, "{k}: {:?} {want:?}", after[k]);
        }
        assert!(Bending::new(&[point(1.0, 0.0); 3], step).is_none());
    }
}
