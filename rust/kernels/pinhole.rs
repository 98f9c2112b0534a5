//! Eight pinhole cameras with seven unknowns each, and the normal equations of their reprojection errors.
//!
//! Hornung, Dekkers, Kobbelt 2007, eqs. 1-2: square pixels, no skew, a centred principal point; unknown are focal
//! length, orientation and place. In unknowns that hardly disturb each other: with Y = R (X - middle), a point is seen at
//! (shift + s Yxy) / (1 + q Yz) from the principal point, where s = f / z and q = 1 / z for the middle's depth z. So
//! s is the figure's size, q the strength of the perspective, which alone tells f = s / q. Unknown are shift (2),
//! ln s, ln f and a small turn (3) after R.

use crate::lanes::{LANES, Lanes, Mask};
use crate::robust::Loss;

/// Unknowns of a camera.
pub const UNKNOWNS: usize = 7;
/// Entries of the normal matrix's lower triangle, row by row.
const ENTRIES: usize = UNKNOWNS * (UNKNOWNS + 1) / 2;
/// Nearer to the camera than this part of the middle's depth no point may come.
const NEAR: f64 = 0.05;

/// What the cameras are fitted to: eight poses and one set of marks.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The poses' points about their middle, in metres.
    pub points: &'a [[Lanes; 3]],
    /// The marks, in pixels from the principal point.
    pub marks: &'a [[f64; 2]],
    /// What a residual costs.
    pub loss: Loss,
    /// Scale of the loss, in pixels.
    pub scale: f64,
    /// The usual focal length's logarithm.
    pub log_focal: f64,
    /// How strongly the focal length is pulled there; None holds it there.
    pub focal_weight: Option<f64>,
    /// How strongly the camera is pulled out of a roll.
    pub roll_weight: f64,
    /// How strongly the camera is pulled to the level, from above and below.
    pub elevation_weight: f64,
}

/// Eight cameras.
#[derive(Clone, Copy)]
pub struct Cameras {
    /// World directions to camera axes.
    pub rotation: [[Lanes; 3]; 3],
    /// Where the middle is seen, in pixels from the principal point.
    pub shift: [Lanes; 2],
    /// The logarithm of the figure's size, in pixels a metre.
    pub log_scale: Lanes,
    /// The focal length's logarithm.
    pub log_focal: Lanes,
}

/// The normal equations of eight cameras: cost, half its gradient, and the Gauss-Newton matrix.
#[derive(Clone, Copy)]
pub struct Normal {
    /// The cost, infinite where a point is not in front of its camera.
    pub cost: Lanes,
    /// Half the cost's gradient.
    pub gradient: [Lanes; UNKNOWNS],
    matrix: [Lanes; ENTRIES],
}

/// Place in the packed lower triangle.
#[inline(always)]
const fn at(row: usize, column: usize) -> usize {
    row * (row + 1) / 2 + column
}

impl Cameras {
    /// The cameras after a step of the unknowns, none too far for the linearisation to mean something.
    #[inline(always)]
    pub fn moved(&self, step: &[Lanes; UNKNOWNS]) -> Cameras {
        let [x, y, z] = [step[4], step[5], step[6]].map(|turn| turn.within(1.0) * Lanes::splat(0.5));
        let one = Lanes::splat(1.0);
        // Rotation by the unit quaternion along (1, x, y, z).
        let twice = Lanes::splat(2.0) / (one + x * x + y * y + z * z);
        let turn = [
            [one - twice * (y * y + z * z), twice * (x * y - z), twice * (x * z + y)],
            [twice * (x * y + z), one - twice * (x * x + z * z), twice * (y * z - x)],
            [twice * (x * z - y), twice * (y * z + x), one - twice * (x * x + y * y)],
        ];
        let mut rotation = self.rotation;
        for (out, turn) in rotation.iter_mut().zip(turn) {
            for (column, out) in out.iter_mut().enumerate() {
                *out = turn[0] * self.rotation[0][column]
                    + turn[1] * self.rotation[1][column]
                    + turn[2] * self.rotation[2][column];
            }
        }
        Cameras {
            rotation,
            shift: [self.shift[0] + step[0], self.shift[1] + step[1]],
            log_scale: self.log_scale + step[2].within(1.0),
            log_focal: self.log_focal + step[3].within(1.0),
        }
    }

