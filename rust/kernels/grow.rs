//! Labels grow over the unlabelled rest of the figure: lines, antialiased rims, hair.
//!
//! docs/papers.md on Jain et al. 2010, section 3.3.1: the paper gives no depth to what lies outside every limb; here a
//! figure's pixel without a label takes the label of the nearest labelled pixel (Euclidean, exact). Equally near ones:
//! the one farther left, then the one farther up. Pixels close to a label are found by looking around them in order of
//! distance; the others by the lower envelope of parabolas (Felzenszwalb and Huttenlocher 2012; Meijster, Roerdink,
//! Hesselink 2000), whose cost is linear in the pixels.

use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// How far the search around single pixels looks: a wide line's or rim's width, 196 places.
const NEAR: i32 = 8;

/// Above one target in this many pixels the search around single pixels is left out: the envelope is cheaper then.
const DENSE: usize = 32;

/// Pixels looked at together: most blocks have no target.
const BLOCK: usize = 64;

/// No labelled pixel in this column.
const NOWHERE: i32 = i32::MIN;

/// A labelled picture and its size, signed, so that neighbours may lie outside.
#[derive(Clone, Copy)]
struct Map<'a> {
    labels: &'a [u8],
    width: i32,
    height: i32,
}

impl Map<'_> {
    fn label(&self, row: i32, column: i32) -> u8 {
        if (0..self.height).contains(&row) && (0..self.width).contains(&column) {
            self.labels[row as usize * self.width as usize + column as usize]
        } else {
            0
        }
    }
}

/// Writes `labels` grown over `figure` (not zero: figure), at most `reach` pixels far.
///
/// Row-major, `width` columns. Labels outside the figure stay, and the figure grows from them too.
pub fn grow_labels(
    labels: &[u8],
    figure: &[u8],
    width: usize,
    reach: Option<f64>,
    out: &mut [u8],
) -> Result<(), KernelError> {
    check_length("figure", labels.len(), figure.len())?;
    check_length("out", labels.len(), out.len())?;
    if width == 0 || labels.is_empty() {
        return Ok(());
    }
    let height = labels.len() / width;
    let (Ok(columns), Ok(rows)) = (i32::try_from(width), i32::try_from(height)) else {
        return Err(KernelError::Argument { argument: "labels", problem: "a side of more than 2147483647 pixels" });
    };
    let map = Map { labels, width: columns, height: rows };
    let limit = reach.map_or(i64::MAX, squared_limit);
    out.copy_from_slice(labels);
    let targets: usize = labels.par_chunks(width).zip(figure.par_chunks(width)).map(|(l, f)| count_targets(l, f)).sum();
    if targets == 0 {
        return Ok(());
    }
    let dense = targets > labels.len() / DENSE;
    if !dense && grow_near(map, figure, limit, out) == 0 {
        return Ok(());
    }
    if dense || limit > i64::from(NEAR * NEAR) {
        grow_far(map, figure, limit, out);
    }
    Ok(())
}

/// The largest squared distance within `reach`, so that the root of it is compared and not a rounded square.
fn squared_limit(reach: f64) -> i64 {
    let below = (reach * reach) as i64;
    below.saturating_add(i64::from(((below as f64) + 1.0).sqrt() <= reach))
}

/// How many pixels of a row lie on the figure and have no label.
fn count_targets(labels: &[u8], figure: &[u8]) -> usize {
    let in_block = |(l, f): (&[u8], &[u8])| l.iter().zip(f).map(|(l, f)| u8::from(*l == 0 && *f != 0)).sum::<u8>();
    labels.chunks(BLOCK).zip(figure.chunks(BLOCK)).map(in_block).map(usize::from).sum()
}

/// Calls `label` with the column of every target of a row, and writes what it finds.
fn for_targets(out: &mut [u8], figure: &[u8], mut label: impl FnMut(usize) -> u8) {
    for (block, (out, figure)) in out.chunks_mut(BLOCK).zip(figure.chunks(BLOCK)).enumerate() {
        if count_targets(out, figure) > 0 {
            for (i, (out, _)) in out.iter_mut().zip(figure).enumerate().filter(|(_, (l, f))| **l == 0 && **f != 0) {
                *out = label(block * BLOCK + i);
            }
        }
    }
}

