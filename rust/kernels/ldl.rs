//! Factor of a sparse Hermitian matrix as L D L*, kept for many right-hand sides.
//!
//! Row by row along the elimination tree (Liu 1990, Davis 2005). Entries are real or complex (a `DVec2`, real part
//! first), right-hand sides are complex: a real matrix then solves for x and y at once.

use crate::fit::conjugate;
use glam::DVec2;

/// What a matrix may hold.
pub trait Entry: Copy + Send + Sync + std::ops::AddAssign + std::ops::SubAssign {
    /// Nothing.
    const ZERO: Self;
    /// The complex conjugate.
    fn conjugate(self) -> Self;
    /// The product with a real number.
    fn scale(self, factor: f64) -> Self;
    /// The product with an entry.
    fn product(self, other: Self) -> Self;
    /// The product with a complex number.
    fn times(self, z: DVec2) -> DVec2;
    /// The real part.
    fn real(self) -> f64;
}

impl Entry for f64 {
    const ZERO: Self = 0.0;
    fn conjugate(self) -> Self {
        self
    }
    fn scale(self, factor: f64) -> Self {
        self * factor
    }
    fn product(self, other: Self) -> Self {
        self * other
    }
    fn times(self, z: DVec2) -> DVec2 {
        z * self
    }
    fn real(self) -> f64 {
        self
    }
}

impl Entry for DVec2 {
    const ZERO: Self = DVec2::ZERO;
    fn conjugate(self) -> Self {
        conjugate(self)
    }
    fn scale(self, factor: f64) -> Self {
        self * factor
    }
    fn product(self, other: Self) -> Self {
        self.rotate(other)
    }
    fn times(self, z: DVec2) -> DVec2 {
        self.rotate(z)
    }
    fn real(self) -> f64 {
        self.x
    }
}

/// The upper half of a Hermitian matrix by columns: the rows of each column ascend, the diagonal is last.
#[derive(Debug)]
pub struct Upper<E> {
    starts: Vec<usize>,
    rows: Vec<u32>,
    values: Vec<E>,
}

impl<E: Entry> Upper<E> {
    /// Sums up entries (row, column, value); those below the diagonal are left out. Every diagonal gets an entry.
    pub fn new(size: usize, entries: impl Iterator<Item = (u32, u32, E)>) -> Self {
        let diagonal = (0..size as u32).map(|i| (i, i, E::ZERO));
        let mut all: Vec<(u32, u32, E)> = diagonal.chain(entries.filter(|(row, column, _)| row <= column)).collect();
        all.sort_by_key(|(row, column, _)| u64::from(*column) << 32 | u64::from(*row));
        let (mut starts, mut rows, mut values) = (vec![0; size + 1], Vec::new(), Vec::<E>::new());
        let mut last = None;
        for (row, column, value) in all {
            match values.last_mut() {
                Some(sum) if last == Some((row, column)) => *sum += value,
                _ => {
                    rows.push(row);
                    values.push(value);
                    starts[column as usize + 1] += 1;
                }
            }
            last = Some((row, column));
        }
        (0..size).for_each(|i| starts[i + 1] += starts[i]);
        Upper { starts, rows, values }
    }

    fn size(&self) -> usize {
        self.starts.len() - 1
    }

    fn column(&self, k: usize) -> impl Iterator<Item = (usize, E)> {
        let range = self.starts[k]..self.starts[k + 1];
        self.rows[range.clone()].iter().map(|row| *row as usize).zip(self.values[range].iter().copied())
    }
}

/// L (unit lower triangle, by columns) and one over D.
#[derive(Debug)]
pub struct Factor<E> {
    starts: Vec<usize>,
    rows: Vec<u32>,
    values: Vec<E>,
    inverse: Vec<f64>,
}

/// Marks the root of an elimination tree, and a vertex that was not met yet.
const NONE: usize = usize::MAX;

/// The elimination tree, and how many entries each column of L has.
fn tree<E: Entry>(matrix: &Upper<E>) -> (Vec<usize>, Vec<usize>) {
    let size = matrix.size();
    let (mut parent, mut counts, mut met) = (vec![NONE; size], vec![0; size], vec![NONE; size]);
    for k in 0..size {
        met[k] = k;
        for (mut i, _) in matrix.column(k) {
            while met[i] != k {
                if parent[i] == NONE {
                    parent[i] = k;
                }
                counts[i] += 1;
                met[i] = k;
                i = parent[i];
            }
        }
    }
    (parent, counts)
}

