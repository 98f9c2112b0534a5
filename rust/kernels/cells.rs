//! A grid over boxes that says which of them may meet a box: where moving triangles are looked for.

use glam::DVec3;

/// Which triangles may be met where: cells of a grid over the boxes that they sweep.
#[derive(Debug)]
pub struct Cells {
    low: DVec3,
    high: DVec3,
    size: f64,
    counts: [usize; 3],
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Cells {
    /// Of the boxes (low, high) of all triangles.
    pub fn new(boxes: &[(DVec3, DVec3)]) -> Self {
        let low = boxes.iter().fold(DVec3::INFINITY, |low, bounds| low.min(bounds.0));
        let high = boxes.iter().fold(DVec3::NEG_INFINITY, |high, bounds| high.max(bounds.1));
        if boxes.is_empty() || !(low.is_finite() && high.is_finite()) {
            let (low, high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            return Cells { low, high, size: 1.0, counts: [0; 3], starts: vec![0], items: Vec::new() };
        }
        let size = ((high - low).max_element() / 48.0).max(0.02);
        let counts = ((high - low) / size).to_array().map(|count| count as usize + 1);
        let mut starts = vec![0_u32; counts[0] * counts[1] * counts[2] + 1];
        let mut cells = Cells { low, high, size, counts, starts: Vec::new(), items: Vec::new() };
        let every =
            || boxes.iter().enumerate().flat_map(|(index, (low, high))| cells.of(*low, *high).map(move |c| (index, c)));
        // How many lie in each cell, where each cell's begin, and then they are put in their order.
        every().for_each(|(_, cell)| starts[cell + 1] += 1);
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut free = starts.clone();
        let mut items = vec![0; starts.last().map_or(0, |count| *count as usize)];
        every().for_each(|(index, cell)| {
            items[free[cell] as usize] = index as u32;
            free[cell] += 1;
        });
        (cells.starts, cells.items) = (starts, items);
        cells
    }

    /// Whether a box may hold a part of any triangle.
    #[inline(always)]
    pub fn reach(&self, low: DVec3, high: DVec3) -> bool {
        (low.cmple(self.high) & high.cmpge(self.low)).all()
    }

    /// The triangles that may lie in a box; one that lies in several cells comes several times.
    pub fn near(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = u32> + '_ {
        self.of(low, high)
            .flat_map(|cell| self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize].iter().copied())
    }

    fn of(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = usize> + 'static {
        let counts = self.counts;
        let first = ((low - self.low) / self.size).floor();
        let last = ((high - self.low) / self.size).floor();
        let range = move |from: f64, to: f64, count: usize| {
            (from.max(0.0) as usize)..((to + 1.0).clamp(0.0, count as f64) as usize)
        };
        range(first.z, last.z, counts[2]).flat_map(move |z| {
            range(first.y, last.y, counts[1])
                .flat_map(move |y| range(first.x, last.x, counts[0]).map(move |x| (z * counts[1] + y) * counts[0] + x))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_give_every_triangle_whose_box_is_met() {
        let boxes: Vec<_> = (0..10).map(|k| (DVec3::splat(f64::from(k)), DVec3::splat(f64::from(k) + 0.5))).collect();
        let cells = Cells::new(&boxes);
        let near = |at: f64| cells.near(DVec3::splat(at), DVec3::splat(at + 0.01)).any(|index| index == at as u32);
        assert!((0..10).all(|k| near(f64::from(k) + 0.2)));
        assert_eq!(cells.near(DVec3::splat(50.0), DVec3::splat(60.0)).count(), 0);
        assert_eq!(cells.near(DVec3::splat(-9.0), DVec3::splat(-8.0)).count(), 0);
        assert!(
            cells.reach(DVec3::splat(9.4), DVec3::splat(60.0)) && !cells.reach(DVec3::splat(9.6), DVec3::splat(60.0))
        );
        assert!(cells.reach(DVec3::splat(-9.0), DVec3::ZERO) && !cells.reach(DVec3::splat(-9.0), DVec3::splat(-0.1)));
        assert!(!Cells::new(&[]).reach(DVec3::ZERO, DVec3::ONE));
        assert_eq!(Cells::new(&[]).near(DVec3::ZERO, DVec3::ONE).count(), 0);
    }
}