    /// These cameras where `mask` holds, else `other`.
    #[inline(always)]
    pub fn or(&self, mask: &Mask, other: &Cameras) -> Cameras {
        let mut out = *self;
        for (out, other) in out.rotation.iter_mut().flatten().zip(other.rotation.iter().flatten()) {
            *out = out.or(mask, *other);
        }
        for (out, other) in out.shift.iter_mut().zip(other.shift) {
            *out = out.or(mask, other);
        }
        out.log_scale = out.log_scale.or(mask, other.log_scale);
        out.log_focal = out.log_focal.or(mask, other.log_focal);
        out
    }

    /// Cost, gradient and Gauss-Newton matrix of the cameras.
    #[inline(always)]
    pub fn normal(&self, target: &Target) -> Normal {
        let zero = Lanes::ZERO;
        let mut sum = Normal { cost: zero, gradient: [zero; UNKNOWNS], matrix: [zero; ENTRIES] };
        let s = self.log_scale.map(f64::exp);
        let q = (self.log_scale - self.log_focal).map(f64::exp);
        let (scale, unit) = (Lanes::splat(target.scale.powi(-2)), Lanes::splat(1.0));
        let mut front = [true; LANES];
        for (point, mark) in target.points.iter().zip(target.marks) {
            let [yx, yy, yz] = self.rotation.map(|row| row[0] * point[0] + row[1] * point[1] + row[2] * point[2]);
            let depth = unit + q * yz;
            for (front, near) in front.iter_mut().zip(depth.below(Lanes::splat(NEAR))) {
                *front &= !near;
            }
            let inverse = unit / depth;
            let (sx, sy) = (s * yx * inverse, s * yy * inverse);
            let (px, py) = (self.shift[0] * inverse + sx, self.shift[1] * inverse + sy);
            let residual = [px - Lanes::splat(mark[0]), py - Lanes::splat(mark[1])];
            let (cost, weight) = target.loss.of((residual[0] * residual[0] + residual[1] * residual[1]) * scale);
            let weight = weight * scale;
            sum.cost = sum.cost + cost;
            let qi = q * inverse;
            let (qx, qy, qz, sz) = (qi * yx, qi * yy, qi * yz, s * yz * inverse);
            // Derivatives by ln s, ln f and the turn.
            let dx = [sx - px * qz, px * qz, -(px * qy), sz + px * qx, -sy];
            let dy = [sy - py * qz, py * qz, -(sz + py * qy), py * qx, sx];
            sum.add(inverse, &dx, &dy, residual, weight);
        }
        sum.add_priors(self, target);
        sum.cost = sum.cost.or(&front, Lanes::splat(f64::INFINITY));
        sum
    }
}

impl Normal {
    /// Adds one point: its two rows are (inverse, 0, dx) and (0, inverse, dy).
    #[inline(always)]
    fn add(&mut self, inverse: Lanes, dx: &[Lanes; 5], dy: &[Lanes; 5], residual: [Lanes; 2], weight: Lanes) {
        let weighted = inverse * weight;
        self.matrix[at(0, 0)] = self.matrix[at(0, 0)] + weighted * inverse;
        self.gradient[0] = self.gradient[0] + weighted * residual[0];
        self.gradient[1] = self.gradient[1] + weighted * residual[1];
        for row in 0..5 {
            let (wx, wy) = (weight * dx[row], weight * dy[row]);
            self.gradient[row + 2] = self.gradient[row + 2] + wx * residual[0] + wy * residual[1];
            self.matrix[at(row + 2, 0)] = self.matrix[at(row + 2, 0)] + wx * inverse;
            self.matrix[at(row + 2, 1)] = self.matrix[at(row + 2, 1)] + wy * inverse;
            for column in 0..=row {
                let entry = at(row + 2, column + 2);
                self.matrix[entry] = self.matrix[entry] + wx * dx[column] + wy * dy[column];
            }
        }
    }

