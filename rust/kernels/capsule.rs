//! The tapered cylinder with round ends (the convex hull of two spheres): exact distance, normal and place of a point.
//!
//! The collision volume of the 2010 paper, section 3.2. In the plane through the axis and the point its outline is two
//! circles and the line that touches both; where one sphere holds the other only the larger one is left.

use crate::error::{KernelError, check_length};
use glam::DVec3;
use rayon::prelude::*;

/// Shorter than this (metres, squared) a vector has no direction.
const TINY: f64 = 1e-24;

/// A capsule made ready for many points.
#[derive(Debug, Clone, Copy)]
pub struct Capsule {
    start: DVec3,
    along: DVec3,
    length: f64,
    radii: [f64; 2],
    /// Sine and cosine of the angle by which the side leans from the axis.
    lean: [f64; 2],
    middle: DVec3,
    reach: f64,
}

/// Where a point is seen from a capsule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// From the surface, negative inside.
    pub distance: f64,
    /// Unit vector away from the surface.
    pub normal: DVec3,
    /// 0 at the start to 1 at the end: which part of the axis moves this part of the surface.
    pub share: f64,
}

impl Capsule {
    /// Of a row: start and its radius, end and its radius.
    pub fn new(row: &[f64; 8]) -> Self {
        let (start, end) = (DVec3::new(row[0], row[1], row[2]), DVec3::new(row[4], row[5], row[6]));
        let (first, last) = (row[3], row[7]);
        let axis = end - start;
        let (length, fall) = (axis.length(), first - last);
        if length <= fall.abs() {
            let (center, radius) = if fall > 0.0 { (start, first) } else { (end, last) };
            return Self::ball(center, radius);
        }
        let sine = fall / length;
        let reach = 0.5 * length + first.max(last);
        Capsule {
            start,
            along: axis / length,
            length,
            radii: [first, last],
            lean: [sine, (1.0 - sine * sine).sqrt()],
            middle: start + 0.5 * axis,
            reach,
        }
    }

    fn ball(center: DVec3, radius: f64) -> Self {
        let (radii, lean) = ([radius; 2], [0.0, 1.0]);
        Capsule { start: center, along: DVec3::Y, length: 0.0, radii, lean, middle: center, reach: radius }
    }

    /// Whether a point may be nearer to the surface than `margin`: a quick test by the sphere around all.
    #[inline(always)]
    pub fn may_touch(&self, point: DVec3, margin: f64) -> bool {
        let reach = self.reach + margin;
        (point - self.middle).length_squared() < reach * reach
    }

    /// Whether any point of the box from `low` to `high` may be nearer to the surface than `margin`.
    pub fn may_touch_box(&self, low: DVec3, high: DVec3, margin: f64) -> bool {
        low.cmple(high).all() && self.may_touch(self.middle.clamp(low, high), margin)
    }

    /// The point of the axis at a share of its length.
    pub fn on_axis(&self, share: f64) -> DVec3 {
        self.start + share * self.length * self.along
    }

    /// The direction of the axis; a ball's is up.
    pub fn direction(&self) -> DVec3 {
        self.along
    }

    /// Distance, normal and place of a point.
    #[inline]
    pub fn nearest(&self, point: DVec3) -> Nearest {
        let offset = point - self.start;
        let height = offset.dot(self.along);
        let radial = offset - height * self.along;
        let away = radial.length();
        let [sine, cosine] = self.lean;
        let slide = height * cosine - away * sine;
        if slide <= 0.0 || self.length == 0.0 {
            return sphere(offset, self.radii[0], 0.0);
        }
        if slide >= self.length * cosine {
            return sphere(offset - self.length * self.along, self.radii[1], 1.0);
        }
        let outward = if away * away > TINY { radial / away } else { self.along.any_orthonormal_vector() };
        Nearest {
            distance: height * sine + away * cosine - self.radii[0],
            normal: sine * self.along + cosine * outward,
            share: slide / (self.length * cosine),
        }
    }
}

fn sphere(offset: DVec3, radius: f64, share: f64) -> Nearest {
    let length = offset.length();
    let normal = if length * length > TINY { offset / length } else { DVec3::Y };
    Nearest { distance: length - radius, normal, share }
}

