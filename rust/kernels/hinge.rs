//! Vertices at which parts of a mesh hang together by that vertex alone.

/// A vertex whose triangles fall apart into fans that share no edge at it, and the other vertices of those triangles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hinge {
    /// The shared vertex.
    pub vertex: u32,
    /// Its neighbours in all fans, ascending.
    pub others: Vec<u32>,
}

/// Finds the hinges of a mesh of `count` vertices.
pub fn hinges(triangles: &[[u32; 3]], count: usize) -> Vec<Hinge> {
    let mut opposite = vec![Vec::new(); count];
    for [a, b, c] in triangles {
        for (vertex, edge) in [(a, [*b, *c]), (b, [*c, *a]), (c, [*a, *b])] {
            opposite[*vertex as usize].push(edge);
        }
    }
    let apart = |(vertex, edges): (usize, &Vec<[u32; 2]>)| {
        let mut others: Vec<u32> = edges.iter().flatten().copied().collect();
        others.sort_unstable();
        others.dedup();
        (!connected(&others, edges)).then_some(Hinge { vertex: vertex as u32, others })
    };
    opposite.iter().enumerate().filter_map(apart).collect()
}

/// Whether `edges` join all of `vertices` (ascending).
fn connected(vertices: &[u32], edges: &[[u32; 2]]) -> bool {
    let mut reached = vec![false; vertices.len()];
    let Some(first) = reached.first_mut() else { return true };
    *first = true;
    let place = |vertex: &u32| vertices.binary_search(vertex).unwrap_or(0);
    loop {
        let mut grew = false;
        for [a, b] in edges {
            let (a, b) = (place(a), place(b));
            if reached[a] != reached[b] {
                (reached[a], reached[b], grew) = (true, true, true);
            }
        }
        if !grew {
            return reached.iter().all(|reached| *reached);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shared_vertex_is_a_hinge_and_a_shared_edge_is_none() {
        let others = vec![0, 1, 3, 4];
        assert_eq!(hinges(&[[0, 1, 2], [2, 3, 4]], 5), [Hinge { vertex: 2, others }]);
        assert_eq!(hinges(&[[0, 1, 2], [2, 1, 3], [1, 4, 2]], 6), []);
    }
}
