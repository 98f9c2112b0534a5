//! What the pixels of depth and coverage maps may hold, and where the first one stands that does not.

use crate::error::KernelError;

/// What a depth must be.
pub const WANT_DEPTH: &str = "want metres or +inf, got NaN or -inf";

/// What a drawing's coverage must be.
pub const WANT_ALPHA: &str = "want 0 to 1";

/// Whether a depth is allowed: +inf is "nothing here", NaN and -inf are mistakes.
#[inline(always)]
pub fn depth_is_fine(z: f32) -> bool {
    z > f32::NEG_INFINITY
}

/// Whether a drawing's coverage is allowed.
#[inline(always)]
pub fn alpha_is_fine(alpha: f32) -> bool {
    (0.0..=1.0).contains(&alpha)
}

/// Whether a drawing of depth `z` is in front of a render of depth `rendered`: ties go to the render, a drawing
/// without depth is in front.
#[inline(always)]
pub fn in_front(z: f32, rendered: f32) -> bool {
    (z < rendered) | (z == f32::INFINITY)
}

/// Names the first value that is not allowed, in the order in which they lie, whatever thread met one first.
pub fn first_fault<T>(
    argument: &'static str,
    problem: &'static str,
    values: &[T],
    width: usize,
    allowed: impl Fn(&T) -> bool,
) -> Option<KernelError> {
    let index = values.iter().position(|value| !allowed(value))?;
    Some(KernelError::Pixel { argument, problem, row: index / width, column: index % width })
}
