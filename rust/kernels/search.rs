//! Which piece of which clip, seen from where, a drawn sequence is like.
//!
//! Jain, Sheikh, Hodgins 2009, sections 3.2 and 3.3: the cost of a drawn and a projected pose is the weighted sum over limbs of
//! the internal angle between them (equation 4). The camera is orthographic and one of several; the clip is open at both
//! ends. Every drawn frame takes one clip frame, a bounded number of frames after the drawn frame before, so a path's cost is
//! a sum over drawn frames and does not depend on how fast the clip is gone through. A clip frame with a missing marker
//! (NaN) is never taken.

use crate::error::{KernelError, check_length};
use multiversion::multiversion;
use rayon::prelude::*;

/// Clips one after the other: a vector for each limb, axis and frame, frames lying together.
#[derive(Clone, Copy)]
pub struct Clips<'a> {
    /// K x 3 x T world coordinates of every limb, from its first to its second marker.
    pub vectors: &'a [f32],
    /// How many limbs.
    pub limbs: usize,
    /// First frame and frame after the last of every piece to search.
    pub ranges: &'a [[u64; 2]],
}

/// Drawn sequences: S labellings of F frames, gone through in R orders.
#[derive(Clone, Copy)]
pub struct Drawn<'a> {
    /// S x F x K angles in radians, y down.
    pub angles: &'a [f32],
    /// S x F x K weights of the limbs.
    pub weights: &'a [f32],
    /// How many frames.
    pub frames: usize,
    /// R x F indices of frames: the order in which they are gone through.
    pub orders: &'a [u32],
    /// R x F least and largest number of clip frames since the frame before; a row's first pair is not used.
    pub steps: &'a [[u32; 2]],
}

/// Rows of a view's rotation: the world directions of the picture's right and of its down.
pub type View = [[f32; 3]; 2];

/// The cheapest path into each stretch of clip frames: its cost and the clip frame where it ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The sum of costs along the path, infinite where there is none.
    pub cost: f32,
    /// The clip frame of the last drawn frame.
    pub end: u32,
}

impl Found {
    /// No path at all.
    pub const NOTHING: Found = Found { cost: f32::INFINITY, end: 0 };
}

/// The number of stretches of `block` end frames that the ranges are divided into.
pub fn count_blocks(ranges: &[[u64; 2]], block: usize) -> usize {
    ranges.iter().map(|[start, stop]| (stop.saturating_sub(*start) as usize).div_ceil(block.max(1))).sum()
}

impl Drawn<'_> {
    fn check(&self, limbs: usize) -> Result<(), KernelError> {
        let row = self.frames * limbs;
        if row == 0 || self.angles.is_empty() || self.orders.is_empty() {
            return Err(KernelError::Argument { argument: "angles", problem: "want a frame, a limb and an order" });
        }
        check_length("angles", self.angles.len() / row * row, self.angles.len())?;
        check_length("weights", self.angles.len(), self.weights.len())?;
        check_length("orders", self.orders.len() / self.frames * self.frames, self.orders.len())?;
        check_length("steps", self.orders.len(), self.steps.len())?;
        let wrong = |problem, index| Err(KernelError::Item { argument: "orders", problem, index });
        if let Some(index) = self.orders.iter().position(|frame| *frame as usize >= self.frames) {
            return wrong("a frame that is not drawn", index);
        }
        match self.steps.iter().position(|[low, high]| low > high) {
            Some(index) => Err(KernelError::Item { argument: "steps", problem: "least above largest", index }),
            None => Ok(()),
        }
    }

    /// Labellings times orders: the paths looked for in each view.
    pub fn count_paths(&self, limbs: usize) -> usize {
        self.angles.len() / (self.frames * limbs).max(1) * (self.orders.len() / self.frames.max(1))
    }
}

