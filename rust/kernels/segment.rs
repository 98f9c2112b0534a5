//! Limb labels of a stick figure from its dark pixels.
//!
//! Jain, Sheikh, Mahler, Hodgins 2010, section 3.3.1: "for stick figures, we segment out the dark pixels by
//! thresholding inside an oriented window along the limb". A limb's window is the rectangle along its two markers, as
//! wide as its line may be; assumes finite markers.

use crate::error::{KernelError, check_length};
use glam::DVec2;
use rayon::prelude::*;
use std::ops::{Range, RangeInclusive};

/// The oriented window of one limb. A limb of no length has a disc.
struct Window {
    origin: DVec2,
    along: DVec2,
    length: f64,
    half_width: f64,
}

impl Window {
    fn new([a, b]: [DVec2; 2], half_width: f64) -> Self {
        let along = b - a;
        Window { origin: a, along, length: along.length(), half_width }
    }

    /// The pixel's squared distance from the limb, when it lies inside the window (borders belong to it). Without a
    /// root, so that places on whole pixels compare exactly.
    fn squared_distance(&self, pixel: DVec2) -> Option<f64> {
        let offset = pixel - self.origin;
        let squared = if self.length == 0.0 {
            offset.length_squared()
        } else {
            let (along, whole) = (offset.dot(self.along), self.along.length_squared());
            if along < 0.0 || along > whole {
                return None;
            }
            self.along.perp_dot(offset).powi(2) / whole
        };
        (squared <= self.half_width * self.half_width).then_some(squared)
    }

    /// The rows that the window may touch.
    fn rows(&self) -> RangeInclusive<f64> {
        let across =
            if self.length > 0.0 { self.half_width * self.along.x.abs() / self.length } else { self.half_width };
        let (top, bottom) =
            (self.origin.y.min(self.origin.y + self.along.y), self.origin.y.max(self.origin.y + self.along.y));
        top - across - 1.0..=bottom + across + 1.0
    }

    /// The columns of a row that may lie inside: the strip between the ends cut with the strip beside the axis.
    /// One pixel is added on both sides, so that rounding never loses one; `squared_distance` decides.
    fn columns(&self, row: usize, width: usize) -> Range<usize> {
        let y = row as f64 - self.origin.y;
        let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut cut = |at_zero: f64, slope: f64, low: f64, high: f64| {
            if slope != 0.0 {
                let (a, b) = ((low - at_zero) / slope, (high - at_zero) / slope);
                (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
            }
        };
        if self.length == 0.0 {
            cut(0.0, 1.0, -self.half_width, self.half_width);
        } else {
            let reach = self.half_width * self.length;
            cut(y * self.along.y, self.along.x, 0.0, self.along.length_squared());
            cut(y * self.along.x, -self.along.y, -reach, reach);
        }
        let (first, last) = ((first + self.origin.x - 1.0).floor(), (last + self.origin.x + 2.0).ceil());
        first as usize..(last as usize).min(width)
    }
}

/// Labels the dark pixels (below `threshold`) inside the limbs' windows: 0 none, v + 1 limb v.
///
/// `gray` and `out` are row-major with `width` columns; `half_widths` holds one number a limb, pixels from the axis. A
/// pixel in several windows belongs to the nearest limb, the earlier one of equally near ones. Rows are worked in
/// parallel.
pub fn segment_stick_figure(
    gray: &[u8],
    width: usize,
    ends: &[[DVec2; 2]],
    half_widths: &[f64],
    threshold: u16,
    out: &mut [u8],
) -> Result<(), KernelError> {
    check_length("out", gray.len(), out.len())?;
    check_length("half_width", ends.len(), half_widths.len())?;
    if ends.len() > usize::from(u8::MAX) {
        return Err(KernelError::Argument { argument: "ends", problem: "labels of 8 bits hold 255 limbs at most" });
    }
    if width == 0 {
        return Ok(());
    }
    let windows: Vec<Window> = ends.iter().zip(half_widths).map(|(ends, half)| Window::new(*ends, *half)).collect();
    let rows = out.par_chunks_mut(width).zip(gray.par_chunks(width)).enumerate();
    rows.for_each_init(
        || vec![f64::INFINITY; width],
        |nearest, (row, (out, gray))| segment_row(row, gray, &windows, threshold, nearest, out),
    );
    Ok(())
}

fn segment_row(row: usize, gray: &[u8], windows: &[Window], threshold: u16, nearest: &mut [f64], out: &mut [u8]) {
    out.fill(0);
    nearest.fill(f64::INFINITY);
    for (label, window) in (1u8..).zip(windows) {
        if !window.rows().contains(&(row as f64)) {
            continue;
        }
        for column in window.columns(row, gray.len()) {
            if u16::from(gray[column]) < threshold
                && let Some(distance) = window.squared_distance(DVec2::new(column as f64, row as f64))
                && distance < nearest[column]
            {
                (nearest[column], out[column]) = (distance, label);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ends: &[[DVec2; 2]], half: f64, width: usize, height: usize) -> Vec<u8> {
        let mut out = vec![9; width * height];
        let gray = vec![0; width * height];
        assert_eq!(segment_stick_figure(&gray, width, ends, &vec![half; ends.len()], 128, &mut out), Ok(()));
        out
    }

    #[test]
    fn window_includes_its_borders_and_nothing_beyond() {
        let out = labels(&[[DVec2::new(1., 2.), DVec2::new(4., 2.)]], 1.0, 6, 5);
        let row = [0, 1, 1, 1, 1, 0];
        assert_eq!(out, [[0; 6], row, row, row, [0; 6]].concat());
    }

    #[test]
    fn limb_of_no_length_is_a_disc() {
        assert_eq!(labels(&[[DVec2::ONE; 2]], 1.0, 3, 3), [0, 1, 0, 1, 1, 1, 0, 1, 0]);
    }

    #[test]
    fn nearest_limb_wins_and_ties_go_to_the_earlier() {
        let bars = [[DVec2::new(0., 0.), DVec2::new(0., 1.)], [DVec2::new(4., 0.), DVec2::new(4., 1.)]];
        assert_eq!(labels(&bars, 4.0, 5, 1), [1, 1, 1, 2, 2]);
    }

    #[test]
    fn row_ranges_lose_no_pixel_of_a_slanted_window() {
        let ends = [DVec2::new(3.3, 20.1), DVec2::new(22.7, 4.9)];
        let window = Window::new(ends, 3.7);
        let out = labels(&[ends], 3.7, 26, 26);
        for (i, label) in out.iter().enumerate() {
            let inside = window.squared_distance(DVec2::new((i % 26) as f64, (i / 26) as f64)).is_some();
            assert_eq!(*label == 1, inside, "pixel {i}");
        }
    }

    #[test]
    fn only_pixels_below_the_threshold_count() {
        let mut out = [9; 3];
        let ends = [[DVec2::ZERO, DVec2::new(2., 0.)]];
        assert_eq!(segment_stick_figure(&[127, 128, 255], 3, &ends, &[1.0], 128, &mut out), Ok(()));
        assert_eq!(out, [1, 0, 0]);
    }
}
