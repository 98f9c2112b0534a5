//! What particles meet in a frame: capsules at every substep, triangles on their way through it, the ground and what lies
//! on it, and the moving air.

use crate::error::{KernelError, check_length};
use crate::sine::sine;
use crate::sweep::Facet;
use glam::DVec3;

/// Heights of something that lies on the ground: a grid of nodes, `rows` along z of `columns` along x.
#[derive(Debug, Clone, Copy)]
pub struct Bed<'a> {
    /// x and z of the first node.
    pub origin: [f64; 2],
    /// Metres between nodes.
    pub spacing: f64,
    /// Nodes along x.
    pub columns: usize,
    /// Whether flakes become part of it.
    pub absorbs: bool,
    /// World heights.
    pub heights: &'a [f64],
}

/// What they meet.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// (S + 1) x C capsules.
    pub capsules: &'a [[f64; 8]],
    /// S.
    pub substeps: usize,
    /// Before and after the frame.
    pub vertices: [&'a [DVec3]; 2],
    /// Indices of vertices.
    pub triangles: &'a [[u32; 3]],
    /// Height of the plane, -inf for none.
    pub ground: f64,
    /// Whether flakes become part of it.
    pub absorbs: bool,
    /// What lies on it.
    pub beds: &'a [Bed<'a>],
    /// The steady wind.
    pub wind: DVec3,
    /// Gusts: amplitude (3), wave vector (3), rate, phase.
    pub waves: &'a [[f64; 8]],
    /// Seconds at the frame's begin.
    pub time: f64,
}

impl Surroundings<'_> {
    /// The wind and its gusts at a place and time (seconds).
    pub fn air(&self, place: DVec3, time: f64) -> DVec3 {
        let gust = |wave: &[f64; 8]| {
            let along = place.dot(DVec3::new(wave[3], wave[4], wave[5]));
            sine(along - wave[6] * time + wave[7]) * DVec3::new(wave[0], wave[1], wave[2])
        };
        self.wind + self.waves.iter().map(gust).sum::<DVec3>()
    }

    /// Height of the ground under a place, and whether it takes flakes up.
    pub fn surface(&self, place: DVec3) -> (f64, bool) {
        let (mut found, mut within) = ((f64::NEG_INFINITY, false), false);
        for bed in self.beds {
            if let Some(height) = bed.height(place) {
                within |= bed.absorbs;
                if height >= found.0 {
                    found = (height, bed.absorbs);
                }
            }
        }
        // Snow that is pressed lies lower than the plane of the snow around it.
        let covered = within && self.absorbs;
        if covered || found.0 >= self.ground { found } else { (self.ground, self.absorbs) }
    }
}

impl Bed<'_> {
    /// Bilinear height at a place; None beside the grid.
    fn height(&self, place: DVec3) -> Option<f64> {
        let rows = self.heights.len() / self.columns;
        let (x, z) = ((place.x - self.origin[0]) / self.spacing, (place.z - self.origin[1]) / self.spacing);
        let inside = x >= 0.0 && z >= 0.0 && x <= (self.columns - 1) as f64 && z <= (rows - 1) as f64;
        if !inside {
            return None;
        }
        let (i, j) = ((x as usize).min(self.columns - 2), (z as usize).min(rows - 2));
        let (u, v) = (x - i as f64, z - j as f64);
        let at = |i: usize, j: usize| self.heights[j * self.columns + i];
        let near = (1.0 - u) * at(i, j) + u * at(i + 1, j);
        Some((1.0 - v) * near + v * ((1.0 - u) * at(i, j + 1) + u * at(i + 1, j + 1)))
    }
}

/// Boxes that the triangles sweep in the frame.
pub fn swept(around: &Surroundings<'_>) -> Vec<(DVec3, DVec3)> {
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| corner as usize);
    let bounds = |triangle| {
        corners(triangle).iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), corner| {
            let [before, after] = around.vertices.map(|vertices| vertices[*corner]);
            (low.min(before).min(after), high.max(before).max(after))
        })
    };
    around.triangles.iter().map(bounds).collect()
}

/// The triangles before and after a substep, on straight ways through the frame.
pub fn facets(around: &Surroundings<'_>, substep: usize) -> Vec<Facet> {
    let [before, after] = around.vertices;
    let at = |corner: u32, step: usize| {
        before[corner as usize].lerp(after[corner as usize], step as f64 / around.substeps as f64)
    };
    let corners = |triangle: &[u32; 3], step: usize| triangle.map(|corner| at(corner, step));
    around.triangles.iter().map(|each| Facet::new(corners(each, substep), corners(each, substep + 1))).collect()
}

/// Refuses lists that do not fit each other.
pub fn check(around: &Surroundings<'_>) -> Result<(), KernelError> {
    let count = around.capsules.len() / (around.substeps + 1);
    check_length("capsules", count * (around.substeps + 1), around.capsules.len())?;
    check_length("vertices", around.vertices[0].len(), around.vertices[1].len())?;
    for bed in around.beds {
        if bed.columns < 2 || bed.heights.len() < 2 * bed.columns || bed.heights.len() % bed.columns != 0 {
            return Err(KernelError::Argument { argument: "beds", problem: "want at least 2 x 2 nodes in whole rows" });
        }
    }
    let vertices = around.vertices[0].len();
    match around.triangles.iter().position(|corners| corners.iter().any(|corner| *corner as usize >= vertices)) {
        Some(index) => Err(KernelError::Item { argument: "triangles", problem: "names no vertex", index }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bed_has_the_height_between_its_nodes_and_none_beside_them() {
        let heights: Vec<f64> = (0..12).map(|k| f64::from(k % 4) + 10.0 * f64::from(k / 4)).collect();
        let bed = Bed { origin: [-1.0, 2.0], spacing: 0.5, columns: 4, absorbs: true, heights: &heights };
        let height = |x: f64, z: f64| bed.height(DVec3::new(x, 0.0, z));
        assert_eq!(height(-0.75, 2.25), Some(5.5));
        assert_eq!((height(-1.0, 2.0), height(0.5, 3.0)), (Some(0.0), Some(23.0)));
        assert_eq!((height(-1.01, 2.0), height(0.0, 3.01), height(f64::NAN, 2.0)), (None, None, None));
    }
}