/// The places (x, y) around a pixel by distance, then column, then row: the first labelled one is the nearest.
fn places(limit: i64) -> Vec<[i32; 2]> {
    let squared = |[x, y]: &[i32; 2]| x * x + y * y;
    let most = limit.min(i64::from(NEAR * NEAR));
    let all = (-NEAR..=NEAR).flat_map(|x| (-NEAR..=NEAR).map(move |y| [x, y]));
    let mut places: Vec<_> = all.filter(|p| (1..=most).contains(&i64::from(squared(p)))).collect();
    places.sort_by_key(|p| (squared(p), p[0], p[1]));
    places
}

/// Looks around every target and returns how many found nothing.
fn grow_near(map: Map, figure: &[u8], limit: i64, out: &mut [u8]) -> usize {
    let (places, width) = (places(limit), map.width as usize);
    let steps: Vec<isize> = places.iter().map(|[x, y]| (*y * map.width + *x) as isize).collect();
    let inner = |side: i32, i: i32| i >= NEAR && i < side - NEAR;
    let rows = out.par_chunks_mut(width).zip(figure.par_chunks(width)).enumerate();
    rows.map(|(row, (out, figure))| {
        let mut left = 0;
        for_targets(out, figure, |column| {
            let (y, x) = (row as i32, column as i32);
            let found = if inner(map.height, y) && inner(map.width, x) {
                let here = row * width + column;
                steps.iter().map(|step| map.labels[here.wrapping_add_signed(*step)]).find(|label| *label != 0)
            } else {
                places.iter().map(|[dx, dy]| map.label(y + dy, x + dx)).find(|label| *label != 0)
            };
            left += usize::from(found.is_none());
            found.unwrap_or(0)
        });
        left
    })
    .sum()
}

/// Gives every target that is left the label of the nearest labelled pixel of the whole picture.
fn grow_far(map: Map, figure: &[u8], limit: i64, out: &mut [u8]) {
    let width = map.width as usize;
    let mut rows: Vec<_> = out.par_chunks_mut(width).zip(figure.par_chunks(width)).enumerate().collect();
    rows.retain(|(_, (out, figure))| count_targets(out, figure) > 0);
    let numbers: Vec<usize> = rows.iter().map(|(row, _)| *row).collect();
    let nearest = nearest_rows(map, &numbers);
    rows.into_par_iter().zip(nearest.par_chunks(width)).for_each_init(Vec::new, |envelope, (row, nearest)| {
        let (row, (out, figure)) = row;
        build_envelope(row as i32, nearest, envelope);
        let mut piece = 0;
        for_targets(out, figure, |column| {
            while piece + 1 < envelope.len() && envelope[piece + 1].start <= column as i64 {
                piece += 1;
            }
            let best = envelope.get(piece).filter(|best| best.squared(column as i64) <= limit);
            best.map_or(0, |best| map.label(nearest[best.column as usize], best.column as i32))
        });
    });
}

/// For every pixel of the `wanted` rows, in order, the row of the nearest labelled pixel in its own column: the upper of
/// two, or NOWHERE.
fn nearest_rows(map: Map, wanted: &[usize]) -> Vec<i32> {
    let width = map.width as usize;
    let mut nearest = vec![NOWHERE; wanted.len() * width];
    let mut last = vec![NOWHERE; width];
    let take = |row: usize, last: &mut [i32]| {
        for (last, label) in last.iter_mut().zip(&map.labels[row * width..(row + 1) * width]) {
            *last = if *label != 0 { row as i32 } else { *last };
        }
    };
    let mut row = 0;
    for (wanted, nearest) in wanted.iter().zip(nearest.chunks_mut(width)) {
        (row..=*wanted).for_each(|row| take(row, &mut last));
        row = *wanted + 1;
        nearest.copy_from_slice(&last);
    }
    last.fill(NOWHERE);
    let mut end = map.height as usize;
    for (wanted, nearest) in wanted.iter().zip(nearest.chunks_mut(width)).rev() {
        (*wanted..end).rev().for_each(|row| take(row, &mut last));
        end = *wanted;
        let row = *wanted as i32;
        for (nearest, last) in nearest.iter_mut().zip(&last) {
            let lower = *last != NOWHERE && (*nearest == NOWHERE || *last - row < row - *nearest);
            *nearest = if lower { *last } else { *nearest };
        }
    }
    nearest
}