/// For every point the least distance from any capsule and the first capsule that has it; +inf and `u32::MAX` without.
pub fn distances(
    points: &[DVec3],
    capsules: &[[f64; 8]],
    distance: &mut [f64],
    nearest: &mut [u32],
) -> Result<(), KernelError> {
    check_length("distance", points.len(), distance.len())?;
    check_length("nearest", points.len(), nearest.len())?;
    let capsules: Vec<Capsule> = capsules.iter().map(Capsule::new).collect();
    let out = distance.par_iter_mut().zip(nearest.par_iter_mut());
    points.par_iter().zip(out).with_min_len(256).for_each(|(point, (distance, nearest))| {
        (*distance, *nearest) = (f64::INFINITY, u32::MAX);
        for (index, capsule) in capsules.iter().enumerate() {
            let here = capsule.nearest(*point).distance;
            if here < *distance {
                (*distance, *nearest) = (here, index as u32);
            }
        }
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12
    }

    #[test]
    fn a_straight_capsule_has_its_radius_all_along() {
        let capsule = Capsule::new(&[0.0, 0.0, 0.0, 0.5, 0.0, 2.0, 0.0, 0.5]);
        for (point, distance, share) in [
            (DVec3::new(1.0, 1.0, 0.0), 0.5, 0.5),
            (DVec3::new(0.0, 3.0, 0.0), 0.5, 1.0),
            (DVec3::new(0.0, -1.0, 0.0), 0.5, 0.0),
            (DVec3::new(0.0, 0.5, 0.0), -0.5, 0.25),
        ] {
            let got = capsule.nearest(point);
            assert!(close(got.distance, distance) && close(got.share, share), "{got:?}");
            assert!(close(got.normal.length(), 1.0));
        }
    }

    #[test]
    fn the_side_of_a_tapered_one_touches_both_spheres() {
        let capsule = Capsule::new(&[0.0, 0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.5]);
        let [sine, cosine] = capsule.lean;
        let normal = DVec3::new(cosine, sine, 0.0);
        for (center, radius) in [(DVec3::ZERO, 1.0), (DVec3::new(0.0, 2.0, 0.0), 0.5)] {
            assert!(close(capsule.nearest(center + radius * normal).distance, 0.0));
            assert!(close(capsule.nearest(center + (radius + 0.3) * normal).distance, 0.3));
        }
    }

    #[test]
    fn a_sphere_within_the_other_adds_nothing() {
        let capsule = Capsule::new(&[0.0, 0.0, 0.0, 0.1, 0.0, 0.2, 0.0, 0.5]);
        assert!(close(capsule.nearest(DVec3::new(0.0, -0.3, 0.0)).distance, 0.0));
        let point = Capsule::new(&[1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0]).nearest(DVec3::ONE);
        assert_eq!((point.distance, point.normal), (0.0, DVec3::Y));
    }

    #[test]
    fn a_box_may_touch_what_its_nearest_corner_may() {
        let capsule = Capsule::new(&[0.0, 0.0, 0.0, 0.5, 0.0, 2.0, 0.0, 0.5]);
        let near = |x: f64| capsule.may_touch_box(DVec3::new(x, 0.0, -1.0), DVec3::new(x + 1.0, 2.0, 1.0), 0.1);
        assert!(near(0.6) && near(-1.2) && !near(1.7) && !near(-2.7));
        assert!(!capsule.may_touch_box(DVec3::INFINITY, DVec3::NEG_INFINITY, 0.1));
    }

    #[test]
    fn the_nearest_of_all_is_found_and_the_first_of_equals() {
        let rows = [[0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0], [5.0, 0.0, 0.0, 1.0, 5.0, 0.0, 0.0, 1.0]];
        let (mut distance, mut nearest) = ([0.0; 2], [9; 2]);
        let points = [DVec3::new(4.5, 0.0, 0.0), DVec3::new(2.5, 0.0, 0.0)];
        assert_eq!(distances(&points, &rows, &mut distance, &mut nearest), Ok(()));
        assert_eq!((distance, nearest), ([-0.5, 1.5], [1, 0]));
        assert_eq!(distances(&points, &[], &mut distance, &mut nearest), Ok(()));
        assert_eq!((distance, nearest), ([f64::INFINITY; 2], [u32::MAX; 2]));
        assert!(distances(&points, &rows, &mut distance[..1], &mut nearest).is_err());
    }
}