impl<E: Entry> Factor<E> {
    /// Factors a positive definite matrix; None where it is not.
    pub fn new(matrix: &Upper<E>) -> Option<Self> {
        let size = matrix.size();
        let (parent, counts) = tree(matrix);
        let mut starts = vec![0; size + 1];
        (0..size).for_each(|i| starts[i + 1] = starts[i] + counts[i]);
        let (mut rows, mut values) = (vec![0; starts[size]], vec![E::ZERO; starts[size]]);
        let (mut ends, mut inverse) = (starts.clone(), vec![0.0; size]);
        let (mut y, mut met, mut pattern) = (vec![E::ZERO; size], vec![NONE; size], Vec::new());
        for k in 0..size {
            pattern.clear();
            met[k] = k;
            let mut pivot = 0.0;
            for (mut i, value) in matrix.column(k) {
                if i == k {
                    pivot = value.real();
                    continue;
                }
                y[i] = value;
                while met[i] != k {
                    met[i] = k;
                    pattern.push(i);
                    i = parent[i];
                }
            }
            // Ascending order is one in which each row comes before those that depend on it.
            pattern.sort_unstable();
            let whole = pivot;
            for i in pattern.iter().copied() {
                let above = std::mem::replace(&mut y[i], E::ZERO);
                for p in starts[i]..ends[i] {
                    y[rows[p] as usize] -= values[p].product(above);
                }
                let entry = above.conjugate().scale(inverse[i]);
                pivot -= entry.product(above).real();
                rows[ends[i]] = k as u32;
                values[ends[i]] = entry;
                ends[i] += 1;
            }
            // Below this part of the diagonal the pivot is rounding.
            if pivot.is_nan() || pivot <= whole * 1e-14 {
                return None;
            }
            inverse[k] = 1.0 / pivot;
        }
        Some(Factor { starts, rows, values, inverse })
    }

    /// Solves in place.
    pub fn solve(&self, x: &mut [DVec2]) {
        let column = |j: usize| {
            let range = self.starts[j]..self.starts[j + 1];
            self.rows[range.clone()].iter().zip(&self.values[range])
        };
        for j in 0..self.inverse.len() {
            let known = x[j];
            column(j).for_each(|(row, value)| x[*row as usize] -= value.times(known));
        }
        x.iter_mut().zip(&self.inverse).for_each(|(x, inverse)| *x *= *inverse);
        for j in (0..self.inverse.len()).rev() {
            let sum = column(j).fold(x[j], |sum, (row, value)| sum - value.conjugate().times(x[*row as usize]));
            x[j] = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// B* B + 1 for a sparse complex B, as entries.
    fn matrix(size: usize) -> Vec<(u32, u32, DVec2)> {
        let mut entries: Vec<_> = (0..size as u32).map(|i| (i, i, DVec2::X)).collect();
        for k in 0..size {
            let row =
                [(k, DVec2::new(1.5, -0.3)), ((k * 7 + 1) % size, DVec2::new(0.2, 0.9)), ((k * k) % size, DVec2::Y)];
            for (i, a) in row {
                entries.extend(row.map(|(j, b)| (i as u32, j as u32, conjugate(a).rotate(b))));
            }
        }
        entries
    }

    #[test]
    fn the_solution_meets_the_equations() {
        for size in [1, 2, 5, 40] {
            let entries = matrix(size);
            let Some(factor) = Factor::new(&Upper::new(size, entries.iter().copied())) else { unreachable!() };
            let wanted: Vec<DVec2> = (0..size).map(|i| DVec2::new(i as f64 - 3.0, 1.0 / (i + 1) as f64)).collect();
            let mut x = wanted.clone();
            factor.solve(&mut x);
            let mut got = vec![DVec2::ZERO; size];
            entries.iter().for_each(|(row, column, value)| got[*row as usize] += value.rotate(x[*column as usize]));
            assert!(got.iter().zip(&wanted).all(|(a, b)| a.abs_diff_eq(*b, 1e-9)), "{size}");
        }
    }

    #[test]
    fn a_singular_or_indefinite_matrix_has_no_factor() {
        let singular = [(0, 0, 1.0), (0, 1, -1.0), (1, 1, 1.0)];
        assert!(Factor::new(&Upper::new(2, singular.into_iter())).is_none());
        assert!(Factor::new(&Upper::new(1, [(0, 0, -1.0)].into_iter())).is_none());
    }
}
