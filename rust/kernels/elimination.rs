//! An elimination order for a sparse symmetric matrix: minimum degree (Tinney, Walker 1967).
//!
//! The vertex with the fewest neighbours goes next, and its neighbours become neighbours of each other. Figures are thin
//! meshes, for which this leaves about half the entries that nested dissection does.

use std::collections::BTreeSet;

/// Returns the vertices below `count` in the order in which to eliminate them; `pairs` are neighbours.
pub fn minimum_degree(count: usize, pairs: &[[u32; 2]]) -> Vec<u32> {
    let mut neighbours = vec![Vec::new(); count];
    for [a, b] in pairs.iter().filter(|[a, b]| a != b) {
        neighbours[*a as usize].push(*b);
        neighbours[*b as usize].push(*a);
    }
    neighbours.iter_mut().for_each(|others| {
        others.sort_unstable();
        others.dedup();
    });
    let mut waiting: BTreeSet<(usize, u32)> =
        neighbours.iter().zip(0..).map(|(others, vertex)| (others.len(), vertex)).collect();
    let mut order = Vec::with_capacity(count);
    let mut merged = Vec::new();
    while let Some((_, vertex)) = waiting.pop_first() {
        order.push(vertex);
        let clique = std::mem::take(&mut neighbours[vertex as usize]);
        for other in &clique {
            let own = &mut neighbours[*other as usize];
            waiting.remove(&(own.len(), *other));
            merged.clear();
            merge(own, &clique, |joined| {
                if joined != *other && joined != vertex {
                    merged.push(joined);
                }
            });
            std::mem::swap(own, &mut merged);
            waiting.insert((own.len(), *other));
        }
    }
    order
}

/// Calls `take` with each number of two ascending lists, once and ascending.
fn merge(a: &[u32], b: &[u32], mut take: impl FnMut(u32)) {
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        take(a[i].min(b[j]));
        let (left, right) = (a[i], b[j]);
        i += usize::from(left <= right);
        j += usize::from(right <= left);
    }
    a[i..].iter().chain(&b[j..]).for_each(|value| take(*value));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hub_of_a_star_and_the_middle_of_a_chain_are_not_early() {
        let star: Vec<[u32; 2]> = (1..6).map(|leaf| [0, leaf]).collect();
        assert_eq!(minimum_degree(6, &star), [1, 2, 3, 4, 0, 5]);
        assert_eq!(minimum_degree(3, &[[0, 1], [1, 0], [2, 1], [2, 2]]), [0, 1, 2]);
        assert_eq!(minimum_degree(2, &[]), [0, 1]);
    }

    #[test]
    fn neighbours_of_what_is_gone_become_neighbours() {
        // A ring: after any vertex goes, its two neighbours are joined, down to the last two.
        let ring: Vec<[u32; 2]> = (0..7).map(|i| [i, (i + 1) % 7]).collect();
        let mut order = minimum_degree(7, &ring);
        assert_eq!(order[..2], [0, 1]);
        order.sort_unstable();
        assert_eq!(order, (0..7).collect::<Vec<_>>());
    }

    #[test]
    fn merging_keeps_every_number_once() {
        let mut out = Vec::new();
        merge(&[1, 3, 5, 9], &[2, 3, 9, 11], |value| out.push(value));
        assert_eq!(out, [1, 2, 3, 5, 9, 11]);
    }
}
