//! As-rigid-as-possible and as-similar-as-possible deformation of a flat mesh by some of its vertices.
//!
//! Hornung, Dekkers, Kobbelt 2007, sections 6 and 7: an intermediate shape that follows the handles, triangles fitted
//! to it (equation 4), and the mesh joined from them again. Both linear systems are factored once (`stiffness.rs`).

use crate::error::{KernelError, check_length};
use crate::fit::{average_triangles, centred, check_triangles, rotation};
use crate::hinge::hinges;
use crate::stiffness::{System, Weighted, similar, stitched, weigh};
use glam::DVec2;
use rayon::prelude::*;

/// How fitted triangles become one mesh again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stitch {
    /// Least squares on the edges of the fitted triangles.
    Poisson,
    /// The mean of each vertex's fitted corners, as printed; handles are put back.
    Average,
}

/// A mesh and its handles, with everything factored that does not change from frame to frame.
#[derive(Debug)]
pub struct Deformer {
    triangles: Vec<[u32; 3]>,
    rest: Vec<[DVec2; 3]>,
    weighted: Vec<Weighted>,
    handles: Vec<u32>,
    /// The handles and then the guides, which steer the intermediate shape only.
    held: Vec<u32>,
    intermediate: System<DVec2>,
    stitching: System<f64>,
    count: usize,
}

/// What frames are to be deformed, and how.
#[derive(Debug, Clone, Copy)]
pub struct Frames<'a> {
    /// Where handles and then guides are, frame by frame.
    pub positions: &'a [DVec2],
    /// Every triangle's wanted shape, frame by frame; None keeps the shapes at rest.
    pub shapes: Option<&'a [[DVec2; 3]]>,
    /// How often triangles are fitted and joined.
    pub iterations: usize,
    /// How they are joined.
    pub stitch: Stitch,
}

impl Deformer {
    /// Prepares a mesh whose `handles` will be placed. Every connected piece needs a handle, and two handles or guides.
    pub fn new(
        vertices: &[DVec2],
        triangles: &[[u32; 3]],
        handles: &[u32],
        guides: &[u32],
    ) -> Result<Self, KernelError> {
        check_triangles(triangles, vertices.len())?;
        let held = [handles, guides].concat();
        if let Some(index) = held.iter().position(|vertex| *vertex as usize >= vertices.len()) {
            return Err(KernelError::Item { argument: "handles", problem: "want indices of vertices", index });
        }
        let weighted = weigh(vertices, triangles);
        let hinges = hinges(triangles, vertices.len());
        let loose = KernelError::Argument { argument: "handles", problem: "too few to say where all of the mesh goes" };
        let (like, joined) = rayon::join(
            || System::new(vertices.len(), &similar(vertices, triangles, &weighted, &hinges), &held),
            || System::new(vertices.len(), &stitched(triangles, &weighted), handles),
        );
        let (Some(intermediate), Some(stitching)) = (like, joined) else { return Err(loose) };
        let rest = triangles.iter().map(|corners| centred(corners.map(|corner| vertices[corner as usize])).0).collect();
        let (triangles, handles) = (triangles.to_vec(), handles.to_vec());
        Ok(Deformer { triangles, rest, weighted, handles, held, intermediate, stitching, count: vertices.len() })
    }

    /// Vertices of the mesh.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Deforms every frame into its part of `out`, in parallel.
    pub fn deform(&self, frames: Frames<'_>, out: &mut [DVec2]) -> Result<(), KernelError> {
        let Frames { positions, shapes, .. } = frames;
        let (held, faces) = (self.held.len(), self.triangles.len());
        let count = out.len().checked_div(self.count).unwrap_or(0);
        check_length("out", count * self.count, out.len())?;
        check_length("positions", count * held, positions.len())?;
        if let Some(shapes) = shapes {
            check_length("shapes", count * faces, shapes.len())?;
        }
        if out.is_empty() {
            return Ok(());
        }
        out.par_chunks_mut(self.count).enumerate().try_for_each(|(frame, out)| {
            let shapes = shapes.map(|shapes| &shapes[frame * faces..(frame + 1) * faces]);
            self.deform_frame(&positions[frame * held..(frame + 1) * held], shapes, frames, out)
        })
    }

    fn deform_frame(
        &self,
        positions: &[DVec2],
        shapes: Option<&[[DVec2; 3]]>,
        frames: Frames<'_>,
        out: &mut [DVec2],
    ) -> Result<(), KernelError> {
        // About their mean, so that a figure far from the origin loses no digits.
        let mean = positions.iter().sum::<DVec2>() / positions.len().max(1) as f64;
        let near: Vec<DVec2> = positions.iter().map(|position| *position - mean).collect();
        out.fill(DVec2::ZERO);
        self.intermediate.solve(&self.held, &near, out);
        let handles = &near[..self.handles.len()];
        for _ in 0..frames.iterations {
            match frames.stitch {
                Stitch::Poisson => self.stitch(shapes, handles, out),
                Stitch::Average => self.average(shapes, handles, out)?,
            }
        }
        out.iter_mut().for_each(|place| *place += mean);
        let placed = self.handles.iter().zip(positions);
        placed.for_each(|(handle, position)| out[*handle as usize] = *position);
        Ok(())
    }

