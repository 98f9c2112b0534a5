//! Where a moving point first meets moving capsules and triangles: continuous collision of one substep.
//!
//! The point's path is brought into the frame of the surface at the end of the substep: where it begins beside a capsule
//! or a triangle, it begins beside the moved one. There a capsule is met by sphere tracing (Hart 1996: the distance to the
//! surface can be gone without missing it), a triangle where the height above its plane falls to the radius. So nothing
//! thin is jumped over, however fast the point is.

use crate::capsule::Capsule;
use glam::{DQuat, DVec3};

/// Metres that count as touching.
const TOUCH: f64 = 1e-6;
/// The least way of one step of sphere tracing in metres, so that a path along a surface ends.
const LEAST: f64 = 2e-4;
/// How far outside a triangle, in its barycentric coordinates, it is still met: neighbours leave no gap between them.
const OVERLAP: f64 = 0.02;

/// The first contact on a path.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Share of the path that is gone before it.
    pub share: f64,
    /// Where the point is then, beside the surface at the substep's end.
    pub place: DVec3,
    /// Out of the surface, towards the point.
    pub normal: DVec3,
    /// How far the surface moves there in the substep.
    pub shift: DVec3,
}

/// A capsule before and after a substep.
#[derive(Debug, Clone, Copy)]
pub struct Limb {
    old: Capsule,
    /// After the substep.
    pub new: Capsule,
    shifts: [DVec3; 2],
    fastest: f64,
}

impl Limb {
    /// From the row before the substep and the one after it.
    pub fn new(old: &[f64; 8], new: &[f64; 8]) -> Self {
        let way = |k: usize| DVec3::new(new[k] - old[k], new[k + 1] - old[k + 1], new[k + 2] - old[k + 2]);
        let shifts = [way(0), way(4)];
        let grown = (new[3] - old[3]).abs().max((new[7] - old[7]).abs());
        let fastest = shifts[0].length().max(shifts[1].length()) + grown;
        Limb { old: Capsule::new(old), new: Capsule::new(new), shifts, fastest }
    }

    /// Where and how fast a point `from` beside the old capsule is carried by it.
    pub fn carry(&self, from: DVec3) -> (DVec3, DVec3) {
        let near = self.old.nearest(from);
        let turn = DQuat::from_rotation_arc(self.old.direction(), self.new.direction());
        let moved = self.new.on_axis(near.share) + turn * (from - self.old.on_axis(near.share));
        let now = self.new.nearest(moved);
        let place = moved + (near.distance - now.distance) * now.normal;
        (place, place - from)
    }

    /// Where the ball of `radius` on its way `from` - `to` first touches the limb.
    pub fn meet(&self, from: DVec3, to: DVec3, radius: f64) -> Option<Hit> {
        let way = (to - from).length();
        if !self.new.may_touch(to, radius + way + self.fastest) {
            return None;
        }
        let before = self.old.nearest(from);
        if before.distance > radius + way + 2.0 * self.fastest {
            return None;
        }
        let shift = self.shifts[0].lerp(self.shifts[1], before.share);
        let start = from + shift;
        let path = to - start;
        let length = path.length();
        let mut gone = 0.0;
        for _ in 0..64 {
            let share = if length > 0.0 { (gone / length).min(1.0) } else { 1.0 };
            let place = start + share * path;
            let near = self.new.nearest(place);
            let gap = near.distance - radius;
            if gap < -TOUCH || (gap <= TOUCH && path.dot(near.normal) < 0.0) {
                let shift = self.shifts[0].lerp(self.shifts[1], near.share);
                return Some(Hit { share, place: place - gap.min(0.0) * near.normal, normal: near.normal, shift });
            }
            if gone >= length {
                return None;
            }
            gone = (gone + gap.max(LEAST)).min(length);
        }
        None
    }
}

/// The box around all limbs after a substep, and the farthest that a part of one has come in it.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    low: DVec3,
    high: DVec3,
    fastest: f64,
}

