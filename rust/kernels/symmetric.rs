//! Symmetric 3 x 3 matrices, by their six numbers: what the stiffness of a link and all that comes of it is.

use glam::DVec3;
use std::ops::{AddAssign, Mul};

/// The diagonal (xx, yy, zz) and what is beside it (xy, xz, yz).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Symmetric {
    diagonal: DVec3,
    beside: DVec3,
}

impl Symmetric {
    /// All zero.
    pub const ZERO: Self = Symmetric { diagonal: DVec3::ZERO, beside: DVec3::ZERO };

    /// A number times the identity.
    #[inline(always)]
    pub fn scaled_identity(scale: f64) -> Self {
        Symmetric { diagonal: DVec3::splat(scale), beside: DVec3::ZERO }
    }

    /// `lengthwise` times a a^T plus `sideways` times the identity.
    #[inline(always)]
    pub fn stiffness(along: DVec3, lengthwise: f64, sideways: f64) -> Self {
        let scaled = lengthwise * along;
        let beside = DVec3::new(scaled.x * along.y, scaled.x * along.z, scaled.y * along.z);
        Symmetric { diagonal: scaled * along + sideways, beside }
    }

    /// The inverse, by cofactors.
    #[inline(always)]
    pub fn inverse(self) -> Self {
        let (DVec3 { x: a, y: b, z: c }, DVec3 { x: d, y: e, z: f }) = (self.diagonal, self.beside);
        let (diagonal, beside) = (
            DVec3::new(b * c - f * f, a * c - e * e, a * b - d * d),
            DVec3::new(e * f - d * c, d * f - e * b, d * e - a * f),
        );
        let scale = 1.0 / (a * diagonal.x + d * beside.x + e * beside.y);
        Symmetric { diagonal: scale * diagonal, beside: scale * beside }
    }

    /// Takes `other` * self * `other` away from `from`, which stays symmetric.
    #[inline(always)]
    pub fn take_between(self, other: Symmetric, from: &mut Symmetric) {
        let [x, y, z] = other.rows();
        let [p, q, r] = [self * x, self * y, self * z];
        from.diagonal -= DVec3::new(x.dot(p), y.dot(q), z.dot(r));
        from.beside -= DVec3::new(x.dot(q), x.dot(r), y.dot(r));
    }

    #[inline(always)]
    fn rows(self) -> [DVec3; 3] {
        let (DVec3 { x: a, y: b, z: c }, DVec3 { x: d, y: e, z: f }) = (self.diagonal, self.beside);
        [DVec3::new(a, d, e), DVec3::new(d, b, f), DVec3::new(e, f, c)]
    }
}

impl AddAssign for Symmetric {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.diagonal += other.diagonal;
        self.beside += other.beside;
    }
}

impl Mul<DVec3> for Symmetric {
    type Output = DVec3;

    #[inline(always)]
    fn mul(self, vector: DVec3) -> DVec3 {
        let [x, y, z] = self.rows();
        DVec3::new(x.dot(vector), y.dot(vector), z.dot(vector))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn whole(matrix: Symmetric) -> DMat3 {
        DMat3::from_cols_array_2d(&matrix.rows().map(|row| row.to_array()))
    }

    #[test]
    fn it_does_what_whole_matrices_do() {
        let (a, b) = (DVec3::new(0.3, -1.2, 0.7), DVec3::new(-0.5, 0.4, 2.0));
        let mut one = Symmetric::stiffness(a, 3.0, 0.5);
        let outer = DMat3::from_cols(a * a.x, a * a.y, a * a.z);
        assert!(whole(one).abs_diff_eq(3.0 * outer + 0.5 * DMat3::IDENTITY, 1e-12));
        one += Symmetric::scaled_identity(2.0);
        let two = Symmetric::stiffness(b, 1.5, 0.25);
        assert!((whole(one) * whole(one.inverse())).abs_diff_eq(DMat3::IDENTITY, 1e-12));
        assert!((one * b).abs_diff_eq(whole(one) * b, 1e-12));
        let mut left = one;
        two.inverse().take_between(two, &mut left);
        let (whole_two, inverse) = (whole(two), whole(two).inverse());
        assert!(whole(left).abs_diff_eq(whole(one) - whole_two * inverse * whole_two, 1e-12));
    }
}