/// Writes, for every stretch of `block` end frames, view, labelling and order, the cheapest path that ends there.
///
/// `found` is B x V x S x R. Pieces and views are worked in parallel, each by itself.
pub fn search_clips(
    clips: Clips<'_>,
    drawn: Drawn<'_>,
    views: &[View],
    block: usize,
    found: &mut [Found],
) -> Result<(), KernelError> {
    drawn.check(clips.limbs)?;
    let frames = clips.vectors.len() / (3 * clips.limbs).max(1);
    check_length("vectors", 3 * clips.limbs * frames, clips.vectors.len())?;
    if let Some(index) = clips.ranges.iter().position(|[start, stop]| start > stop || *stop > frames as u64) {
        return Err(KernelError::Item { argument: "ranges", problem: "not within the clips", index });
    }
    if block == 0 {
        return Err(KernelError::Argument { argument: "block", problem: "want 1 or more" });
    }
    let paths = drawn.count_paths(clips.limbs);
    check_length("found", count_blocks(clips.ranges, block) * views.len() * paths, found.len())?;
    let (mut rest, mut pieces) = (found, Vec::with_capacity(clips.ranges.len()));
    for range in clips.ranges {
        let (piece, after) = rest.split_at_mut(count_blocks(&[*range], block) * views.len() * paths);
        pieces.push((*range, piece));
        rest = after;
    }
    pieces.into_par_iter().for_each(|([start, stop], piece)| {
        let span = Span { clips, frames, start: start as usize, length: (stop - start) as usize };
        let columns: Vec<Vec<Found>> = views.par_iter().map(|view| search_view(span, drawn, view, block)).collect();
        for (index, column) in columns.iter().enumerate() {
            for (row, best) in column.chunks(paths).enumerate() {
                piece[(row * views.len() + index) * paths..][..paths].copy_from_slice(best);
            }
        }
    });
    Ok(())
}

/// One piece of the clips.
#[derive(Clone, Copy)]
struct Span<'a> {
    clips: Clips<'a>,
    frames: usize,
    start: usize,
    length: usize,
}

/// The angle from x towards y in turns, -1/2 to 1/2; NaN for NaN, 0 for nothing.
///
/// The odd polynomial is within 6e-4 degrees of the arc tangent.
#[inline(always)]
fn turns(x: f32, y: f32) -> f32 {
    let (across, along) = (x.abs(), y.abs());
    let steep = along > across;
    let (low, high) = if steep { (across, along) } else { (along, across) };
    let ratio = low / if high == 0.0 { 1.0 } else { high };
    let s = ratio * ratio;
    let series = TURNS[2] + s * (TURNS[3] + s * (TURNS[4] + s * TURNS[5]));
    let eighth = ratio * (TURNS[0] + s * (TURNS[1] + s * series));
    let quarter = if steep { 0.25 - eighth } else { eighth };
    let half = if x < 0.0 { 0.5 - quarter } else { quarter };
    if y < 0.0 { -half } else { half }
}

/// Coefficients of the odd powers in atan(x) / (2 pi) on 0..1.
const TURNS: [f32; 6] = [0.15915132, -0.052938566, 0.030802907, -0.01852985, 0.008379086, -0.001865158];

/// Writes the angles of one limb over a piece, in turns.
#[inline(always)]
fn limb_turns(span: Span<'_>, limb: usize, view: &View, out: &mut [f32]) {
    let axis = |axis: usize| &span.clips.vectors[(3 * limb + axis) * span.frames + span.start..][..span.length];
    let ([rx, ry, rz], [dx, dy, dz]) = (view[0], view[1]);
    for (((out, x), y), z) in out.iter_mut().zip(axis(0)).zip(axis(1)).zip(axis(2)) {
        *out = turns(rx * x + ry * y + rz * z, dx * x + dy * y + dz * z);
    }
}

/// Adds a limb's internal angle to a drawn one, in turns, times `weight`.
#[inline(always)]
fn add_difference(angles: &[f32], drawn: f32, weight: f32, cost: &mut [f32]) {
    for (cost, angle) in cost.iter_mut().zip(angles) {
        let around = (angle - drawn).abs();
        let back = 1.0 - around;
        *cost += weight * if around > back { back } else { around };
    }
}