impl Bounds {
    /// Of the rows after the substep, and the limbs made of them.
    pub fn new(rows: &[[f64; 8]], limbs: &[Limb]) -> Self {
        let fastest = limbs.iter().fold(0.0, |fastest: f64, limb| fastest.max(limb.fastest));
        let ball = |row: &[f64; 8], k: usize| (DVec3::new(row[k], row[k + 1], row[k + 2]), row[k + 3]);
        let balls = rows.iter().flat_map(|row| [ball(row, 0), ball(row, 4)]);
        let (low, high) = balls.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (center, radius)| {
            (low.min(center - radius), high.max(center + radius))
        });
        Bounds { low, high, fastest }
    }

    /// Whether no limb comes within `margin` of any point of the box from `low` to `high`.
    #[inline(always)]
    pub fn are_off(&self, low: DVec3, high: DVec3, margin: f64) -> bool {
        !(low.cmple(self.high + margin) & high.cmpge(self.low - margin)).all()
    }

    /// Whether nothing within `margin` of the way through the box from `low` to `high` can meet a limb in the substep.
    #[inline(always)]
    pub fn off_the_way(&self, low: DVec3, high: DVec3, margin: f64) -> bool {
        self.are_off(low, high, margin + self.fastest + TOUCH)
    }
}

/// A triangle before and after a substep.
#[derive(Debug, Clone, Copy)]
pub struct Facet {
    old: [DVec3; 3],
    new: [DVec3; 3],
}

impl Facet {
    /// From its corners before and after the substep.
    pub fn new(old: [DVec3; 3], new: [DVec3; 3]) -> Self {
        Facet { old, new }
    }

    /// Where and how fast a point `from` beside the old triangle is carried by it; None where it has no area.
    pub fn carry(&self, from: DVec3) -> Option<(DVec3, DVec3)> {
        let (shares, height, _) = seen(&self.old, from)?;
        let normal = normal(&self.new)?;
        let place = at(&self.new, shares) + height * normal;
        Some((place, place - from))
    }

    /// Where the ball of `radius` on its way `from` - `to` first touches the triangle, from either side.
    pub fn meet(&self, from: DVec3, to: DVec3, radius: f64) -> Option<Hit> {
        let (first, begun, _) = seen(&self.old, from)?;
        let (last, ended, normal) = seen(&self.new, to)?;
        let side = if begun < 0.0 { -1.0 } else { 1.0 };
        let (begun, ended) = (begun * side, ended * side);
        if ended >= radius {
            return None;
        }
        let share = if begun > radius { (begun - radius) / (begun - ended) } else { 0.0 };
        let shares = first + share * (last - first);
        if shares.min_element() < -OVERLAP {
            return None;
        }
        let normal = side * normal;
        let foot = at(&self.new, shares);
        Some(Hit { share, place: foot + radius * normal, normal, shift: foot - at(&self.old, shares) })
    }
}

