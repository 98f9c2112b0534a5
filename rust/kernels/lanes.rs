//! Eight numbers worked side by side: the same small problem for eight poses at once.
//!
//! Plain arrays, which the compiler turns into wide registers where the machine has them. What happens in one lane
//! never depends on another.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// How many problems are worked side by side.
pub const LANES: usize = 8;

/// One number for every lane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes(pub [f64; LANES]);

/// One choice for every lane.
pub type Mask = [bool; LANES];

macro_rules! lanewise {
    ($name:ident, $method:ident, $operator:tt) => {
        impl $name for Lanes {
            type Output = Lanes;
            #[inline(always)]
            fn $method(self, other: Lanes) -> Lanes {
                let mut out = self.0;
                for (out, other) in out.iter_mut().zip(other.0) {
                    *out $operator other;
                }
                Lanes(out)
            }
        }
    };
}

lanewise!(Add, add, +=);
lanewise!(Sub, sub, -=);
lanewise!(Mul, mul, *=);
lanewise!(Div, div, /=);

impl Neg for Lanes {
    type Output = Lanes;
    #[inline(always)]
    fn neg(self) -> Lanes {
        self.map(|value| -value)
    }
}

impl Lanes {
    /// Zero in every lane.
    pub const ZERO: Lanes = Lanes([0.0; LANES]);

    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(value: f64) -> Lanes {
        Lanes([value; LANES])
    }

    /// A function of every lane's number.
    #[inline(always)]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Lanes {
        let mut out = self.0;
        for value in &mut out {
            *value = f(*value);
        }
        Lanes(out)
    }

    /// The square root.
    #[inline(always)]
    pub fn sqrt(self) -> Lanes {
        self.map(f64::sqrt)
    }

    /// The number pulled into `-limit..limit`.
    #[inline(always)]
    pub fn within(self, limit: f64) -> Lanes {
        self.map(|value| {
            if value > limit {
                limit
            } else if value < -limit {
                -limit
            } else {
                value
            }
        })
    }

    /// Where a comparison of the lanes holds; false where either is NaN.
    #[inline(always)]
    pub fn below(self, other: Lanes) -> Mask {
        let mut out = [false; LANES];
        for ((out, a), b) in out.iter_mut().zip(self.0).zip(other.0) {
            *out = a < b;
        }
        out
    }

    /// This number where `mask` holds, else `other`'s.
    #[inline(always)]
    pub fn or(self, mask: &Mask, other: Lanes) -> Lanes {
        let mut out = self.0;
        for ((out, other), mask) in out.iter_mut().zip(other.0).zip(mask) {
            *out = if *mask { *out } else { other };
        }
        Lanes(out)
    }
}
