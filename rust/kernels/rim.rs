//! Depth for the rim of a render: samples that a renderer covers in part, without a depth of their own.
//!
//! For the depth test of Jain, Sheikh, Mahler, Hodgins 2010, section 3.3. Renderers filter colours over an area but
//! take depth at a sample's centre; where the centre misses the object, its soft edge has coverage and no depth. Such a
//! sample takes the nearest depth beside it. Assumes a filter that reaches less than two samples.

use crate::composite::Rendered;
use crate::error::{KernelError, check_length};
use multiversion::multiversion;
use rayon::prelude::*;

/// How far from a sample its depth may come from.
const REACH: usize = 2;

/// Samples that share a flag.
const BLOCK: usize = 64;

/// Flag of a block that holds a depth.
const DEPTH: u8 = 1;

/// Flag of a block that holds a sample without depth.
const NOTHING: u8 = 2;

/// The depth that a sample of the rim takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rim {
    /// The sample's place in the map.
    pub index: usize,
    /// Its depth.
    pub depth: f32,
}

/// Finds the rim, row by row: samples covered in part, at +inf, with a depth among the 8 around, else two samples away.
///
/// What is covered wholly without depth is a backdrop: were it taken for an edge, it would frame what stands before it.
pub fn rim(pixels: Rendered, depth: &[f32], width: usize) -> Result<Vec<Rim>, KernelError> {
    let values = match pixels {
        Rendered::Bytes(pixels) => pixels.len(),
        Rendered::Floats(pixels) => pixels.len(),
    };
    check_length("rendered", depth.len() * 4, values)?;
    if depth.is_empty() {
        return Ok(Vec::new());
    }
    if !depth.len().is_multiple_of(width) {
        return Err(KernelError::Argument { argument: "rendered_depth", problem: "want whole rows" });
    }
    let map = Map::new(depth, width);
    Ok(match pixels {
        Rendered::Bytes(pixels) => map.rim(|index| (1..255).contains(&pixels[index * 4 + 3])),
        Rendered::Floats(pixels) => map.rim(|index| pixels[index * 4 + 3] > 0.0 && pixels[index * 4 + 3] < 1.0),
    })
}

/// Writes the map with the rim's depths.
pub fn fill(depth: &[f32], rim: &[Rim], out: &mut [f32]) -> Result<(), KernelError> {
    check_length("out", depth.len(), out.len())?;
    out.par_chunks_mut(RUN).zip(depth.par_chunks(RUN)).for_each(|(out, depth)| out.copy_from_slice(depth));
    for sample in rim {
        out[sample.index] = sample.depth;
    }
    Ok(())
}

/// Values copied by one task.
const RUN: usize = 1 << 16;

/// A depth map with a flag for every row of every block, so that it is read once where nothing is to be done.
struct Map<'a> {
    depth: &'a [f32],
    width: usize,
    /// Blocks in a row.
    blocks: usize,
    flags: Vec<u8>,
}

impl<'a> Map<'a> {
    fn new(depth: &'a [f32], width: usize) -> Self {
        let blocks = width.div_ceil(BLOCK);
        let mut flags = vec![0; depth.len() / width * blocks];
        let rows = flags.par_chunks_mut(blocks).zip(depth.par_chunks(width));
        rows.for_each(|(flags, depth)| flag_row(depth, flags));
        Map { depth, width, blocks, flags }
    }

    fn rim(&self, covered: impl Fn(usize) -> bool + Sync) -> Vec<Rim> {
        let rows = (0..self.depth.len() / self.width).into_par_iter();
        rows.flat_map_iter(|row| self.rim_of_row(row, &covered)).collect()
    }

    fn rim_of_row(&self, row: usize, covered: impl Fn(usize) -> bool) -> Vec<Rim> {
        let mut found = Vec::new();
        let rows = (row + REACH + 1).min(self.flags.len() / self.blocks);
        let around = &self.flags[row.saturating_sub(REACH) * self.blocks..rows * self.blocks];
        if around.iter().fold(0, |all, flag| all | flag) & DEPTH == 0 {
            return found;
        }
        for (block, flag) in self.flags[row * self.blocks..][..self.blocks].iter().enumerate() {
            let blocks = block.saturating_sub(1)..(block + 2).min(self.blocks);
            let near =
                || around.chunks(self.blocks).any(|row| row[blocks.clone()].iter().any(|flag| flag & DEPTH != 0));
            if flag & NOTHING != 0 && near() {
                let mut candidates = candidates(self.depth, self.width, row, block * BLOCK);
                while candidates != 0 {
                    let column = block * BLOCK + candidates.trailing_zeros() as usize;
                    found.extend(self.rim_at(row, column, &covered));
                    candidates &= candidates - 1;
                }
            }
        }
        found
    }

    fn rim_at(&self, row: usize, column: usize, covered: impl Fn(usize) -> bool) -> Option<Rim> {
        let index = row * self.width + column;
        if !covered(index) {
            return None;
        }
        (1..=REACH).find_map(|reach| self.nearest(row, column, reach)).map(|depth| Rim { index, depth })
    }

    /// The smallest depth of the square that reaches so far around a sample.
    fn nearest(&self, row: usize, column: usize, reach: usize) -> Option<f32> {
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(self.depth.len() / self.width);
        let columns = column.saturating_sub(reach)..(column + reach + 1).min(self.width);
        let values = rows.flat_map(|row| &self.depth[row * self.width..][columns.clone()]);
        values.copied().filter(|z| z.is_finite()).reduce(f32::min)
    }
}