    /// Adds the pulls of the focal length to its usual value and of the world's up to the picture's.
    #[inline(always)]
    fn add_priors(&mut self, camera: &Cameras, target: &Target) {
        self.matrix[at(1, 1)] = self.matrix[at(0, 0)];
        if let Some(weight) = target.focal_weight {
            let pull = Lanes::splat(weight * weight);
            let off = camera.log_focal - Lanes::splat(target.log_focal);
            self.cost = self.cost + pull * off * off;
            self.gradient[3] = self.gradient[3] + pull * off;
            self.matrix[at(3, 3)] = self.matrix[at(3, 3)] + pull;
        } else {
            self.gradient[3] = Lanes::ZERO;
            for other in 0..UNKNOWNS {
                self.matrix[if other < 3 { at(3, other) } else { at(other, 3) }] = Lanes::ZERO;
            }
            self.matrix[at(3, 3)] = Lanes::splat(1.0);
        }
        // The world's up in camera axes: (0, -cos e, sin e) without roll, at the elevation e. A camera upside down is
        // as level as an upright one, so there the second number counts as well.
        let [ux, uy, uz] = camera.rotation.map(|row| row[1]);
        let flipped = Lanes::ZERO.below(uy);
        let where_flipped = |value: Lanes| value.or(&flipped, Lanes::ZERO);
        self.pull(target.roll_weight, ux, [Lanes::ZERO, uz, -uy]);
        self.pull(target.roll_weight, where_flipped(uy), [where_flipped(-uz), Lanes::ZERO, where_flipped(ux)]);
        self.pull(target.elevation_weight, uz, [uy, -ux, Lanes::ZERO]);
    }

    /// Adds a residual with its weight and its slopes along the turn.
    #[inline(always)]
    fn pull(&mut self, weight: f64, residual: Lanes, slopes: [Lanes; 3]) {
        let pull = Lanes::splat(weight * weight);
        self.cost = self.cost + pull * residual * residual;
        for (row, slope) in slopes.iter().enumerate() {
            let weighted = pull * *slope;
            self.gradient[row + 4] = self.gradient[row + 4] + weighted * residual;
            for (column, slope) in slopes.iter().enumerate().take(row + 1) {
                let entry = at(row + 4, column + 4);
                self.matrix[entry] = self.matrix[entry] + weighted * *slope;
            }
        }
    }

    /// The Levenberg-Marquardt step: -(H + damping diag H)^-1 g, by Cholesky.
    #[inline(always)]
    pub fn step(&self, damping: Lanes) -> [Lanes; UNKNOWNS] {
        let (tiny, unit) = (Lanes::splat(1e-12), Lanes::splat(1.0));
        let mut l = self.matrix;
        let mut reciprocal = [Lanes::ZERO; UNKNOWNS];
        for row in 0..UNKNOWNS {
            l[at(row, row)] = l[at(row, row)] * (unit + damping) + tiny;
            for column in 0..row {
                let mut value = l[at(row, column)];
                for k in 0..column {
                    value = value - l[at(row, k)] * l[at(column, k)];
                }
                l[at(row, column)] = value * reciprocal[column];
                l[at(row, row)] = l[at(row, row)] - l[at(row, column)] * l[at(row, column)];
            }
            reciprocal[row] = unit / tiny.or(&l[at(row, row)].below(tiny), l[at(row, row)]).sqrt();
        }
        let mut step = self.gradient;
        for row in 0..UNKNOWNS {
            for k in 0..row {
                step[row] = step[row] - l[at(row, k)] * step[k];
            }
            step[row] = step[row] * reciprocal[row];
        }
        for row in (0..UNKNOWNS).rev() {
            for k in row + 1..UNKNOWNS {
                step[row] = step[row] - l[at(k, row)] * step[k];
            }
            step[row] = step[row] * reciprocal[row];
        }
        step.map(|value| -value)
    }

