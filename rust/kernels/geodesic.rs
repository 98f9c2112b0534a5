//! Labels grow over a figure along its inside, each at its own pace, until they meet.
//!
//! Dijkstra's way from many seeds at once (1959) over a pixel's eight neighbours. A step costs its length times the mean
//! of the two pixels' costs times the pace of the label that takes it; a pixel goes to the label that is there first, so
//! every label's region hangs together with its seeds. Equally early ones: the lower label, then the earlier pixel.

use crate::error::{KernelError, check_length};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// A pixel that is reached: ordered by distance, label, place.
#[derive(Clone, Copy, PartialEq)]
struct Reached {
    distance: f64,
    label: u8,
    pixel: usize,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_distance = self.distance.total_cmp(&other.distance);
        by_distance.then(self.label.cmp(&other.label)).then(self.pixel.cmp(&other.pixel))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Writes the label and the distance of every pixel that `seeds` (0: none) reach; what they do not is 0 and infinite.
///
/// Row-major, `width` columns. `costs` are above zero, or infinite where nothing goes; `paces[label - 1]` multiplies the
/// steps of a label.
pub fn geodesic_labels(
    seeds: &[u8],
    costs: &[f32],
    width: usize,
    paces: &[f64],
    labels: &mut [u8],
    distances: &mut [f32],
) -> Result<(), KernelError> {
    check_length("costs", seeds.len(), costs.len())?;
    check_length("labels", seeds.len(), labels.len())?;
    check_length("distances", seeds.len(), distances.len())?;
    check_values(seeds, costs, width, paces)?;
    labels.fill(0);
    distances.fill(f32::INFINITY);
    if seeds.is_empty() || width == 0 {
        return Ok(());
    }
    let start = |pixel: usize| Reverse(Reached { distance: 0.0, label: seeds[pixel], pixel });
    let mut waiting: BinaryHeap<_> = (0..seeds.len()).filter(|i| seeds[*i] != 0).map(start).collect();
    while let Some(Reverse(here)) = waiting.pop() {
        if labels[here.pixel] != 0 {
            continue;
        }
        labels[here.pixel] = here.label;
        distances[here.pixel] = here.distance as f32;
        for (pixel, length) in neighbours(here.pixel, width, seeds.len()) {
            let cost = f64::from(costs[pixel]);
            if labels[pixel] == 0 && cost.is_finite() {
                // A seed may lie where nothing goes: from there the next pixel's cost alone counts.
                let own = f64::from(costs[here.pixel]);
                let mean = if own.is_finite() { (own + cost) / 2.0 } else { cost };
                let distance = here.distance + length * mean * paces[usize::from(here.label) - 1];
                waiting.push(Reverse(Reached { distance, label: here.label, pixel }));
            }
        }
    }
    Ok(())
}

fn check_values(seeds: &[u8], costs: &[f32], width: usize, paces: &[f64]) -> Result<(), KernelError> {
    if let Some(index) = seeds.iter().position(|label| usize::from(*label) > paces.len()) {
        let (row, column) = (index / width.max(1), index % width.max(1));
        return Err(KernelError::Pixel { argument: "seeds", problem: "a label without a pace", row, column });
    }
    if let Some(index) = costs.iter().position(|cost| cost.is_nan() || *cost <= 0.0) {
        let (row, column) = (index / width.max(1), index % width.max(1));
        return Err(KernelError::Pixel { argument: "costs", problem: "want more than zero", row, column });
    }
    match paces.iter().position(|pace| !(pace.is_finite() && *pace > 0.0)) {
        Some(index) => Err(KernelError::Item { argument: "paces", problem: "want more than zero", index }),
        None => Ok(()),
    }
}

/// The pixels around one, and how far they are.
fn neighbours(pixel: usize, width: usize, count: usize) -> impl Iterator<Item = (usize, f64)> {
    let (row, column, height) = (pixel / width, pixel % width, count / width);
    let rows = row.saturating_sub(1)..=(row + 1).min(height.saturating_sub(1));
    rows.flat_map(move |y| (column.saturating_sub(1)..=(column + 1).min(width - 1)).map(move |x| (y, x)))
        .filter(move |place| *place != (row, column))
        .map(move |(y, x)| {
            let slanted = y != row && x != column;
            (y * width + x, if slanted { std::f64::consts::SQRT_2 } else { 1.0 })
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grown(seeds: &[u8], costs: &[f32], width: usize, paces: &[f64]) -> (Vec<u8>, Vec<f32>) {
        let (mut labels, mut distances) = (vec![9; seeds.len()], vec![9.0; seeds.len()]);
        assert_eq!(geodesic_labels(seeds, costs, width, paces, &mut labels, &mut distances), Ok(()));
        (labels, distances)
    }

    #[test]
    fn a_wall_is_walked_round() {
        let wall = f32::INFINITY;
        let costs = [1.0, wall, 1.0, 1.0, wall, 1.0, 1.0, 1.0, 1.0];
        let (labels, distances) = grown(&[1, 0, 0, 0, 0, 0, 0, 0, 0], &costs, 3, &[1.0]);
        assert_eq!(labels, [1, 0, 1, 1, 0, 1, 1, 1, 1]);
        let way = 2.0 + 2.0 * std::f32::consts::SQRT_2;
        assert!((distances[2] - way).abs() < 1e-6 && distances[1].is_infinite());
    }

    #[test]
    fn the_quicker_label_takes_more_and_ties_go_to_the_lower() {
        let seeds = [1, 0, 0, 0, 0, 0, 2];
        assert_eq!(grown(&seeds, &[1.0; 7], 7, &[1.0, 1.0]).0, [1, 1, 1, 1, 2, 2, 2]);
        assert_eq!(grown(&seeds, &[1.0; 7], 7, &[3.0, 1.0]).0, [1, 1, 2, 2, 2, 2, 2]);
    }

    #[test]
    fn bad_input_is_named() {
        let run = |seeds: &[u8], costs: &[f32], paces: &[f64]| {
            geodesic_labels(seeds, costs, 2, paces, &mut [0; 2], &mut [0.0; 2]).map_err(|error| error.to_string())
        };
        assert_eq!(run(&[0, 2], &[1.0; 2], &[1.0]), Err("seeds: a label without a pace at row 0, column 1".into()));
        assert_eq!(run(&[0, 1], &[0.0; 2], &[1.0]), Err("costs: want more than zero at row 0, column 0".into()));
        assert_eq!(run(&[0, 1], &[1.0; 2], &[f64::NAN]), Err("paces: want more than zero at index 0".into()));
        assert_eq!(run(&[0], &[1.0; 2], &[]), Err("costs: want 1 values, got 2".into()));
        assert_eq!(geodesic_labels(&[], &[], 0, &[], &mut [], &mut []), Ok(()));
    }
}