/// One parabola of the lower envelope of a row: nearest from `start` on.
struct Piece {
    column: i64,
    height: i64,
    start: i64,
}

impl Piece {
    fn squared(&self, column: i64) -> i64 {
        (column - self.column) * (column - self.column) + self.height
    }
}

fn build_envelope(row: i32, nearest: &[i32], envelope: &mut Vec<Piece>) {
    envelope.clear();
    for (column, near) in (0i64..).zip(nearest).filter(|(_, near)| **near != NOWHERE) {
        let up = i64::from(row) - i64::from(*near);
        let mut piece = Piece { column, height: up * up, start: 0 };
        while let Some(last) = envelope.last() {
            // The last column where the older parabola is as near or nearer: ties stay with the left one.
            let rise = piece.column * piece.column - last.column * last.column + piece.height - last.height;
            piece.start = rise.div_euclid(2 * (piece.column - last.column)) + 1;
            if piece.start > last.start {
                break;
            }
            piece.start = 0;
            envelope.pop();
        }
        envelope.push(piece);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance, then column, then row.
    fn brute(labels: &[u8], figure: &[u8], width: usize, limit: i64) -> Vec<u8> {
        let place = |i: usize| ((i % width) as i64, (i / width) as i64);
        let nearest = |i: usize| {
            let (x, y) = place(i);
            let known = (0..labels.len()).filter(|j| labels[*j] != 0).map(|j| {
                let (u, v) = place(j);
                ((u - x) * (u - x) + (v - y) * (v - y), u, v, labels[j])
            });
            known.min().filter(|best| best.0 <= limit).map_or(0, |best| best.3)
        };
        (0..labels.len()).map(|i| if labels[i] == 0 && figure[i] != 0 { nearest(i) } else { labels[i] }).collect()
    }

    /// A scatter that repeats itself: no generator needed.
    fn scatter(count: usize, one_in: usize, seed: usize) -> Vec<u8> {
        let hash = |i: usize| (i + seed).wrapping_mul(2_654_435_761).wrapping_mul(i + 97) >> 7;
        (0..count).map(|i| if hash(i).is_multiple_of(one_in) { (hash(i) / one_in % 9) as u8 + 1 } else { 0 }).collect()
    }

    #[test]
    fn both_searches_equal_brute_force_with_its_ties() {
        for seed in 0..20 {
            let (labels, figure) = (scatter(23 * 17, 60, seed), scatter(23 * 17, 2 + seed % 3, seed + 1000));
            let map = Map { labels: &labels, width: 23, height: 17 };
            for limit in [i64::MAX, 16, 5, 0] {
                let want = brute(&labels, &figure, 23, limit);
                let mut far = labels.clone();
                grow_far(map, &figure, limit, &mut far);
                assert_eq!(far, want, "envelope, seed {seed}, limit {limit}");
                let mut near = labels.clone();
                grow_near(map, &figure, limit, &mut near);
                assert_eq!(near, brute(&labels, &figure, 23, limit.min(64)), "around, seed {seed}, limit {limit}");
            }
        }
    }

    #[test]
    fn sparse_targets_beyond_the_near_search_are_reached() {
        let mut labels = vec![0; 40 * 40];
        let mut figure = vec![0; 40 * 40];
        (labels[0], figure[39 * 40 + 39], figure[1]) = (7, 1, 1);
        let mut out = vec![0; 40 * 40];
        assert_eq!(grow_labels(&labels, &figure, 40, None, &mut out), Ok(()));
        assert_eq!((out[39 * 40 + 39], out[1], out[2]), (7, 7, 0));
        assert_eq!(grow_labels(&labels, &figure, 40, Some(55.0), &mut out), Ok(()));
        assert_eq!((out[39 * 40 + 39], out[1]), (0, 7));
    }

    #[test]
    fn nothing_labelled_stays_empty() {
        let mut out = [9; 4];
        assert_eq!(grow_labels(&[0; 4], &[1; 4], 2, None, &mut out), Ok(()));
        assert_eq!(out, [0; 4]);
    }
}