    /// These equations where `mask` holds, else `other`.
    #[inline(always)]
    pub fn or(&self, mask: &Mask, other: &Normal) -> Normal {
        let mut out = *self;
        out.cost = out.cost.or(mask, other.cost);
        for (out, other) in out.gradient.iter_mut().zip(other.gradient) {
            *out = out.or(mask, other);
        }
        for (out, other) in out.matrix.iter_mut().zip(other.matrix) {
            *out = out.or(mask, other);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOSSES: [Loss; 4] = [Loss::Squared, Loss::Huber, Loss::Cauchy, Loss::GemanMcClure];

    /// A point for every lane, different in each.
    fn points(count: usize) -> Vec<[Lanes; 3]> {
        let wave = |k: usize, lane: usize| ((k * 37 + lane * 11) as f64 * 0.61).sin();
        let lanes = |k: usize| Lanes(std::array::from_fn(|lane| wave(k, lane)));
        (0..count).map(|joint| [lanes(3 * joint), lanes(3 * joint + 1), lanes(3 * joint + 2)]).collect()
    }

    fn cameras() -> Cameras {
        let lanes = |from: f64, by: f64| Lanes(std::array::from_fn(|lane| from + by * lane as f64));
        let rotation = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]].map(|row| row.map(Lanes::splat));
        let level = Cameras {
            rotation,
            shift: [lanes(-9.0, 4.0), lanes(20.0, -6.0)],
            log_scale: lanes(4.6, 0.05),
            log_focal: lanes(6.2, 0.07),
        };
        level.moved(&[0.0, 0.0, 0.0, 0.0, 0.3, -0.9, 0.2].map(Lanes::splat)).moved(&step(5, lanes(0.0, 0.1)))
    }

    fn target<'a>(points: &'a [[Lanes; 3]], marks: &'a [[f64; 2]], loss: Loss) -> Target<'a> {
        Target {
            points,
            marks,
            loss,
            scale: 12.0,
            log_focal: 6.3,
            focal_weight: Some(3.0),
            roll_weight: 8.0,
            elevation_weight: 2.0,
        }
    }

    fn step(unknown: usize, size: Lanes) -> [Lanes; UNKNOWNS] {
        let mut step = [Lanes::ZERO; UNKNOWNS];
        step[unknown] = size;
        step
    }

    fn cost(target: &Target, camera: &Cameras, step: &[Lanes; UNKNOWNS]) -> Lanes {
        camera.moved(step).normal(target).cost
    }

    #[test]
    fn gradient_is_that_of_the_cost_by_finite_differences() {
        let (points, marks) =
            (points(6), [[-60.0, -90.0], [50.0, 9.0], [0.0, 80.0], [9.0, -4.0], [70.0, 2.0], [-33.0, 50.0]]);
        let upside_down = cameras().moved(&step(6, Lanes::splat(1.0))).moved(&step(6, Lanes::splat(1.0)));
        for (loss, camera) in LOSSES.into_iter().flat_map(|loss| [(loss, cameras()), (loss, upside_down)]) {
            let target = target(&points, &marks, loss);
            let normal = camera.normal(&target);
            for unknown in 0..UNKNOWNS {
                let small = Lanes::splat(1e-6);
                let (up, down) =
                    (cost(&target, &camera, &step(unknown, small)), cost(&target, &camera, &step(unknown, -small)));
                for lane in 0..LANES {
                    let (want, got) = ((up.0[lane] - down.0[lane]) / 4e-6, normal.gradient[unknown].0[lane]);
                    assert!((want - got).abs() < 1e-5 * (1.0 + want.abs()), "{loss:?} {unknown}: {got} for {want}");
                }
            }
        }
    }

