//! The table of the time warp: which frames of a clip go with which drawn frames.
//!
//! Jain, Sheikh, Hodgins 2009, section 3.3: dynamic time warping with steps (1, 1), (1, 0), (0, 1) of weight 1, ties to
//! the diagonal. Rows are drawn frames, columns the clip's. With a slope limit, the local constraint of Sakoe and Chiba
//! 1978 (their P = 1 / (limit - 1)): between two diagonal steps at most limit - 1 others, all of one kind. Assumes
//! finite costs; memory is one byte a cell and a few rows of totals.

use crate::error::{KernelError, check_length};
use multiversion::multiversion;

/// The step that reaches a cell from the row above and the column before; in the first row: the path begins here.
pub const DIAGONAL: u8 = 0;
/// The step to the next drawn frame while the clip stays.
pub const DRAWN: u8 = 1;
/// The step to the next clip frame while the drawing stays.
pub const CLIP: u8 = 2;

/// Which paths are allowed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rules {
    /// The path may begin at any column of the first row.
    pub open_begin: bool,
    /// The path may end at any column of the last row.
    pub open_end: bool,
    /// The most partners that a frame may have on either side, at most `STEEPEST`; None for any number.
    pub slope_limit: Option<usize>,
}

/// The highest slope limit: a cell's step is one byte.
pub const STEEPEST: usize = 128;

/// Returns the lowest sum of costs along an allowed path, and the path's cells (row, column) from begin to end.
///
/// `cost` is row-major with `columns` columns. Among columns that end equally well the first is taken.
pub fn time_warp(cost: &[f64], columns: usize, rules: Rules) -> Result<(f64, Vec<[i64; 2]>), KernelError> {
    if cost.is_empty() || columns == 0 {
        return Err(KernelError::Argument { argument: "cost", problem: "want at least one row and one column" });
    }
    check_length("cost", cost.len() / columns * columns, cost.len())?;
    let mut steps = vec![DIAGONAL; cost.len()];
    let totals = match rules.slope_limit {
        None => fill_free(cost, columns, rules.open_begin, &mut steps)?,
        Some(limit) if (1..=STEEPEST).contains(&limit) => {
            fill_limited(cost, columns, limit, rules.open_begin, &mut steps)?
        }
        Some(_) => return Err(KernelError::Argument { argument: "slope_limit", problem: "want 1 to 128" }),
    };
    let last = columns - 1;
    let better = |best: usize, j: usize| if totals[j] < totals[best] { j } else { best };
    let end = if rules.open_end { (0..columns).reduce(better).unwrap_or(last) } else { last };
    if totals[end] == f64::INFINITY {
        let problem = "no path meets the slope limit, or the costs add up to infinity";
        return Err(KernelError::Argument { argument: "cost", problem });
    }
    let path = match rules.slope_limit {
        None => trace_free(&steps, columns, end),
        Some(limit) => trace_limited(&steps, columns, end, limit),
    };
    Ok((totals[end], path))
}

fn check_row(row: usize, costs: &[f64]) -> Result<(), KernelError> {
    match costs.iter().position(|cost| !cost.is_finite()) {
        None => Ok(()),
        Some(column) => {
            Err(KernelError::Pixel { argument: "cost", problem: "want finite numbers, got NaN or inf", row, column })
        }
    }
}

fn fill_free(cost: &[f64], columns: usize, open_begin: bool, steps: &mut [u8]) -> Result<Vec<f64>, KernelError> {
    let (mut above, mut totals) = (vec![0.0; columns], vec![0.0; columns]);
    for (row, (costs, steps)) in cost.chunks(columns).zip(steps.chunks_mut(columns)).enumerate() {
        check_row(row, costs)?;
        std::mem::swap(&mut above, &mut totals);
        if row == 0 {
            first_row(costs, open_begin, &mut totals, steps);
        } else {
            next_row(costs, &above, &mut totals, steps);
        }
    }
    Ok(totals)
}

/// Writes the totals and steps of the first drawn frame. All slices have one value a column.
pub fn first_row(costs: &[f64], open_begin: bool, totals: &mut [f64], steps: &mut [u8]) {
    let mut left = f64::INFINITY;
    for (column, ((cost, total), step)) in costs.iter().zip(totals).zip(steps).enumerate() {
        let begin = if open_begin || column == 0 { 0.0 } else { f64::INFINITY };
        *step = if left < begin { CLIP } else { DIAGONAL };
        left = cost + begin.min(left);
        *total = left;
    }
}

/// Writes the totals and steps of a later drawn frame from the totals of the one before. All slices have one value a
/// column. Ties go to the diagonal, then to the step to the next drawn frame.
pub fn next_row(costs: &[f64], above: &[f64], totals: &mut [f64], steps: &mut [u8]) {
    from_above(above, totals, steps);
    let mut left = f64::INFINITY;
    for ((cost, total), step) in costs.iter().zip(totals).zip(steps) {
        if left < *total {
            *step = CLIP;
        }
        left = cost + if left < *total { left } else { *total };
        *total = left;
    }
}

