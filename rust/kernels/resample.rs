//! A premultiplied picture seen through a camera that pans, zooms and turns over it: what every film pixel shows.
//!
//! Keys 1981 ("Cubic convolution interpolation for digital image processing", equation 15 with a = -1/2) in each of the
//! picture's axes, widened by the reduction where the camera sees more than there are film pixels. What the filter would
//! put above or below all pixels next to the place is cut off: ink gets no halos, and coverage stays between 0 and 1. At
//! places on pixel centres the weights are exactly 0 and 1, so that whole pixels and quarter turns copy. Beyond the
//! paper nothing covers; its edge is as soft as a film pixel is wide.

use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// A camera's view: film pixel (x, y) shows the place `[v0 x + v1 y + v2, v3 x + v4 y + v5]` of the picture.
pub type View = [f64; 6];

fn place(view: &View, column: usize, row: usize) -> [f64; 2] {
    let (x, y) = (column as f64, row as f64);
    [view[0] * x + view[1] * y + view[2], view[3] * x + view[4] * y + view[5]]
}

/// Which pixels of one axis count at a place, and how much; the outermost ones go on outwards.
struct Taps {
    pixels: Vec<usize>,
    weights: Vec<f32>,
    /// Those next to the place, as indices into both.
    near: std::ops::Range<usize>,
}

impl Taps {
    fn new(reach: f64) -> Self {
        let most = 4 * reach.ceil() as usize + 2;
        Self { pixels: Vec::with_capacity(most), weights: Vec::with_capacity(most), near: 0..0 }
    }

    fn put(&mut self, place: f64, reach: f64, count: usize) {
        if reach == 1.0 {
            return self.put_four(place, count);
        }
        let begin = |distance: f64| (place - distance).floor() as i64 + 1;
        let end = |distance: f64| (place + distance).ceil() as i64;
        let (first, last) = (begin(2.0 * reach), end(2.0 * reach));
        self.near = (begin(reach) - first) as usize..(end(reach) - first) as usize;
        self.pixels.clear();
        self.pixels.extend((first..last).map(|pixel| pixel.clamp(0, count as i64 - 1) as usize));
        self.weights.clear();
        self.weights.extend((first..last).map(|pixel| keys((pixel as f64 - place) / reach) as f32));
        let sum: f32 = self.weights.iter().sum();
        self.weights.iter_mut().for_each(|weight| *weight /= sum);
    }

    /// Without a reduction: four pixels, whose weights are exactly 0, 1, 0, 0 on a pixel's centre.
    fn put_four(&mut self, place: f64, count: usize) {
        let (before, last) = (place.floor(), count as i64 - 1);
        let t = (place - before) as f32;
        let weights = [
            ((-0.5 * t + 1.0) * t - 0.5) * t,
            (1.5 * t - 2.5) * t * t + 1.0,
            ((-1.5 * t + 2.0) * t + 0.5) * t,
            (0.5 * t - 0.5) * t * t,
        ];
        self.weights.clear();
        self.weights.extend(weights);
        self.pixels.clear();
        self.pixels.extend([-1, 0, 1, 2].map(|step| (before as i64 + step).clamp(0, last) as usize));
        self.near = 1..if t > 0.0 { 3 } else { 2 };
    }
}

fn keys(distance: f64) -> f64 {
    let x = distance.abs();
    if x < 1.0 {
        (1.5 * x - 2.5) * x * x + 1.0
    } else if x < 2.0 {
        ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0
    } else {
        0.0
    }
}

/// Writes film pixels `out`, rows of `film_width`, of the premultiplied `picture`, rows of `width`.
///
/// Not generic, so that all of it is compiled together: three times as quick as from another crate.
pub fn resample_rgba(
    picture: &[[f32; 4]],
    width: usize,
    view: &View,
    out: &mut [[f32; 4]],
    film_width: usize,
) -> Result<(), KernelError> {
    resample(picture, width, view, out, film_width)
}