    #[test]
    fn matrix_is_half_the_second_derivative_where_nothing_is_off() {
        let points = points(5);
        let camera = Cameras { log_focal: Lanes::splat(6.3), ..cameras() };
        let level = [[0.6, 0.0, -0.8], [0.0, -1.0, 0.0], [-0.8, 0.0, -0.6]].map(|row| row.map(Lanes::splat));
        let camera = Cameras { rotation: level, ..camera };
        // Each lane has its own marks, so each is looked at alone.
        for lane in 0..LANES {
            let marks: Vec<[f64; 2]> = points.iter().map(|point| project(&camera, point, lane)).collect();
            let target = target(&points, &marks, Loss::Cauchy);
            let normal = camera.normal(&target);
            let size = |unknown: usize| Lanes::splat(if unknown < 2 { 1e-2 } else { 1e-4 });
            for (row, column) in (0..UNKNOWNS).flat_map(|row| (0..=row).map(move |column| (row, column))) {
                let both = |sign: f64| {
                    let mut both = step(row, size(row));
                    both[column] = both[column] + size(column) * Lanes::splat(sign);
                    cost(&target, &camera, &both).0[lane]
                };
                let want = if row == column { both(1.0) / 4.0 } else { (both(1.0) - both(-1.0)) / 4.0 };
                let want = want / (size(row).0[0] * size(column).0[0]);
                let got = normal.matrix[at(row, column)].0[lane];
                let size = (normal.matrix[at(row, row)].0[lane] * normal.matrix[at(column, column)].0[lane]).sqrt();
                assert!((want - got).abs() < 1e-3 * size, "{row} {column}: {got} for {want} of {size}");
            }
        }
    }

    /// Where a lane's camera sees its point: K [R | t] written out.
    fn project(camera: &Cameras, point: &[Lanes; 3], lane: usize) -> [f64; 2] {
        let turned = camera.rotation.map(|row| (0..3).map(|k| row[k].0[lane] * point[k].0[lane]).sum::<f64>());
        let (focal, depth) =
            (camera.log_focal.0[lane].exp(), (camera.log_focal.0[lane] - camera.log_scale.0[lane]).exp());
        let place = [camera.shift[0].0[lane] * depth / focal, camera.shift[1].0[lane] * depth / focal];
        [0, 1].map(|axis| focal * (turned[axis] + place[axis]) / (turned[2] + depth))
    }

    #[test]
    fn step_solves_the_damped_equations_and_a_given_focal_length_stays() {
        let (points, marks) = (points(5), [[-60.0, -90.0], [50.0, 9.0], [0.0, 80.0], [9.0, -4.0], [70.0, 2.0]]);
        for focal_weight in [Some(3.0), None] {
            let normal = cameras().normal(&Target { focal_weight, ..target(&points, &marks, Loss::Huber) });
            let step = normal.step(Lanes::splat(0.25));
            for row in 0..UNKNOWNS {
                let entry = |column: usize| normal.matrix[at(row.max(column), row.min(column))].0[3];
                let damped = |column: usize| entry(column) * if row == column { 1.25 } else { 1.0 };
                let sum: f64 = (0..UNKNOWNS).map(|column| damped(column) * step[column].0[3]).sum();
                assert!((sum + normal.gradient[row].0[3]).abs() < 1e-9 * (1.0 + sum.abs()));
            }
            assert_eq!(step[3].0 == [0.0; LANES], focal_weight.is_none());
        }
    }

    #[test]
    fn a_point_behind_the_camera_costs_without_end() {
        let points = [[Lanes::ZERO, Lanes::ZERO, Lanes([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e3])]];
        let cost = cameras().normal(&target(&points, &[[0.0, 0.0]], Loss::GemanMcClure)).cost;
        assert!(cost.0[..7].iter().all(|cost| cost.is_finite()) && cost.0[7] == f64::INFINITY);
    }
}