/// The unit normal of a triangle, None where it has no area.
fn normal(corners: &[DVec3; 3]) -> Option<DVec3> {
    (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize()
}

/// Barycentric coordinates of a point over a triangle, its height above the plane, and the unit normal.
fn seen(corners: &[DVec3; 3], point: DVec3) -> Option<(DVec3, f64, DVec3)> {
    let [a, b, c] = *corners;
    let across = (b - a).cross(c - a);
    let area = across.length_squared();
    if area < 1e-24 {
        return None;
    }
    let from = point - a;
    let v = from.cross(c - a).dot(across) / area;
    let w = (b - a).cross(from).dot(across) / area;
    let normal = across / area.sqrt();
    Some((DVec3::new(1.0 - v - w, v, w), from.dot(normal), normal))
}

fn at(corners: &[DVec3; 3], shares: DVec3) -> DVec3 {
    shares.x * corners[0] + shares.y * corners[1] + shares.z * corners[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [DVec3; 3] = [DVec3::ZERO, DVec3::new(0.0, 0.0, 2.0), DVec3::new(2.0, 0.0, 0.0)];

    fn raised(corners: [DVec3; 3], by: f64) -> [DVec3; 3] {
        corners.map(|corner| corner + by * DVec3::Y)
    }

    #[test]
    fn a_fast_point_does_not_jump_over_a_thin_limb() {
        let row = [-1.0, 0.0, 0.0, 0.01, 1.0, 0.0, 0.0, 0.01];
        let hit = Limb::new(&row, &row).meet(DVec3::new(0.3, 5.0, 0.0), DVec3::new(0.3, -5.0, 0.0), 0.002);
        let hit = hit.map(|hit| (hit.place, hit.normal));
        assert!(hit.is_some_and(|(place, up)| (place.y - 0.012).abs() < 1e-5 && up.y > 0.999), "{hit:?}");
    }

    #[test]
    fn a_limb_that_sweeps_over_a_resting_point_meets_it() {
        let (old, new) = ([-1.0, 1.0, 0.0, 0.1, 1.0, 1.0, 0.0, 0.1], [-1.0, -1.0, 0.0, 0.1, 1.0, -1.0, 0.0, 0.1]);
        let hit = Limb::new(&old, &new).meet(DVec3::ZERO, DVec3::ZERO, 0.01);
        let found = hit.map(|hit| (hit.place.y, hit.normal.y, hit.shift.y));
        assert!(found.is_some_and(|(y, up, way)| (y + 1.11).abs() < 1e-5 && up < -0.99 && way == -2.0), "{found:?}");
    }

    #[test]
    fn a_limb_carries_what_lies_on_it_through_a_turn() {
        let (old, new) = ([0.0, 0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.1], [0.0, 0.0, 0.0, 0.1, 0.0, -2.0, 0.0, 0.1]);
        let (place, _) = Limb::new(&old, &new).carry(DVec3::new(0.5, 0.12, 0.0));
        assert!((place - DVec3::new(0.12, -1.0, 0.0)).length() < 1e-12, "{place}");
    }

    #[test]
    fn a_triangle_is_met_from_both_sides_and_while_it_moves() {
        let still = Facet::new(SQUARE, SQUARE);
        for side in [1.0, -1.0] {
            let hit = still.meet(DVec3::new(0.5, side, 0.5), DVec3::new(0.5, -3.0 * side, 0.5), 0.01);
            assert!(hit.is_some_and(|hit| (hit.place.y - 0.01 * side).abs() < 1e-12 && hit.normal.y == side));
        }
        assert!(still.meet(DVec3::new(2.5, 1.0, 0.5), DVec3::new(2.5, -1.0, 0.5), 0.01).is_none());
        let rising = Facet::new(raised(SQUARE, -1.0), raised(SQUARE, 1.0));
        let hit = rising.meet(DVec3::new(0.5, 0.0, 0.5), DVec3::new(0.5, 0.0, 0.5), 0.01);
        assert!(hit.is_some_and(|hit| (hit.place.y - 1.01).abs() < 1e-12 && hit.shift.y == 2.0));
        let carried = rising.carry(DVec3::new(0.5, -0.9, 0.5));
        assert!(carried.is_some_and(|(place, _)| (place - DVec3::new(0.5, 1.1, 0.5)).length() < 1e-12));
        assert!(Facet::new([DVec3::ZERO; 3], SQUARE).meet(DVec3::Y, -DVec3::Y, 0.1).is_none());
    }

    #[test]
    fn no_path_that_meets_a_limb_is_off_its_bounds() {
        let (old, new) = ([0.0, 0.0, 0.0, 0.3, 1.0, 0.5, 0.0, 0.1], [0.2, 0.4, 0.1, 0.25, 1.1, 0.1, 0.3, 0.15]);
        let limb = Limb::new(&old, &new);
        let bounds = Bounds::new(&[new], &[limb]);
        let at = |k: i32, step: f64| (f64::from(k) * step).rem_euclid(4.0) - 1.5;
        let mut met = [0, 0];
        for k in 0..4000 {
            let from = DVec3::new(at(k, 0.618), at(k, 1.414), at(k, 2.732));
            let to = from + DVec3::new(at(k, 3.3), at(k, 0.7), at(k, 1.9)) * 0.3;
            let off = bounds.off_the_way(from.min(to), from.max(to), 0.02);
            let hit = limb.meet(from, to, 0.02).is_some();
            assert!(!(off && hit), "{from} {to}");
            met[usize::from(hit)] += usize::from(!off || hit);
        }
        assert!(met[1] > 100 && met[0] < 2000, "{met:?}");
    }
}