fn resample<const C: usize>(
    picture: &[[f32; C]],
    width: usize,
    view: &View,
    out: &mut [[f32; C]],
    film_width: usize,
) -> Result<(), KernelError> {
    let height = rows("picture", picture.len(), width)?;
    rows("size", out.len(), film_width)?;
    let scale = scale(view)?;
    let reach = scale.max(1.0);
    out.par_chunks_mut(film_width).enumerate().for_each(|(row, out)| {
        let [mut across, mut down] = [Taps::new(reach), Taps::new(reach)];
        for (column, pixel) in out.iter_mut().enumerate() {
            let [x, y] = place(view, column, row);
            let cover = covered(x, width, scale) * covered(y, height, scale);
            *pixel = [0.0; C];
            if cover > 0.0 {
                across.put(x, reach, width);
                down.put(y, reach, height);
                *pixel = weighed(picture, width, &across, &down).map(|value| value * cover as f32);
            }
        }
    });
    Ok(())
}

/// Writes for every film pixel the index of the nearest pixel, or -1 where nothing known is near or under it.
///
/// A nearest pixel that is not `known` gives way to the nearest known one under the filter's middle.
pub fn nearest(known: &[u8], width: usize, view: &View, out: &mut [i64], film_width: usize) -> Result<(), KernelError> {
    let height = rows("known", known.len(), width)?;
    rows("size", out.len(), film_width)?;
    let reach = scale(view)?.max(1.0);
    out.par_chunks_mut(film_width).enumerate().for_each(|(row, out)| {
        for (column, index) in out.iter_mut().enumerate() {
            let [x, y] = place(view, column, row);
            let at = |x: f64, y: f64| -> Option<usize> {
                let inside = x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64;
                inside.then(|| y as usize * width + x as usize).filter(|&pixel| known[pixel] != 0)
            };
            let found = at((x + 0.5).floor(), (y + 0.5).floor()).or_else(|| closest(x, y, reach, [width, height], at));
            *index = found.map_or(-1, |pixel| pixel as i64);
        }
    });
    Ok(())
}

/// The closest pixel that `at` knows, among those less than `reach` away along both axes.
fn closest(x: f64, y: f64, reach: f64, size: [usize; 2], at: impl Fn(f64, f64) -> Option<usize>) -> Option<usize> {
    let [columns, rows] = [(x, size[0]), (y, size[1])].map(|(place, count)| {
        let first = (place - reach).floor().max(-1.0) as i64 + 1;
        first..(place + reach).ceil().clamp(0.0, count as f64) as i64
    });
    let (mut found, mut least) = (None, f64::INFINITY);
    for row in rows {
        for column in columns.clone() {
            let away = (column as f64 - x).hypot(row as f64 - y);
            if away < least
                && let Some(pixel) = at(column as f64, row as f64)
            {
                (found, least) = (Some(pixel), away);
            }
        }
    }
    found
}

fn rows(argument: &'static str, length: usize, width: usize) -> Result<usize, KernelError> {
    let count = length.checked_div(width).unwrap_or(0);
    check_length(argument, (count * width).max(1), length)?;
    Ok(count)
}

/// How many of the picture's pixels a film pixel is wide.
fn scale(view: &View) -> Result<f64, KernelError> {
    let scale = (view[0] * view[4] - view[1] * view[3]).abs().sqrt();
    if view.iter().all(|value| value.is_finite()) && scale > 0.0 && scale.is_finite() {
        return Ok(scale);
    }
    Err(KernelError::Argument { argument: "view", problem: "want a finite view that can be turned back" })
}

/// How much of a film pixel `scale` wide lies on the paper, along one axis.
fn covered(place: f64, count: usize, scale: f64) -> f64 {
    let inside = (place + 0.5).min(count as f64 - 0.5 - place);
    (0.5 + inside / scale).clamp(0.0, 1.0)
}