/// Makes the row of path costs after `before`: the frame's own cost, and the cheapest of the frames it may follow.
#[inline(always)]
fn next_row(before: &[f32], cost: &[f32], [low, high]: [u32; 2], row: &mut [f32]) {
    row.fill(f32::INFINITY);
    for step in low as usize..=(high as usize).min(row.len().saturating_sub(1)) {
        for (best, before) in row[step..].iter_mut().zip(before) {
            // Not `min`: NaN is never the cheaper.
            *best = if *before < *best { *before } else { *best };
        }
    }
    row.iter_mut().zip(cost).for_each(|(best, cost)| *best += cost);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn search_view(span: Span<'_>, drawn: Drawn<'_>, view: &View, block: usize) -> Vec<Found> {
    let (limbs, length, frames) = (span.clips.limbs, span.length, drawn.frames);
    let mut angles = vec![0.0; limbs * length];
    for limb in 0..limbs {
        limb_turns(span, limb, view, &mut angles[limb * length..][..length]);
    }
    let paths = drawn.count_paths(limbs);
    let mut found = vec![Found::NOTHING; length.div_ceil(block) * paths];
    let mut costs = vec![0.0; frames * length];
    let (mut row, mut after) = (vec![0.0; length], vec![0.0; length]);
    let mut path = 0;
    for (labelling, weights) in drawn.angles.chunks(frames * limbs).zip(drawn.weights.chunks(frames * limbs)) {
        costs.fill(0.0);
        for frame in 0..frames {
            let cost = &mut costs[frame * length..][..length];
            for limb in 0..limbs {
                let (angle, weight) = (labelling[frame * limbs + limb], weights[frame * limbs + limb]);
                let whole = angle * std::f32::consts::FRAC_1_PI * 0.5;
                let drawn = whole - whole.round();
                add_difference(&angles[limb * length..][..length], drawn, weight, cost);
            }
        }
        for (order, steps) in drawn.orders.chunks(frames).zip(drawn.steps.chunks(frames)) {
            row.copy_from_slice(&costs[order[0] as usize * length..][..length]);
            for (frame, step) in order.iter().zip(steps).skip(1) {
                next_row(&row, &costs[*frame as usize * length..][..length], *step, &mut after);
                std::mem::swap(&mut row, &mut after);
            }
            keep_best(&row, span.start, block, &mut found[path..], paths);
            path += 1;
        }
    }
    found
}

/// Writes the cheapest end of each stretch of `block` frames, `stride` apart, in radians.
fn keep_best(row: &[f32], start: usize, block: usize, found: &mut [Found], stride: usize) {
    for (index, stretch) in row.chunks(block).enumerate() {
        let best = &mut found[index * stride];
        for (offset, cost) in stretch.iter().enumerate() {
            let cost = cost * std::f32::consts::TAU;
            if cost < best.cost {
                *best = Found { cost, end: (start + index * block + offset) as u32 };
            }
        }
    }
}

/// Goes on with the cheapest ways through a table of costs, drawn frames by clip frames, by its next rows `costs`.
///
/// `sums` are those of the ways to each clip frame so far, before the first row zeros, and become those through these
/// rows; `taken` gets each cell's step from the row before. Steps are as in [`Drawn`], the first frame's none, and at
/// most 65535; ties go to the smaller one.
pub fn segment_rows(costs: &[f64], steps: &[[u32; 2]], sums: &mut [f64], taken: &mut [u16]) -> Result<(), KernelError> {
    let length = sums.len();
    check_length("costs", steps.len() * length, costs.len())?;
    check_length("taken", costs.len(), taken.len())?;
    let mut before = vec![0.0; length];
    for ((row, taken), steps) in costs.chunks(length.max(1)).zip(taken.chunks_mut(length.max(1))).zip(steps) {
        before.copy_from_slice(sums);
        for (column, (cost, taken)) in row.iter().zip(taken).enumerate() {
            let (sum, step) = cheapest(&before, column, *steps);
            (sums[column], *taken) = (cost + sum, step as u16);
        }
    }
    Ok(())
}

/// The cheapest of the places a path may come from, and how far back it lies.
fn cheapest(before: &[f64], column: usize, [low, high]: [u32; 2]) -> (f64, u32) {
    let mut best = (f64::INFINITY, 0);
    for step in low..=high.min(column as u32).min(u16::MAX.into()) {
        if let Some(sum) = column.checked_sub(step as usize).and_then(|from| before.get(from))
            && *sum < best.0
        {
            best = (*sum, step);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const FRONT: View = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    const SIDE: View = [[0.0, 0.0, -1.0], [0.0, -1.0, 0.0]];

    /// A limb that turns: frame f lies at `angles[f]` in the picture seen from the front.
    fn turning(angles: &[f32]) -> Vec<f32> {
        let axis = |of: fn(f32) -> f32| angles.iter().map(move |a| of(*a)).collect::<Vec<f32>>();
        [axis(f32::cos), axis(|a| -a.sin()), axis(|_| 0.0)].concat()
    }

    fn best(clip: &[f32], drawn: &[f32], steps: [u32; 2], view: View) -> Found {
        let vectors = turning(clip);
        let clips = Clips { vectors: &vectors, limbs: 1, ranges: &[[0, clip.len() as u64]] };
        let order: Vec<u32> = (0..drawn.len() as u32).collect();
        let (weights, steps) = (vec![1.0; drawn.len()], vec![steps; drawn.len()]);
        let sequence = Drawn { angles: drawn, weights: &weights, frames: drawn.len(), orders: &order, steps: &steps };
        let mut found = [Found::NOTHING];
        assert_eq!(search_clips(clips, sequence, &[view], clip.len(), &mut found), Ok(()));
        found[0]
    }

    #[test]
    fn turns_are_within_a_thousandth_of_a_degree_of_the_arc_tangent() {
        for step in 0..20_000 {
            let angle = TAU * (f64::from(step) / 20_000.0 - 0.5);
            let (y, x) = (angle.sin() as f32 * 3.0, angle.cos() as f32 * 3.0);
            let exact = f64::from(y).atan2(f64::from(x)) / TAU;
            let apart = (f64::from(turns(x, y)) - exact).abs();
            assert!(apart.min(1.0 - apart) * 360.0 < 1e-3, "{angle}");
        }
        assert!((turns(0.0, 0.0), turns(0.0, -2.0)) == (0.0, -0.25) && turns(f32::NAN, f32::NAN).is_nan());
    }

    #[test]
    fn a_piece_is_found_where_it_is_and_costs_nothing() {
        let clip: Vec<f32> = (0..40).map(|f| (f as f32 * 0.7).sin() * 1.4).collect();
        let found = best(&clip, &clip[13..29], [1, 1], FRONT);
        assert_eq!(found.end, 28);
        assert!(found.cost < 1e-3, "{}", found.cost);
        assert!(best(&clip, &clip[13..29], [1, 1], SIDE).cost > 1.0);
    }

    #[test]
    fn steps_bound_the_speed_and_a_clip_too_short_has_no_path() {
        let clip: Vec<f32> = (0..20).map(|f| f as f32 * 0.1).collect();
        let twice: Vec<f32> = (0..10).map(|f| f as f32 * 0.2).collect();
        assert!(best(&clip, &twice, [2, 3], FRONT).cost < 1e-3);
        assert!(best(&clip, &twice, [1, 1], FRONT).cost > 0.5);
        assert_eq!(best(&clip, &twice, [3, 3], FRONT), Found::NOTHING);
    }

    #[test]
    fn a_missing_frame_is_never_taken() {
        let mut clip: Vec<f32> = (0..9).map(|f| f as f32 * 0.2).collect();
        clip[4] = f32::NAN;
        let drawn = [clip[3], 0.8, clip[5]];
        let around = best(&clip, &drawn, [1, 2], FRONT);
        assert!(around.cost > 0.1 && around.cost < 0.5, "{around:?}");
        let after = best(&clip[5..], &drawn, [1, 1], FRONT).cost;
        assert!((best(&clip, &drawn, [1, 1], FRONT).cost - after).abs() < 1e-5);
        assert_eq!(best(&[f32::NAN; 4], &drawn, [1, 1], FRONT), Found::NOTHING);
    }

    #[test]
    fn every_stretch_of_ends_has_its_best_and_orders_are_rotations() {
        let clip: Vec<f32> = (0..30).map(|f| f as f32 * std::f32::consts::TAU / 10.0).collect();
        let vectors = turning(&clip);
        let clips = Clips { vectors: &vectors, limbs: 1, ranges: &[[0, 12], [12, 30]] };
        let drawn: Vec<f32> = clip[4..12].iter().map(|a| a % std::f32::consts::TAU).collect();
        let orders: Vec<u32> = (0..8).chain((0..8).map(|f| (f + 3) % 8)).collect();
        let sequence = Drawn { angles: &drawn, weights: &[1.0; 8], frames: 8, orders: &orders, steps: &[[1, 1]; 16] };
        let mut found = [Found::NOTHING; 2 * (2 + 3)];
        assert_eq!(count_blocks(clips.ranges, 6), 5);
        assert_eq!(search_clips(clips, sequence, &[FRONT], 6, &mut found), Ok(()));
        let ends: Vec<u32> = found.iter().step_by(2).map(|best| best.end).collect();
        assert_eq!(ends[1..], [11, 0, 21, 29]);
        assert!(found[2].cost < 1e-3 && found[6].cost < 1e-3);
        assert!(found[0] == Found::NOTHING && found[4] == Found::NOTHING);
        assert!(found.iter().skip(1).step_by(2).all(|best| best.cost > 0.5));
    }

    #[test]
    fn wrong_tables_are_refused_by_name() {
        let clips = Clips { vectors: &[0.0; 6], limbs: 1, ranges: &[[0, 3]] };
        let drawn = Drawn { angles: &[0.0], weights: &[1.0], frames: 1, orders: &[0], steps: &[[1, 1]] };
        let mut found = [Found::NOTHING];
        let refused =
            |clips, drawn, block, found: &mut [Found]| match search_clips(clips, drawn, &[FRONT], block, found) {
                Err(KernelError::Item { argument, .. } | KernelError::Argument { argument, .. }) => argument,
                Err(KernelError::Length { argument, .. }) => argument,
                _ => "nothing",
            };
        assert_eq!(refused(clips, drawn, 9, &mut found), "ranges");
        let whole = Clips { ranges: &[[0, 2]], ..clips };
        assert_eq!(refused(whole, drawn, 0, &mut found), "block");
        assert_eq!(refused(whole, drawn, 1, &mut found), "found");
        assert_eq!(refused(whole, Drawn { orders: &[1], ..drawn }, 9, &mut found), "orders");
        assert_eq!(refused(whole, Drawn { steps: &[[2, 1]], ..drawn }, 9, &mut found), "steps");
        assert_eq!(refused(whole, Drawn { weights: &[], ..drawn }, 9, &mut found), "weights");
        assert_eq!(refused(whole, Drawn { angles: &[], frames: 0, ..drawn }, 9, &mut found), "angles");
    }

    #[test]
    fn ways_are_the_cheapest_of_all_and_go_on_where_rows_ended() {
        let costs = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0, 5.0, 3.0, 5.0, 8.0];
        let steps = [[0, 0], [1, 2], [0, 1]];
        let (mut sums, mut taken) = ([0.0; 4], [9; 12]);
        assert_eq!(segment_rows(&costs[..8], &steps[..2], &mut sums, &mut taken[..8]), Ok(()));
        assert_eq!(segment_rows(&costs[8..], &steps[2..], &mut sums, &mut taken[8..]), Ok(()));
        assert_eq!(sums, [f64::INFINITY, 3.0 + 9.0 + 3.0, 1.0 + 2.0 + 5.0, 1.0 + 2.0 + 8.0]);
        assert_eq!((taken[10], taken[6], taken[7], taken[11]), (0, 1, 2, 1));
        assert!(segment_rows(&costs, &steps[1..], &mut sums, &mut taken).is_err());
    }
}
