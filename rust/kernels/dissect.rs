//! An elimination order for a planar mesh: nested dissection by the places of its vertices.
//!
//! A part is cut across its longer side at the median; the vertices before the cut that have a neighbour behind it are
//! eliminated last (George 1973). Few new entries arise in the factor, since no entry joins what a cut has parted.

use glam::DVec2;

/// Parts of so few vertices are not cut further.
const LEAF: usize = 16;

/// Which vertices are neighbours, each pair both ways, in one list.
#[derive(Debug)]
pub struct Neighbours {
    starts: Vec<usize>,
    others: Vec<u32>,
}

impl Neighbours {
    /// From pairs of vertices below `count`.
    pub fn new(count: usize, pairs: &[[u32; 2]]) -> Self {
        let mut both: Vec<[u32; 2]> = pairs.iter().flat_map(|[a, b]| [[*a, *b], [*b, *a]]).collect();
        both.sort_unstable();
        both.dedup();
        let mut starts = vec![0; count + 1];
        both.iter().for_each(|[a, _]| starts[*a as usize + 1] += 1);
        (0..count).for_each(|i| starts[i + 1] += starts[i]);
        Neighbours { starts, others: both.into_iter().map(|[_, b]| b).collect() }
    }

    /// The neighbours of a vertex.
    pub fn of(&self, vertex: u32) -> &[u32] {
        &self.others[self.starts[vertex as usize]..self.starts[vertex as usize + 1]]
    }
}

/// Returns the vertices in the order in which to eliminate them.
pub fn dissect(places: &[DVec2], neighbours: &Neighbours) -> Vec<u32> {
    let mut vertices: Vec<u32> = (0..places.len() as u32).collect();
    let mut part_of = vec![0u32; places.len()];
    // Parts still to be ordered, with the first place of the order that is theirs.
    let mut waiting = vec![(0, vertices.len())];
    let mut parts = 0;
    while let Some((start, end)) = waiting.pop() {
        let part = &mut vertices[start..end];
        if part.len() <= LEAF {
            continue;
        }
        let half = cut(part, places);
        parts += 1;
        part[half..].iter().for_each(|vertex| part_of[*vertex as usize] = parts);
        let at_cut = |vertex: &u32| neighbours.of(*vertex).iter().any(|other| part_of[*other as usize] == parts);
        let border: Vec<u32> = part[..half].iter().copied().filter(at_cut).collect();
        let before: Vec<u32> = part[..half].iter().copied().filter(|vertex| !at_cut(vertex)).collect();
        let behind = part[half..].to_vec();
        let (first, second) = (before.len(), before.len() + behind.len());
        part[..first].copy_from_slice(&before);
        part[first..second].copy_from_slice(&behind);
        part[second..].copy_from_slice(&border);
        waiting.extend([(start, start + first), (start + first, start + second)]);
    }
    vertices
}

/// Orders a part along its longer side and returns where its second half begins.
fn cut(part: &mut [u32], places: &[DVec2]) -> usize {
    let place = |vertex: u32| places[vertex as usize];
    let (low, high) = part.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), vertex| {
        (low.min(place(*vertex)), high.max(place(*vertex)))
    });
    let axis = usize::from(high.y - low.y > high.x - low.x);
    part.sort_unstable_by(|a, b| place(*a)[axis].total_cmp(&place(*b)[axis]).then(a.cmp(b)));
    part.len() / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_ordered_with_its_middle_column_last() {
        let side = 9u32;
        let places: Vec<DVec2> =
            (0..side * side).map(|i| DVec2::new(f64::from(i % side) * 2.0, f64::from(i / side))).collect();
        let right = (0..side * side).filter(|i| i % side + 1 < side).map(|i| [i, i + 1]);
        let down = (0..side * (side - 1)).map(|i| [i, i + side]);
        let neighbours = Neighbours::new(81, &right.chain(down).collect::<Vec<_>>());
        assert_eq!(neighbours.of(10), [1, 9, 11, 19]);
        let order = dissect(&places, &neighbours);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..81).collect::<Vec<_>>());
        // The last vertices part the rest: no neighbour of the first part is in the second.
        assert!(order[72..].iter().all(|vertex| (3..=4).contains(&(vertex % side))), "{order:?}");
    }
}
