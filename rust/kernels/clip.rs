//! Triangles cut where they cannot be projected: at the near plane, and far outside of the picture.
//!
//! Points are homogeneous pixels (x z, y z, z) with the planar depth z, as a 3x4 camera matrix gives them. A cut edge
//! gets its new corner from its inner and its outer end in this order, so both triangles of a shared edge get the same
//! one. The rim of the picture itself needs no cut: rows and columns are bounded when they are filled.

use glam::DVec3;

/// Pixels farther than this from the origin are cut off, so that products of snapped coordinates fit 64 bits.
pub const GUARD: f64 = (1 << 20) as f64;

/// Three corners and at most one more for each of five planes.
const MOST: usize = 8;

/// A convex polygon without a heap.
#[derive(Clone, Copy)]
pub struct Polygon {
    corners: [DVec3; MOST],
    count: usize,
}

impl Polygon {
    fn empty() -> Self {
        Polygon { corners: [DVec3::ZERO; MOST], count: 0 }
    }

    fn push(&mut self, corner: DVec3) {
        if let Some(place) = self.corners.get_mut(self.count) {
            *place = corner;
            self.count += 1;
        }
    }

    /// The corners in order.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// The part where `inside` is not negative; `inside` is affine.
    fn cut(&self, inside: impl Fn(DVec3) -> f64) -> Polygon {
        let mut kept = Polygon::empty();
        let corners = self.corners();
        for (i, &corner) in corners.iter().enumerate() {
            let next = corners[(i + 1) % corners.len()];
            let (here, there) = (inside(corner), inside(next));
            if here >= 0.0 {
                kept.push(corner);
            }
            if here >= 0.0 && there < 0.0 {
                kept.push(corner.lerp(next, here / (here - there)));
            } else if here < 0.0 && there >= 0.0 {
                kept.push(next.lerp(corner, there / (there - here)));
            }
        }
        kept
    }
}

/// Whether a point needs no cut.
pub fn is_inside(point: DVec3, near: f64) -> bool {
    let reach = GUARD * point.z;
    point.z >= near && point.x.abs() <= reach && point.y.abs() <= reach
}

/// The part of a triangle with z >= near and |x|, |y| <= GUARD; it may be empty.
pub fn clip(corners: [DVec3; 3], near: f64) -> Polygon {
    let mut polygon = Polygon::empty();
    corners.into_iter().for_each(|corner| polygon.push(corner));
    polygon
        .cut(|p| p.z - near)
        .cut(|p| GUARD * p.z - p.x)
        .cut(|p| GUARD * p.z + p.x)
        .cut(|p| GUARD * p.z - p.y)
        .cut(|p| GUARD * p.z + p.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    const INSIDE: [DVec3; 3] = [DVec3::new(0., 0., 1.), DVec3::new(4., 0., 2.), DVec3::new(0., 4., 2.)];

    #[test]
    fn what_lies_inside_stays_as_it_is() {
        assert_eq!(clip(INSIDE, 0.5).corners(), INSIDE);
        assert_eq!(clip(INSIDE, 1.0).corners(), INSIDE);
        assert!(clip(INSIDE, 2.5).corners().is_empty());
    }

    #[test]
    fn one_corner_behind_the_near_plane_becomes_two_on_it() {
        let got = clip(INSIDE, 1.5);
        assert_eq!(got.corners().len(), 4);
        assert!(got.corners().iter().all(|p| p.z >= 1.5));
        assert!(got.corners().contains(&DVec3::new(2., 0., 1.5)));
        assert!(got.corners().contains(&DVec3::new(0., 2., 1.5)));
    }

    #[test]
    fn a_shared_edge_is_cut_at_the_same_bits_from_both_sides() {
        let (a, b) = (DVec3::new(0.1, 0.7, 3.3), DVec3::new(-7.3, 11.9, -2.7));
        let (c, d) = (DVec3::new(5.1, 0.3, 1.7), DVec3::new(-9.1, 0.9, 2.9));
        let (left, right) = (clip([a, b, c], 0.01), clip([b, a, d], 0.01));
        let shared: Vec<_> = left.corners().iter().filter(|p| right.corners().contains(p)).collect();
        assert_eq!(shared.len(), 2, "the inner end and the new corner");
    }

    #[test]
    fn a_corner_far_outside_is_brought_to_the_guard() {
        let far = [DVec3::new(1e12, 0., 1.), DVec3::new(0., 0., 1.), DVec3::new(0., 9., 1.)];
        assert!(!is_inside(far[0], 0.1) && is_inside(far[1], 0.1));
        let got = clip(far, 0.1);
        assert!(got.corners().len() == 4 && got.corners().iter().all(|p| p.x <= GUARD * (1.0 + 1e-12) * p.z));
    }
}
