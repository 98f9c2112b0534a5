//! The two sparse systems of a deformation, with the held vertices moved to the right-hand side.
//!
//! Intermediate shape: squared distance of each triangle from a turned and scaled copy of itself (the first step of
//! Igarashi, Moscovich, Hughes 2005). With corners as complex numbers that distance is |sum c_k z_k|, c_k the edge
//! opposite corner k at rest. Stitching: squared distance of each edge from its fitted one. Weights make errors about
//! relative to an edge's length at rest: a finely cut rim counts as much as the rest.

use crate::elimination::minimum_degree;
use crate::fit::conjugate;
use crate::hinge::Hinge;
use crate::ldl::{Entry, Factor, Upper};
use glam::DVec2;

/// Edges are counted as no shorter than this part of the mean edge: ratios of weights stay within what solves well.
const SHORTEST: f64 = 0.02;

/// The power of an edge's squared length that weighs its error. At -1 errors are relative; a little less keeps the short
/// edges of a finely cut rim better still, and flat triangles, which count less, then fold no oftener (docs/papers.md).
const SHORT_EDGES: f64 = -1.25;

/// Triangles are counted as no flatter than this ratio of twice the area to the sum of squared edges (0.29 at best).
const FLATTEST: f64 = 0.01;

/// How much a hinge resists bending, relative to a triangle: enough to be solved, too little to be seen.
const HINGE: f64 = 1e-2;

/// An entry of a matrix: row, column, value.
type Triplet<E> = (u32, u32, E);

/// Edges of a triangle, each opposite its corner, and how much errors count.
#[derive(Debug, Clone, Copy)]
pub struct Weighted {
    /// The edge opposite each corner, from the next corner but one to the next.
    pub edges: [DVec2; 3],
    /// The weight of each edge when triangles are stitched.
    pub stitch: [f64; 3],
    /// The weight of the triangle in the intermediate shape.
    pub similar: f64,
}

/// Weighs all triangles of a mesh whose coordinates are `places`.
pub fn weigh(places: &[DVec2], triangles: &[[u32; 3]]) -> Vec<Weighted> {
    let edges = |[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| places[*corner as usize]);
        [b - c, c - a, a - b]
    };
    let squares: f64 = triangles.iter().flat_map(edges).map(DVec2::length_squared).sum();
    let mean = squares / (3 * triangles.len().max(1)) as f64;
    // A mesh without any size has no lengths to be relative to.
    let unit = if mean > 0.0 { mean } else { 1.0 };
    let weighted = |triangle: &[u32; 3]| {
        let edges = edges(triangle).map(|edge| edge / unit.sqrt());
        let squared = edges.map(|edge| edge.length_squared().max(SHORTEST * SHORTEST));
        let total: f64 = squared.iter().sum();
        let wide = (edges[0].perp_dot(edges[1]).abs() / total).max(FLATTEST);
        let stitch = squared.map(|squared| wide.sqrt() * squared.powf(SHORT_EDGES));
        Weighted { edges, stitch, similar: squared.iter().map(|squared| squared.recip()).sum() }
    };
    triangles.iter().map(weighted).collect()
}

/// Entries of the intermediate shape's matrix.
pub fn similar(
    places: &[DVec2],
    triangles: &[[u32; 3]],
    weighted: &[Weighted],
    hinges: &[Hinge],
) -> Vec<Triplet<DVec2>> {
    let mut out = Vec::with_capacity(9 * triangles.len());
    for (corners, w) in triangles.iter().zip(weighted) {
        for (i, a) in corners.iter().zip(w.edges) {
            out.extend(corners.iter().zip(w.edges).map(|(j, b)| (*i, *j, conjugate(a).rotate(b) * w.similar)));
        }
        for k in 0..3 {
            if w.edges[k] == DVec2::ZERO {
                // Corners in one place: no ratio of edges holds them together.
                spring(corners[(k + 1) % 3], corners[(k + 2) % 3], DVec2::X, &mut out);
            }
        }
    }
    hinges.iter().for_each(|hinge| star(places, hinge, &mut out));
    out
}

/// Entries of the stitching matrix.
pub fn stitched(triangles: &[[u32; 3]], weighted: &[Weighted]) -> Vec<Triplet<f64>> {
    let mut out = Vec::with_capacity(12 * triangles.len());
    for (corners, w) in triangles.iter().zip(weighted) {
        for k in 0..3 {
            spring(corners[(k + 1) % 3], corners[(k + 2) % 3], w.stitch[k], &mut out);
        }
    }
    out
}

/// Adds the squared difference of two vertices.
fn spring<E: Entry>(i: u32, j: u32, weight: E, out: &mut Vec<Triplet<E>>) {
    let opposite = weight.scale(-1.0);
    out.extend([(i, i, weight), (j, j, weight), (i, j, opposite), (j, i, opposite)]);
}

/// Adds the squared distance of a hinge's neighbours from a turned and scaled copy of how they lie round it.
fn star(places: &[DVec2], hinge: &Hinge, out: &mut Vec<Triplet<DVec2>>) {
    let from_hinge = |other: &u32| places[*other as usize] - places[hinge.vertex as usize];
    let total: f64 = hinge.others.iter().map(|other| from_hinge(other).length_squared()).sum();
    if total == 0.0 {
        return;
    }
    let weight = HINGE / total;
    for i in &hinge.others {
        spring(hinge.vertex, *i, DVec2::X * HINGE, out);
        for j in &hinge.others {
            // Minus the part that the best turn and scale explain, as differences from the hinge.
            let shared = from_hinge(i).rotate(conjugate(from_hinge(j))) * -weight;
            out.extend([(*i, *j, shared), (*i, hinge.vertex, -shared), (hinge.vertex, *j, -shared)]);
            out.push((hinge.vertex, hinge.vertex, shared));
        }
    }
}

