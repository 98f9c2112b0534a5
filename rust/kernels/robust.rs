//! Robust losses: what a residual costs, and the weight with which it pulls.
//!
//! Every loss is a function of the squared residual in units of its scale, about equal to it near zero. The weight is
//! the loss's derivative by the squared residual: iteratively reweighted least squares.

use crate::lanes::Lanes;

/// What a residual of e scales costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// e^2.
    Squared,
    /// e^2 up to one scale, then 2 e - 1: an outlier pulls no more than a residual of one scale does.
    Huber,
    /// ln(1 + e^2): an outlier pulls less the farther it lies.
    Cauchy,
    /// e^2 / (1 + e^2): an outlier costs one at most and hardly pulls.
    GemanMcClure,
}

impl Loss {
    /// Cost and weight of a squared residual.
    #[inline(always)]
    pub fn of(self, squared: Lanes) -> (Lanes, Lanes) {
        let one = Lanes::splat(1.0);
        match self {
            Loss::Squared => (squared, one),
            Loss::Huber => {
                let inside = squared.below(one);
                let residual = one.or(&inside, squared).sqrt();
                (squared.or(&inside, residual + residual - one), one / residual)
            }
            Loss::Cauchy => (squared.map(f64::ln_1p), one / (one + squared)),
            Loss::GemanMcClure => {
                let shrink = one / (one + squared);
                (squared * shrink, shrink * shrink)
            }
        }
    }
}