/// The better of the two steps that come from the row above: what does not wait for the column before.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw", "x86_64+avx2"))]
fn from_above(above: &[f64], totals: &mut [f64], steps: &mut [u8]) {
    let [first, ..] = above else { return };
    (totals[0], steps[0]) = (*first, DRAWN);
    for (((diagonal, up), total), step) in above.iter().zip(&above[1..]).zip(&mut totals[1..]).zip(&mut steps[1..]) {
        let stays = up < diagonal;
        *step = u8::from(stays);
        *total = if stays { *up } else { *diagonal };
    }
}

fn trace_free(steps: &[u8], columns: usize, end: usize) -> Vec<[i64; 2]> {
    let (mut row, mut column) = (steps.len() / columns - 1, end);
    let mut path = vec![[row as i64, column as i64]];
    loop {
        match steps[row * columns + column] {
            CLIP => column -= 1,
            DRAWN => row -= 1,
            _ if row == 0 => break,
            _ => (row, column) = (row - 1, column - 1),
        }
        path.push([row as i64, column as i64]);
    }
    path.reverse();
    path
}

/// Totals of one row by how a cell was reached: by the diagonal, or by a run of 1, 2, ... steps of one kind since.
struct Arrivals {
    diagonal: Vec<f64>,
    drawn: Vec<Vec<f64>>,
    best: Vec<f64>,
}

fn fill_limited(
    cost: &[f64],
    columns: usize,
    limit: usize,
    open_begin: bool,
    steps: &mut [u8],
) -> Result<Vec<f64>, KernelError> {
    let nowhere = vec![f64::INFINITY; columns];
    let mut row_above =
        Arrivals { diagonal: nowhere.clone(), drawn: vec![nowhere.clone(); limit - 1], best: nowhere.clone() };
    let (mut run, mut longer) = (nowhere.clone(), nowhere);
    for (row, (costs, steps)) in cost.chunks(columns).zip(steps.chunks_mut(columns)).enumerate() {
        check_row(row, costs)?;
        let Arrivals { diagonal, drawn, best } = &mut row_above;
        for length in (1..limit).rev() {
            let (shorter, rest) = drawn.split_at_mut(length - 1);
            extend(costs, shorter.last().unwrap_or(diagonal), &mut rest[0]);
        }
        if row == 0 {
            diagonal.iter_mut().zip(costs).take(if open_begin { columns } else { 1 }).for_each(|(d, c)| *d = *c);
        } else {
            extend(&costs[1..], &best[..columns - 1], &mut diagonal[1..]);
            diagonal[0] = f64::INFINITY;
        }
        best.copy_from_slice(diagonal);
        for (index, arrived) in drawn.iter().enumerate() {
            keep_better(arrived, 1 + index as u8, best, steps);
        }
        run.copy_from_slice(diagonal);
        for length in 1..limit {
            longer[0] = f64::INFINITY;
            extend(&costs[1..], &run[..columns - 1], &mut longer[1..]);
            std::mem::swap(&mut run, &mut longer);
            keep_better(&run, (limit - 1 + length) as u8, best, steps);
        }
    }
    Ok(row_above.best)
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn extend(costs: &[f64], from: &[f64], to: &mut [f64]) {
    for ((cost, from), to) in costs.iter().zip(from).zip(to) {
        *to = from + cost;
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw", "x86_64+avx2"))]
fn keep_better(arrived: &[f64], code: u8, best: &mut [f64], steps: &mut [u8]) {
    for ((arrived, best), step) in arrived.iter().zip(best).zip(steps) {
        let better = arrived < best;
        *step = if better { code } else { *step };
        *best = if better { *arrived } else { *best };
    }
}

/// Follows the runs back: code 0 is the diagonal, 1 to limit - 1 a run over drawn frames, above that one over the clip's.
fn trace_limited(steps: &[u8], columns: usize, end: usize, limit: usize) -> Vec<[i64; 2]> {
    let (mut row, mut column) = (steps.len() / columns - 1, end);
    let mut path = vec![[row as i64, column as i64]];
    loop {
        let code = usize::from(steps[row * columns + column]);
        for step in 0..if code < limit { code } else { code - (limit - 1) } {
            if code < limit {
                row -= 1;
            } else {
                column -= 1;
            }
            path.push([row as i64, column as i64]);
            debug_assert!(step < limit);
        }
        if row == 0 {
            break;
        }
        (row, column) = (row - 1, column - 1);
        path.push([row as i64, column as i64]);
    }
    path.reverse();
    path
}