/// The samples of a block without depth, as bits, that have a depth in the columns and rows about them.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn candidates(depth: &[f32], width: usize, row: usize, first: usize) -> u64 {
    let mut some = [0u32; BLOCK + 2 * REACH];
    let left = first.saturating_sub(REACH);
    let columns = left..(first + BLOCK + REACH).min(width);
    for row in depth.chunks(width).skip(row.saturating_sub(REACH)).take(row.min(REACH) + 1 + REACH) {
        let some = &mut some[left + REACH - first..];
        some.iter_mut().zip(&row[columns.clone()]).for_each(|(some, z)| *some |= u32::from(z.is_finite()));
    }
    let mut nothing = [0u32; BLOCK];
    let own = &depth[row * width..][first..(first + BLOCK).min(width)];
    nothing.iter_mut().zip(own).for_each(|(nothing, z)| *nothing = u32::from(*z == f32::INFINITY));
    let mut near = [0u32; BLOCK];
    for shift in 0..=2 * REACH {
        near.iter_mut().zip(&some[shift..]).for_each(|(near, some)| *near |= some);
    }
    near.iter_mut().zip(&nothing).for_each(|(near, nothing)| *near &= nothing);
    if near.iter().fold(0, |all, near| all | near) == 0 {
        return 0;
    }
    near.iter().enumerate().fold(0, |bits, (i, near)| bits | u64::from(*near) << i)
}

/// Flags the blocks of one row.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn flag_row(depth: &[f32], flags: &mut [u8]) {
    for (flag, depth) in flags.iter_mut().zip(depth.chunks(BLOCK)) {
        let (some, none) = if let Some(whole) = depth.first_chunk() { held(whole) } else { held_by(depth) };
        *flag = if some { DEPTH } else { 0 } | if none { NOTHING } else { 0 };
    }
}

/// Whether a whole block holds depths, and samples without.
#[inline(always)]
fn held(depth: &[f32; BLOCK]) -> (bool, bool) {
    held_by(depth)
}

#[inline(always)]
fn held_by(depth: &[f32]) -> (bool, bool) {
    let kinds = depth.iter().map(|z| (u32::from(z.is_finite()), u32::from(*z == f32::INFINITY)));
    let (some, none) = kinds.fold((0, 0), |all, kind| (all.0 | kind.0, all.1 | kind.1));
    (some != 0, none != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f32 = f32::INFINITY;

    fn filled(alpha: &[f32], depth: &[f32], width: usize) -> Vec<f32> {
        let pixels: Vec<f32> = alpha.iter().flat_map(|a| [0.0, 0.0, 0.0, *a]).collect();
        let mut out = vec![9.0; depth.len()];
        let found = rim(Rendered::Floats(&pixels), depth, width);
        assert_eq!(fill(depth, &found.unwrap_or_default(), &mut out), Ok(()));
        out
    }

    #[test]
    fn reaches_two_samples_from_given_depths_only() {
        let got = filled(&[0.5; 7], &[2.0, NONE, NONE, NONE, NONE, NONE, 3.0], 7);
        assert_eq!(got, [2.0, 2.0, 2.0, NONE, 3.0, 3.0, 3.0]);
        assert_eq!(filled(&[0.5; 4], &[2.0, NONE, NONE, NONE], 1), [2.0, 2.0, 2.0, NONE]);
        assert_eq!(filled(&[0.5; 4], &[2.0, NONE, NONE, 3.0], 2), [2.0, 2.0, 2.0, 3.0]);
    }

    #[test]
    fn what_is_covered_wholly_without_depth_is_a_backdrop() {
        assert_eq!(filled(&[1.0, 1.0, 0.99], &[2.0, NONE, NONE], 3), [2.0, NONE, 2.0]);
    }

    #[test]
    fn the_nearer_ring_comes_first_then_the_smaller_depth() {
        assert_eq!(filled(&[0.5; 4], &[1.0, NONE, NONE, 2.0], 4), [1.0, 1.0, 2.0, 2.0]);
        assert_eq!(filled(&[0.5; 3], &[-1.0, NONE, -2.0], 3), [-1.0, -2.0, -2.0]);
    }

    #[test]
    fn a_depth_across_the_border_of_two_blocks_is_found() {
        for (from, to) in [(BLOCK - 1, BLOCK + 1), (BLOCK, BLOCK - 2)] {
            let (mut alpha, mut depth) = (vec![0.0; 2 * BLOCK], vec![NONE; 2 * BLOCK]);
            (depth[from], alpha[to]) = (5.0, 0.1);
            let got = filled(&alpha, &depth, 2 * BLOCK);
            assert_eq!(got.iter().filter(|z| **z == 5.0).count(), 2);
            assert_eq!(got[to], 5.0);
        }
    }

    #[test]
    fn mistakes_are_neither_filled_nor_taken() {
        let got = filled(&[1.0, f32::NAN, 1.0, -1.0], &[f32::NEG_INFINITY, NONE, f32::NAN, NONE], 4);
        assert!(got[0] == f32::NEG_INFINITY && got[1] == NONE && got[2].is_nan() && got[3] == NONE);
    }

    #[test]
    fn wrong_sizes_are_refused() {
        let got = rim(Rendered::Bytes(&[0; 8]), &[1.0; 3], 3);
        assert_eq!(got, Err(KernelError::Length { argument: "rendered", wanted: 12, got: 8 }));
        let got = rim(Rendered::Bytes(&[0; 12]), &[1.0; 3], 2);
        assert_eq!(got, Err(KernelError::Argument { argument: "rendered_depth", problem: "want whole rows" }));
        assert_eq!(rim(Rendered::Bytes(&[]), &[], 0), Ok(Vec::new()));
    }
}
