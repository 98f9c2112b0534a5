//! Constrained Delaunay triangulation of a drawing's outlines, and which places lie inside them.
//!
//! The triangulation is the crate `spade`'s, with exact predicates. A place belongs to the smallest ring that holds it:
//! inside when that ring is an outline, outside when it is a hole or when no ring holds it.

use crate::error::KernelError;
use glam::DVec2;
use rayon::prelude::*;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// All triangles of the points' convex hull.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct Mesh {
    /// Corners, counter-clockwise where y points up.
    pub triangles: Vec<[u32; 3]>,
    /// Edges, by their points, that cross another edge and so are missing.
    pub crossing: Vec<[u32; 2]>,
}

/// Triangulates `points` with every one of `edges` (pairs of points) kept as an edge of the result.
///
/// Points must differ from each other. An edge that runs through a point is kept in parts.
pub fn triangulate(points: &[DVec2], edges: &[[u32; 2]]) -> Result<Mesh, KernelError> {
    if let Some(index) = edges.iter().position(|edge| edge.iter().any(|point| *point as usize >= points.len())) {
        return Err(KernelError::Item { argument: "edges", problem: "want indices of points", index });
    }
    let places = points.iter().map(|point| Point2::new(point.x, point.y)).collect();
    let pairs = edges.iter().filter(|[from, to]| from != to).map(|edge| edge.map(|point| point as usize)).collect();
    let mut crossing = Vec::new();
    let mesh: ConstrainedDelaunayTriangulation<_> =
        ConstrainedDelaunayTriangulation::try_bulk_load_cdt(places, pairs, |edge| {
            crossing.push(edge.map(|p| p as u32))
        })
        .map_err(|_| KernelError::Argument { argument: "points", problem: "want coordinates of usual sizes" })?;
    if mesh.num_vertices() != points.len() {
        return Err(KernelError::Argument { argument: "points", problem: "want points at different places" });
    }
    let triangles = mesh.inner_faces().map(|face| face.vertices().map(|vertex| vertex.fix().index() as u32)).collect();
    Ok(Mesh { triangles, crossing })
}

/// A closed ring of places, and whether it is a hole.
#[derive(Debug, Clone)]
pub struct Ring {
    places: Vec<DVec2>,
    hole: bool,
    area: f64,
}

impl Ring {
    /// A ring through `places`; its last place is joined to its first.
    pub fn new(places: &[DVec2], hole: bool) -> Self {
        Ring { places: places.to_vec(), hole, area: signed_area(places).abs() }
    }

    /// Whether the ring runs round `place` (even-odd).
    fn holds(&self, place: DVec2) -> bool {
        let ends = self.places.iter().zip(self.places.iter().cycle().skip(1));
        ends.filter(|(a, b)| (a.y > place.y) != (b.y > place.y) && left_of(place, **a, **b)).count() % 2 == 1
    }
}

/// Whether `place` lies left of where the edge between `a` and `b` crosses its row.
fn left_of(place: DVec2, a: DVec2, b: DVec2) -> bool {
    let (top, bottom) = if a.y < b.y { (a, b) } else { (b, a) };
    (bottom - top).perp_dot(place - top) > 0.0
}

/// Twice the area inside a ring, positive where x turns to y.
fn signed_area(places: &[DVec2]) -> f64 {
    places.iter().zip(places.iter().cycle().skip(1)).map(|(a, b)| (*a - places[0]).perp_dot(*b - places[0])).sum()
}

/// Says of each of `places` whether it is inside, by the smallest of `rings` that holds it.
pub fn inside(places: &[DVec2], rings: &[Ring]) -> Vec<bool> {
    let mut sorted: Vec<&Ring> = rings.iter().collect();
    sorted.sort_by(|a, b| a.area.total_cmp(&b.area));
    places
        .par_iter()
        .map(|place| sorted.iter().find(|ring| ring.holds(*place)).is_some_and(|ring| !ring.hole))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> [DVec2; 4] {
        [DVec2::new(low, low), DVec2::new(high, low), DVec2::new(high, high), DVec2::new(low, high)]
    }

    #[test]
    fn a_given_edge_is_kept_against_delaunay() {
        // The flat rhombus' short diagonal is Delaunay's choice.
        let points = [DVec2::new(-5.0, 0.0), DVec2::new(0.0, -1.0), DVec2::new(5.0, 0.0), DVec2::new(0.0, 1.0)];
        let has = |mesh: &Mesh, a: u32, b: u32| mesh.triangles.iter().all(|t| t.contains(&a) && t.contains(&b));
        assert!(triangulate(&points, &[]).is_ok_and(|mesh| mesh.triangles.len() == 2 && has(&mesh, 1, 3)));
        assert!(triangulate(&points, &[[0, 2]]).is_ok_and(|mesh| mesh.triangles.len() == 2 && has(&mesh, 0, 2)));
    }

    #[test]
    fn crossing_edges_and_equal_points_are_told() {
        let points = square(0.0, 1.0);
        assert!(triangulate(&points, &[[0, 2], [1, 3]]).is_ok_and(|mesh| mesh.crossing.len() == 1));
        assert!(triangulate(&[DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::X], &[]).is_err());
        assert!(triangulate(&points, &[[0, 4]]).is_err());
        assert_eq!(triangulate(&[], &[]), Ok(Mesh::default()));
    }

    #[test]
    fn the_smallest_ring_decides() {
        let rings = [
            Ring::new(&square(0.0, 9.0), false),
            Ring::new(&square(2.0, 7.0), true),
            Ring::new(&square(4.0, 5.0), false),
        ];
        let places = [1.0, 3.0, 4.5, 8.0, 10.0].map(DVec2::splat);
        assert_eq!(inside(&places, &rings), [true, false, true, true, false]);
    }
}
