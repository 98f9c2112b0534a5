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
    if all_finite(costs) {
        return Ok(());
    }
    let column = costs.iter().position(|cost| !cost.is_finite()).unwrap_or(0);
    Err(KernelError::Pixel { argument: "cost", problem: "want finite numbers, got NaN or inf", row, column })
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn all_finite(values: &[f64]) -> bool {
    values.iter().fold(true, |fine, value| fine & value.is_finite())
}

/// Rows worked together: while one waits for its column before, the others go on.
const ROWS: usize = 4;

fn fill_free(cost: &[f64], columns: usize, open_begin: bool, steps: &mut [u8]) -> Result<Vec<f64>, KernelError> {
    let mut table = vec![0.0; (ROWS + 1) * columns];
    let (first, rest) = cost.split_at(columns);
    let (first_steps, rest_steps) = steps.split_at_mut(columns);
    check_row(0, first)?;
    first_row(first, open_begin, &mut table[..columns], first_steps);
    let mut row = 1;
    for (costs, steps) in rest.chunks(ROWS * columns).zip(rest_steps.chunks_mut(ROWS * columns)) {
        for costs in costs.chunks(columns) {
            check_row(row, costs)?;
            row += 1;
        }
        let table = &mut table[..columns + costs.len()];
        if costs.len() == ROWS * columns {
            next_rows::<ROWS>(costs, columns, table);
        } else {
            for (row, costs) in costs.chunks(columns).enumerate() {
                next_rows::<1>(costs, columns, &mut table[row * columns..(row + 2) * columns]);
            }
        }
        for (row, steps) in steps.chunks_mut(columns).enumerate() {
            let (above, totals) = table[row * columns..(row + 2) * columns].split_at(columns);
            next_steps(above, totals, steps);
        }
        table.copy_within(costs.len().., 0);
    }
    table.truncate(columns);
    Ok(table)
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

/// Writes the totals of `R` drawn frames below the first row of `table`, which holds those of the frame before them.
/// `costs` has `R` rows of `columns`, `table` one more.
///
/// The rows run side by side, each one column behind the one above it.
pub fn next_rows<const R: usize>(costs: &[f64], columns: usize, table: &mut [f64]) {
    let (above, below) = table.split_at_mut(columns);
    let mut front = Front::<R>::default();
    let slope = (R - 1).min(columns);
    for tick in 0..slope {
        front.partly(tick, costs, above, below);
    }
    if columns >= R {
        let whole = columns + 1 - R;
        let costs: [&[f64]; R] = std::array::from_fn(|row| &costs[row * columns + R - 1 - row..][..whole]);
        let mut rows = below.chunks_mut(columns);
        let rows: [&mut [f64]; R] =
            std::array::from_fn(|row| &mut rows.next().unwrap_or_default()[R - 1 - row..][..whole]);
        for (column, up) in above[R - 1..].iter().enumerate() {
            for row in (0..R).rev() {
                rows[row][column] = front.advance(row, costs[row][column], *up);
            }
            front.corner = *up;
        }
    }
    for tick in columns.max(slope)..columns + R - 1 {
        front.partly(tick, costs, above, below);
    }
}

/// The totals that `R` rows have just reached and those before; the corner is the same of the row above the first.
struct Front<const R: usize> {
    latest: [f64; R],
    earlier: [f64; R],
    corner: f64,
}

impl<const R: usize> Default for Front<R> {
    fn default() -> Self {
        Front { latest: [f64::INFINITY; R], earlier: [f64::INFINITY; R], corner: f64::INFINITY }
    }
}

impl<const R: usize> Front<R> {
    /// Takes one row a column on. From the last row to the first: each reads the one above as it stood a tick and two
    /// ticks ago.
    #[inline(always)]
    fn advance(&mut self, row: usize, cost: f64, up: f64) -> f64 {
        let (up, diagonal) = if row == 0 { (up, self.corner) } else { (self.latest[row - 1], self.earlier[row - 1]) };
        self.earlier[row] = self.latest[row];
        self.latest[row] = cost + least(self.latest[row], least(up, diagonal));
        self.latest[row]
    }

    /// One tick near the table's sides, where not all rows have a column.
    fn partly(&mut self, tick: usize, costs: &[f64], above: &[f64], below: &mut [f64]) {
        let up = above.get(tick).copied().unwrap_or(f64::INFINITY);
        for row in (0..R).rev() {
            if (row..row + above.len()).contains(&tick) {
                let cell = row * above.len() + tick - row;
                below[cell] = self.advance(row, costs[cell], up);
            }
        }
        self.corner = up;
    }
}

#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Writes the steps of one drawn frame from its totals and those of the frame before, all with one value a column. Ties
/// go to the diagonal, then to the step to the next drawn frame.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw", "x86_64+avx2"))]
pub fn next_steps(above: &[f64], totals: &[f64], steps: &mut [u8]) {
    if let [first, ..] = steps {
        *first = DRAWN;
    }
    let before = above.iter().zip(above.iter().skip(1)).zip(totals);
    for (((diagonal, up), left), step) in before.zip(steps.iter_mut().skip(1)) {
        let stays = if up < diagonal { DRAWN } else { DIAGONAL };
        *step = if *left < least(*up, *diagonal) { CLIP } else { stays };
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
        let (run, over_drawn) = if code < limit { (code, true) } else { (code - (limit - 1), false) };
        for _ in 0..run {
            (row, column) = if over_drawn { (row - 1, column) } else { (row, column - 1) };
            path.push([row as i64, column as i64]);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Costs without a pattern, each 0 to 1.
    fn rough(count: usize) -> Vec<f64> {
        (0..count).map(|i| (i as f64 * 12.9898).sin().abs() * 43758.5453 % 1.0).collect()
    }

    fn sum(cost: &[f64], columns: usize, path: &[[i64; 2]]) -> f64 {
        path.iter().map(|[row, column]| cost[*row as usize * columns + *column as usize]).sum()
    }

    #[test]
    fn the_path_costs_what_the_table_says() {
        let columns = 37;
        let cost = rough(20 * columns);
        for open in [false, true] {
            for slope_limit in [None, Some(STEEPEST)] {
                let rules = Rules { open_begin: open, open_end: open, slope_limit };
                let (total, path) = time_warp(&cost, columns, rules).unwrap_or_default();
                assert!((sum(&cost, columns, &path) - total).abs() < 1e-9);
                assert_eq!((path[0][0], path[path.len() - 1][0]), (0, 19));
            }
        }
    }

    #[test]
    fn a_limit_that_binds_nothing_changes_nothing() {
        let cost = rough(40 * 60);
        let free = time_warp(&cost, 60, Rules::default());
        assert_eq!(time_warp(&cost, 60, Rules { slope_limit: Some(61), ..Rules::default() }), free);
    }

    #[test]
    fn rows_side_by_side_are_the_table() {
        for columns in [1, 2, 3, 4, 9] {
            let cost = rough(5 * columns);
            let (mut table, mut steps) = (vec![0.0; 5 * columns], vec![0; 5 * columns]);
            first_row(&cost[..columns], true, &mut table[..columns], &mut steps[..columns]);
            next_rows::<4>(&cost[columns..], columns, &mut table);
            for cell in columns..5 * columns {
                let from = |back, there| if there { table[cell - back] } else { f64::INFINITY };
                let inside = cell % columns > 0;
                let ways = [from(columns + 1, inside), from(columns, true), from(1, inside)];
                let best = ways.iter().copied().fold(f64::INFINITY, f64::min);
                assert_eq!(table[cell], cost[cell] + best);
                let row = cell / columns * columns;
                next_steps(&table[row - columns..row], &table[row..row + columns], &mut steps[row..row + columns]);
                assert_eq!(ways[usize::from(steps[cell])], best);
            }
        }
    }

    #[test]
    fn what_cannot_be_warped_is_refused() {
        let refused = |cost: &[f64], columns, slope_limit| {
            time_warp(cost, columns, Rules { slope_limit, ..Rules::default() }).is_err()
        };
        assert!(refused(&[], 0, None) && refused(&[1.0; 5], 2, None) && refused(&[1.0; 9], 9, Some(8)));
        assert!(refused(&[1.0; 4], 2, Some(0)) && refused(&[1.0; 4], 2, Some(129)));
        assert!(matches!(
            time_warp(&[1.0, 1.0, 1.0, f64::NAN], 2, Rules::default()),
            Err(KernelError::Pixel { row: 1, column: 1, .. })
        ));
    }
}