fn weighed<const C: usize>(picture: &[[f32; C]], width: usize, across: &Taps, down: &Taps) -> [f32; C] {
    let mut sum = [0.0f32; C];
    let (mut low, mut high) = ([f32::INFINITY; C], [f32::NEG_INFINITY; C]);
    for (place, (&row, &share)) in down.pixels.iter().zip(&down.weights).enumerate() {
        let line = &picture[row * width..][..width];
        for (&column, &weight) in across.pixels.iter().zip(&across.weights) {
            let part = share * weight;
            for (sum, &value) in sum.iter_mut().zip(&line[column]) {
                *sum += part * value;
            }
        }
        if down.near.contains(&place) {
            for &column in &across.pixels[across.near.clone()] {
                for ((low, high), &value) in low.iter_mut().zip(&mut high).zip(&line[column]) {
                    (*low, *high) = (low.min(value), high.max(value));
                }
            }
        }
    }
    std::array::from_fn(|channel| sum[channel].max(low[channel]).min(high[channel]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAMP: [[f32; 1]; 6] = [[0.0], [1.0], [2.0], [3.0], [4.0], [5.0]];

    fn seen(view: [f64; 6], film: (usize, usize)) -> Result<Vec<f32>, KernelError> {
        let mut out = vec![[-1.0]; film.0 * film.1];
        resample(&RAMP, 3, &view, &mut out, film.0)?;
        Ok(out.into_iter().flatten().collect())
    }

    #[test]
    fn whole_pixels_and_quarter_turns_copy() -> Result<(), KernelError> {
        assert_eq!(seen([1.0, 0.0, 1.0, 0.0, 1.0, 0.0], (3, 2))?, [1.0, 2.0, 0.0, 4.0, 5.0, 0.0]);
        assert_eq!(seen([0.0, 1.0, 0.0, -1.0, 0.0, 1.0], (2, 3))?, [3.0, 0.0, 4.0, 1.0, 5.0, 2.0]);
        Ok(())
    }

    #[test]
    fn the_filter_is_keys_cubic_and_never_leaves_its_neighbours() -> Result<(), KernelError> {
        let line = [[0.0f32], [0.0], [1.0], [1.0], [0.0], [0.0]];
        let mut out = [[0.0f32]; 2];
        resample(&line, 6, &[1.0, 0.0, 1.25, 0.0, 1.0, 0.0], &mut out[..1], 1)?;
        // 0.25 from pixel 1: -9, 111, 29 and -3 of 128.
        assert!((out[0][0] - (29.0 - 3.0) / 128.0).abs() < 1e-6);
        resample(&line, 6, &[1.0, 0.0, 2.5, 0.0, 1.0, 0.0], &mut out[..1], 1)?;
        assert_eq!(out[0][0], 1.0);
        Ok(())
    }

    #[test]
    fn a_reduction_is_a_mean_and_the_paper_ends() -> Result<(), KernelError> {
        let flat = vec![[0.5f32, 1.0]; 40 * 40];
        let mut out = vec![[9.0f32, 9.0]; 30];
        resample(&flat, 40, &[4.0, 0.0, 1.5, 0.0, 4.0, 1.5], &mut out, 15)?;
        for pixel in &out[..10] {
            assert!((pixel[0] - 0.5).abs() < 1e-6 && (pixel[1] - 1.0).abs() < 1e-6);
        }
        assert_eq!(out[10], [0.0, 0.0]);
        resample(&flat, 40, &[4.0, 0.0, -0.5, 0.0, 4.0, 1.5], &mut out, 15)?;
        assert_eq!(out[0], [0.25, 0.5]);
        Ok(())
    }

    #[test]
    fn the_nearest_pixel_counts_and_else_the_nearest_known_one() -> Result<(), KernelError> {
        let known = [1, 0, 0, 1, 1, 0];
        let mut out = [9; 4];
        nearest(&known, 6, &[1.0, 0.0, -1.6, 0.0, 1.0, 0.0], &mut out, 4)?;
        assert_eq!(out, [-1, 0, 0, -1]);
        nearest(&known, 6, &[1.0, 0.0, 2.25, 0.0, 1.0, 0.0], &mut out, 4)?;
        assert_eq!(out, [3, 3, 4, -1]);
        // A film pixel as wide as three of them sees farther.
        nearest(&known, 6, &[3.0, 0.0, 1.75, 0.0, 3.0, 0.0], &mut out[..2], 2)?;
        assert_eq!(out[..2], [3, 4]);
        assert!(nearest(&known, 4, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &mut out, 4).is_err());
        Ok(())
    }

    #[test]
    fn what_is_no_view_is_refused() {
        for view in [[0.0; 6], [1.0, 0.0, f64::NAN, 0.0, 1.0, 0.0], [1.0, 1.0, 0.0, 1.0, 1.0, 0.0]] {
            assert!(seen(view, (3, 2)).is_err());
        }
        let mut out = [[0.0f32]; 5];
        assert!(resample(&RAMP, 4, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &mut out, 5).is_err());
        assert!(resample(&RAMP, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &mut out, 2).is_err());
        assert!(resample(&RAMP, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &mut out, 0).is_err());
    }
}
