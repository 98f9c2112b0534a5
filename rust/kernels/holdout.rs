//! Mattes with which a compositing package does the depth composite again.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, equation 16, as coverage: how much of a pixel the drawing takes from the render,
//! and how much of the drawing is seen. Nearer over farther is render * (1 - holdout) + drawing * visible.

use crate::checks::{WANT_ALPHA, WANT_DEPTH, alpha_is_fine, depth_is_fine, first_fault, in_front};
use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// What a matte is made of; row-major, `width` columns, the render `scale` times as wide and high.
#[derive(Clone, Copy)]
pub struct Planes<'a> {
    /// The drawing's coverage, 0..=1.
    pub alpha: &'a [f32],
    /// The drawing's depth, +inf: none, in front.
    pub depth: &'a [f32],
    /// The render's coverage: given, the part of the drawing behind it that shows through counts too.
    pub rendered_alpha: Option<&'a [f32]>,
    /// The render's depth, +inf where there is nothing.
    pub rendered_depth: &'a [f32],
    /// Columns of the drawing.
    pub width: usize,
    /// Samples on a pixel's side.
    pub scale: usize,
}

/// Writes the drawing's coverage in front of the render (or all of it that is seen), averaged over the samples.
pub fn matte(planes: &Planes, out: &mut [f32]) -> Result<(), KernelError> {
    let (count, samples) = (planes.alpha.len(), planes.alpha.len() * planes.scale * planes.scale);
    check_length("out", count, out.len())?;
    check_length("drawing_depth", count, planes.depth.len())?;
    check_length("rendered_depth", samples, planes.rendered_depth.len())?;
    check_length("rendered_alpha", samples, planes.rendered_alpha.map_or(samples, <[f32]>::len))?;
    if planes.scale == 0 || planes.width == 0 || count % planes.width != 0 {
        let problem = "want whole rows and a render at least as large";
        return if count == 0 { Ok(()) } else { Err(KernelError::Argument { argument: "alpha", problem }) };
    }
    let rows = out.par_chunks_mut(planes.width).enumerate();
    let fine = rows.map(|(row, out)| matte_row(planes, row, out)).reduce(|| true, |a, b| a & b);
    if fine { Ok(()) } else { Err(fault(planes)) }
}

/// Writes one row; tells whether all its values are allowed.
fn matte_row(planes: &Planes, row: usize, out: &mut [f32]) -> bool {
    let Planes { width, scale, .. } = *planes;
    let (alpha, depth) = (&planes.alpha[row * width..][..width], &planes.depth[row * width..][..width]);
    let mut fine = true;
    out.fill(0.0);
    for sub in 0..scale * scale {
        let start = (row * scale + sub / scale) * width * scale + sub % scale;
        let rendered = planes.rendered_depth[start..].iter().step_by(scale);
        for ((out, &z), &other) in out.iter_mut().zip(depth).zip(rendered) {
            fine &= depth_is_fine(z) & depth_is_fine(other);
            *out += f32::from(in_front(z, other));
        }
        if let Some(covered) = planes.rendered_alpha {
            let rendered = planes.rendered_depth[start..].iter().step_by(scale);
            let rendered = rendered.zip(covered[start..].iter().step_by(scale));
            for ((out, &z), (&other, &covered)) in out.iter_mut().zip(depth).zip(rendered) {
                fine &= covered.is_finite();
                *out += if in_front(z, other) { 0.0 } else { 1.0 - covered.clamp(0.0, 1.0) };
            }
        }
    }
    let share = 1.0 / (scale * scale) as f32;
    for (out, &alpha) in out.iter_mut().zip(alpha) {
        fine &= alpha_is_fine(alpha);
        *out = alpha * (*out * share);
    }
    fine
}

/// The first value that is not allowed.
fn fault(planes: &Planes) -> KernelError {
    let (width, large) = (planes.width, planes.width * planes.scale);
    let covered = planes.rendered_alpha.unwrap_or(&[]);
    first_fault("alpha", WANT_ALPHA, planes.alpha, width, |a| alpha_is_fine(*a))
        .or_else(|| first_fault("drawing_depth", WANT_DEPTH, planes.depth, width, |z| depth_is_fine(*z)))
        .or_else(|| first_fault("rendered_alpha", "want finite numbers", covered, large, |a| a.is_finite()))
        .or_else(|| first_fault("rendered_depth", WANT_DEPTH, planes.rendered_depth, large, |z| depth_is_fine(*z)))
        .unwrap_or(KernelError::Argument { argument: "alpha", problem: "changed while it was read" })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matte_of(alpha: f32, z: f32, rendered_alpha: Option<&[f32]>, rendered_depth: &[f32]) -> Vec<f32> {
        let (alpha, depth, mut out) = ([alpha], [z], vec![9.0]);
        let planes = Planes { alpha: &alpha, depth: &depth, rendered_alpha, rendered_depth, width: 1, scale: 2 };
        assert_eq!(matte(&planes, &mut out), Ok(()));
        out
    }

    #[test]
    fn counts_the_samples_that_the_drawing_is_in_front_of() {
        assert_eq!(matte_of(0.5, 2.0, None, &[1.0, 2.0, 3.0, f32::INFINITY]), [0.25]);
        assert_eq!(matte_of(0.5, f32::INFINITY, None, &[1.0; 4]), [0.5]);
    }

    #[test]
    fn what_shows_through_a_soft_render_is_seen_too() {
        assert_eq!(
            matte_of(1.0, 2.0, Some(&[0.25, 0.25, 7.0, -1.0]), &[1.0, 3.0, 1.0, 1.0]),
            [(0.75 + 1.0 + 1.0) / 4.0]
        );
    }

    #[test]
    fn the_first_fault_is_named_in_the_renders_own_pixels() {
        let mut out = [0.0];
        let rendered_depth = [1.0, 1.0, f32::NAN, 1.0];
        let planes = Planes {
            alpha: &[1.0],
            depth: &[1.0],
            rendered_alpha: None,
            rendered_depth: &rendered_depth,
            width: 1,
            scale: 2,
        };
        let got = matte(&planes, &mut out);
        assert!(matches!(got, Err(KernelError::Pixel { argument: "rendered_depth", row: 1, column: 0, .. })));
    }
}