    /// A triangle's centred shape, turned onto where it is now, and where its middle is now.
    #[inline(always)]
    fn fitted(&self, index: usize, shapes: Option<&[[DVec2; 3]]>, places: &[DVec2]) -> ([DVec2; 3], DVec2) {
        let shape = shapes.map_or(self.rest[index], |shapes| centred(shapes[index]).0);
        let (target, middle) = centred(self.triangles[index].map(|corner| places[corner as usize]));
        let turn = rotation(shape, target);
        (shape.map(|corner| turn.rotate(corner)), middle)
    }

    fn stitch(&self, shapes: Option<&[[DVec2; 3]]>, handles: &[DVec2], places: &mut [DVec2]) {
        let mut load = vec![DVec2::ZERO; places.len()];
        for (index, (corners, weighted)) in self.triangles.iter().zip(&self.weighted).enumerate() {
            let ([a, b, c], _) = self.fitted(index, shapes, places);
            let [u, v, w] = weighted.stitch;
            let pull = [(b - c) * u, (c - a) * v, (a - b) * w];
            load[corners[0] as usize] += pull[2] - pull[1];
            load[corners[1] as usize] += pull[0] - pull[2];
            load[corners[2] as usize] += pull[1] - pull[0];
        }
        self.stitching.solve(&self.handles, handles, &mut load);
        places.copy_from_slice(&load);
    }

    fn average(
        &self,
        shapes: Option<&[[DVec2; 3]]>,
        handles: &[DVec2],
        places: &mut [DVec2],
    ) -> Result<(), KernelError> {
        let fit = |index| {
            let (shape, middle) = self.fitted(index, shapes, places);
            shape.map(|corner| corner + middle)
        };
        let fitted: Vec<[DVec2; 3]> = (0..self.triangles.len()).map(fit).collect();
        average_triangles(&fitted, &self.triangles, places)?;
        self.handles.iter().zip(handles).for_each(|(handle, position)| places[*handle as usize] = *position);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two unit squares beside each other, cut in two each.
    const STRIP: [DVec2; 6] = [
        DVec2::new(0.0, 0.0),
        DVec2::new(0.0, 1.0),
        DVec2::new(1.0, 0.0),
        DVec2::new(1.0, 1.0),
        DVec2::new(2.0, 0.0),
        DVec2::new(2.0, 1.0),
    ];
    const TRIANGLES: [[u32; 3]; 4] = [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]];

    fn deform(handles: &[u32], guides: &[u32], positions: &[DVec2], stitch: Stitch) -> Result<Vec<DVec2>, KernelError> {
        let deformer = Deformer::new(&STRIP, &TRIANGLES, handles, guides)?;
        let mut out = vec![DVec2::NAN; 6];
        deformer.deform(Frames { positions, shapes: None, iterations: 2, stitch }, &mut out).map(|()| out)
    }

    #[test]
    fn a_rigid_motion_is_followed_and_handles_are_met_to_the_bit() {
        let place = |i: usize| DVec2::from_angle(-2.0).rotate(STRIP[i]) + DVec2::new(1e5, -3.0);
        for stitch in [Stitch::Poisson, Stitch::Average] {
            let Ok(got) = deform(&[1, 4], &[], &[place(1), place(4)], stitch) else { unreachable!() };
            assert!((0..6).all(|i| got[i].abs_diff_eq(place(i), 1e-9)), "{got:?}");
            assert_eq!((got[1], got[4]), (place(1), place(4)));
        }
    }

    #[test]
    fn a_stretched_pair_of_handles_keeps_the_width() {
        let Ok(got) = deform(&[0, 4], &[], &[STRIP[0], STRIP[4] * 1.5], Stitch::Poisson) else { unreachable!() };
        assert!(((got[3] - got[2]).length() - 1.0).abs() < 0.1, "{got:?}");
    }

    #[test]
    fn a_guide_steers_but_is_not_met() {
        let Ok(got) = deform(&[0], &[4], &[DVec2::ZERO, DVec2::new(0.0, 5.0)], Stitch::Poisson) else { unreachable!() };
        assert!(got[4].abs_diff_eq(DVec2::new(0.0, 2.0), 1e-9), "{got:?}");
    }

    #[test]
    fn too_few_handles_and_wrong_lengths_are_refused() {
        let too_few = deform(&[0], &[], &[DVec2::ZERO], Stitch::Poisson);
        assert!(matches!(too_few, Err(KernelError::Argument { argument: "handles", .. })));
        let none = deform(&[0, 4], &[], &[DVec2::ZERO], Stitch::Poisson);
        assert!(matches!(none, Err(KernelError::Length { argument: "positions", .. })));
        let wrong = deform(&[0, 9], &[], &[DVec2::ZERO; 2], Stitch::Poisson);
        assert!(matches!(wrong, Err(KernelError::Item { argument: "handles", index: 1, .. })));
    }
}