/// A factored system: unknown vertices in elimination order, and how the held ones pull at them.
#[derive(Debug)]
pub struct System<E> {
    order: Vec<u32>,
    pulls: Vec<Triplet<E>>,
    factor: Factor<E>,
}

impl<E: Entry> System<E> {
    /// From the entries over `count` vertices, of which `held` are given; None where they do not suffice.
    pub fn new(count: usize, entries: &[Triplet<E>], held: &[u32]) -> Option<Self> {
        let mut role = vec![Role::Free(0); count];
        held.iter().enumerate().for_each(|(index, vertex)| role[*vertex as usize] = Role::Held(index as u32));
        let free: Vec<u32> = (0..count as u32).filter(|v| matches!(role[*v as usize], Role::Free(_))).collect();
        free.iter().enumerate().for_each(|(index, vertex)| role[*vertex as usize] = Role::Free(index as u32));
        let pair = |(i, j, _): &Triplet<E>| match (role[*i as usize], role[*j as usize]) {
            (Role::Free(i), Role::Free(j)) if i < j => Some([i, j]),
            _ => None,
        };
        let pairs: Vec<[u32; 2]> = entries.iter().filter_map(pair).collect();
        let order: Vec<u32> =
            minimum_degree(free.len(), &pairs).into_iter().map(|index| free[index as usize]).collect();
        order.iter().enumerate().for_each(|(index, vertex)| role[*vertex as usize] = Role::Free(index as u32));
        let inner = entries.iter().filter_map(|(i, j, value)| match (role[*i as usize], role[*j as usize]) {
            (Role::Free(i), Role::Free(j)) => Some((i, j, *value)),
            _ => None,
        });
        let factor = Factor::new(&Upper::new(order.len(), inner))?;
        let pull = |(i, j, value): &Triplet<E>| match (role[*i as usize], role[*j as usize]) {
            (Role::Free(i), Role::Held(j)) => Some((i, j, *value)),
            _ => None,
        };
        Some(System { pulls: entries.iter().filter_map(pull).collect(), order, factor })
    }

    /// Solves for every vertex: `load` holds the right-hand side before, the places after.
    pub fn solve(&self, held: &[u32], positions: &[DVec2], load: &mut [DVec2]) {
        let mut x: Vec<DVec2> = self.order.iter().map(|vertex| load[*vertex as usize]).collect();
        self.pulls.iter().for_each(|(row, index, value)| x[*row as usize] -= value.times(positions[*index as usize]));
        self.factor.solve(&mut x);
        self.order.iter().zip(x).for_each(|(vertex, x)| load[*vertex as usize] = x);
        held.iter().zip(positions).for_each(|(vertex, position)| load[*vertex as usize] = *position);
    }
}

/// What a vertex is to a system, with its index there.
#[derive(Debug, Clone, Copy)]
enum Role {
    Free(u32),
    Held(u32),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hinge::hinges;

    /// Two triangles that share vertex 2 only, and one of no size at vertex 4.
    const PLACES: [DVec2; 6] = [
        DVec2::new(0.0, 0.0),
        DVec2::new(2.0, 0.0),
        DVec2::new(1.0, 1.0),
        DVec2::new(0.0, 2.0),
        DVec2::new(3.0, 3.0),
        DVec2::new(3.0, 3.0),
    ];
    const TRIANGLES: [[u32; 3]; 3] = [[0, 1, 2], [2, 3, 4], [4, 5, 4]];

    #[test]
    fn what_is_turned_grown_and_moved_costs_nothing() {
        let weighted = weigh(&PLACES, &TRIANGLES);
        let entries = similar(&PLACES, &TRIANGLES, &weighted, &hinges(&TRIANGLES, 6));
        let moved = PLACES.map(|place| DVec2::new(-0.3, 2.0).rotate(place) + DVec2::splat(5.0));
        let mut forces = [DVec2::ZERO; 6];
        entries.iter().for_each(|(i, j, value)| forces[*i as usize] += value.rotate(moved[*j as usize]));
        assert!(forces.iter().all(|force| force.length() < 1e-10), "{forces:?}");
    }

    #[test]
    fn hinges_and_flat_triangles_leave_a_system_that_can_be_solved() {
        let weighted = weigh(&PLACES, &TRIANGLES);
        let entries = similar(&PLACES, &TRIANGLES, &weighted, &hinges(&TRIANGLES, 6));
        let Some(system) = System::new(6, &entries, &[0, 1]) else { unreachable!() };
        let mut places = [DVec2::ZERO; 6];
        system.solve(&[0, 1], &[DVec2::ZERO, DVec2::new(0.0, 4.0)], &mut places);
        let wanted = PLACES.map(|place| DVec2::new(0.0, 2.0).rotate(place));
        assert!(places.iter().zip(wanted).all(|(got, want)| got.abs_diff_eq(want, 1e-8)), "{places:?}");
        assert!(System::new(6, &entries, &[0]).is_none());
    }
}
