//! Triangles turned and moved onto a deformed mesh, and the mesh that averages them.
//!
//! Hornung, Dekkers, Kobbelt 2007, section 7, equation 4, after Horn 1987. Points of the plane are taken as complex
//! numbers: the rotation that brings centred corners p closest to centred corners q is the direction of sum conj(p) q.

use crate::error::{KernelError, check_length};
use glam::DVec2;
use std::array::from_fn;

/// Refuses triangles with a corner that is no vertex.
pub fn check_triangles(triangles: &[[u32; 3]], count: usize) -> Result<(), KernelError> {
    match triangles.iter().position(|corners| corners.iter().any(|corner| *corner as usize >= count)) {
        Some(index) => Err(KernelError::Item { argument: "triangles", problem: "want indices of vertices", index }),
        None => Ok(()),
    }
}

/// The number whose angle is less and whose length is the same.
#[inline(always)]
pub fn conjugate(z: DVec2) -> DVec2 {
    DVec2::new(z.x, -z.y)
}

/// Three corners about their mean, and the mean.
#[inline(always)]
pub fn centred(corners: [DVec2; 3]) -> ([DVec2; 3], DVec2) {
    let mean = (corners[0] + corners[1] + corners[2]) / 3.0;
    (corners.map(|corner| corner - mean), mean)
}

/// The unit number that turns centred `shape` best onto `target`; one (no turn) where every angle is as good.
#[inline(always)]
pub fn rotation(shape: [DVec2; 3], target: [DVec2; 3]) -> DVec2 {
    let sum = (0..3).fold(DVec2::ZERO, |sum, k| sum + conjugate(shape[k]).rotate(target[k]));
    let length = sum.length();
    // Squares of very large or small numbers leave the range: then the numbers are scaled first.
    if (1e-140..1e140).contains(&length) {
        return sum / length;
    }
    let scaled = sum / sum.abs().max_element();
    if scaled.is_finite() { scaled / scaled.length() } else { DVec2::X }
}

/// Fits each of `shapes` onto its triangle of the mesh by rotation and translation only (equation 4).
pub fn fit_triangles(
    shapes: &[[DVec2; 3]],
    intermediate: &[DVec2],
    triangles: &[[u32; 3]],
    out: &mut [[DVec2; 3]],
) -> Result<(), KernelError> {
    check_length("shapes", triangles.len(), shapes.len())?;
    check_length("out", triangles.len(), out.len())?;
    check_triangles(triangles, intermediate.len())?;
    for ((out, shape), corners) in out.iter_mut().zip(shapes).zip(triangles) {
        let (shape, _) = centred(*shape);
        let (target, mean) = centred(corners.map(|corner| intermediate[corner as usize]));
        let turn = rotation(shape, target);
        *out = from_fn(|k| mean + turn.rotate(shape[k]));
    }
    Ok(())
}

/// Puts each vertex at the mean of its fitted corners (section 7).
pub fn average_triangles(fitted: &[[DVec2; 3]], triangles: &[[u32; 3]], out: &mut [DVec2]) -> Result<(), KernelError> {
    check_length("fitted", triangles.len(), fitted.len())?;
    check_triangles(triangles, out.len())?;
    let mut counts = vec![0u32; out.len()];
    out.fill(DVec2::ZERO);
    for (corners, places) in triangles.iter().zip(fitted) {
        for (corner, place) in corners.iter().zip(places) {
            out[*corner as usize] += *place;
            counts[*corner as usize] += 1;
        }
    }
    for (index, (place, count)) in out.iter_mut().zip(counts).enumerate() {
        if count == 0 {
            return Err(KernelError::Item { argument: "triangles", problem: "no triangle has the vertex", index });
        }
        *place /= f64::from(count);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [[u32; 3]; 1] = [[0, 1, 2]];
    const SHAPE: [DVec2; 3] = [DVec2::new(0.0, 0.0), DVec2::new(4.0, 0.0), DVec2::new(0.0, 3.0)];

    #[test]
    fn a_turned_and_grown_triangle_is_met_turned_but_not_grown() {
        let turn = DVec2::from_angle(2.5);
        let intermediate = SHAPE.map(|corner| turn.rotate(corner) * 7.0 + DVec2::new(-8.0, 5.0));
        let mut out = [[DVec2::ZERO; 3]];
        assert_eq!(fit_triangles(&[SHAPE], &intermediate, &TRIANGLE, &mut out), Ok(()));
        let mean = intermediate.iter().sum::<DVec2>() / 3.0;
        let wanted = centred(SHAPE).0.map(|corner| mean + turn.rotate(corner));
        assert!(out[0].iter().zip(wanted).all(|(got, want)| got.abs_diff_eq(want, 1e-12)), "{out:?}");
    }

    #[test]
    fn a_triangle_without_size_stays_as_it_is() {
        for (shape, target) in [(SHAPE, [DVec2::ONE; 3]), ([DVec2::ONE; 3], SHAPE)] {
            let mut out = [[DVec2::NAN; 3]];
            assert_eq!(fit_triangles(&[shape], &target, &TRIANGLE, &mut out), Ok(()));
            assert!(out[0].iter().all(|corner| corner.is_finite()));
        }
    }

    #[test]
    fn vertices_of_no_triangle_and_wrong_corners_are_named() {
        let mut out = [DVec2::ZERO; 4];
        let lonely = average_triangles(&[SHAPE], &TRIANGLE, &mut out);
        assert!(matches!(lonely, Err(KernelError::Item { index: 3, .. })));
        let wrong = average_triangles(&[SHAPE], &TRIANGLE, &mut out[..2]);
        assert!(matches!(wrong, Err(KernelError::Item { argument: "triangles", index: 0, .. })));
    }
}
