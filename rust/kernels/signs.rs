//! Which way limbs point, towards the camera or away, over a whole sequence; and how well a length explains it.
//!
//! A limb of known length that is drawn foreshortened has two depths of equal size (Taylor 2000). The signs are chosen
//! together for all frames by dynamic programming over pairs of frames: motion without jolts, near the clip. Lengths
//! that are not known are compared by the same cost, as the likelihood of what was drawn. Assumes metres.

use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// A clip that is this many deviations off (squared) says nothing more about the sign.
const CLIP_CAP: f64 = 4.0;
/// How much of the variance of independent marks is left in marks smoothed over time.
const NOISE_SHARE: f64 = 0.5;
/// How much of the normalising constant of noisy jolts counts: they are not independent between frames.
const NORMALISER: f64 = 0.7;
/// No limb is drawn truer than to this part of its length.
const LEAST_ERROR: f64 = 0.003;
/// A mark too far out for a length (squared deviations) is an outlier and says nothing more.
const OUTLIER_CAP: f64 = 9.0;

/// One limb over all frames.
#[derive(Clone, Copy)]
pub struct Track<'a> {
    /// Drawn lengths, across the view, metres.
    pub planar: &'a [f64],
    /// The clip's depth from the limb's first end to its second, metres.
    pub clip: &'a [f64],
    /// Deviation of the drawn lengths, metres.
    pub noise: &'a [f64],
    /// Usual size of a second difference of the depth, metres, positive.
    pub jolt: f64,
    /// Deviation of the clip's depths from the drawn figure's, metres, positive.
    pub doubt: f64,
}

/// Depths of all limbs: `tracks` per limb, `lengths` and `out` limb by limb, one number a frame.
pub fn limb_depths(tracks: &[Track], lengths: &[f64], out: &mut [f64]) -> Result<(), KernelError> {
    let frames = check_tracks(tracks)?;
    check_length("lengths", tracks.len() * frames, lengths.len())?;
    check_length("out", lengths.len(), out.len())?;
    if frames == 0 {
        return Ok(());
    }
    let limbs = tracks.par_iter().zip(lengths.par_chunks(frames)).zip(out.par_chunks_mut(frames));
    limbs.for_each(|((track, lengths), out)| {
        let mut choices = vec![0; frames];
        let (_, last) = Pass::new(track, |frame| lengths[frame]).run(Some(&mut choices));
        trace(&choices, last, track, lengths, out);
    });
    Ok(())
}

/// Minus twice the logarithm of the likelihood of every limb's drawn lengths, for each of its candidate lengths.
pub fn length_costs(tracks: &[Track], candidates: &[f64], out: &mut [f64]) -> Result<(), KernelError> {
    let frames = check_tracks(tracks)?;
    check_length("out", candidates.len(), out.len())?;
    if frames == 0 || candidates.is_empty() {
        out.fill(0.0);
        return Ok(());
    }
    let each = candidates.len() / tracks.len();
    check_length("candidates", tracks.len() * each, candidates.len())?;
    let rows = out.par_iter_mut().zip(candidates).enumerate();
    rows.for_each(|(index, (cost, &length))| *cost = Pass::new(&tracks[index / each], |_| length).likelihood());
    Ok(())
}

fn check_tracks(tracks: &[Track]) -> Result<usize, KernelError> {
    let frames = tracks.first().map_or(0, |track| track.planar.len());
    for track in tracks {
        check_length("planar", frames, track.planar.len())?;
        check_length("clip", frames, track.clip.len())?;
        check_length("noise", frames, track.noise.len())?;
    }
    Ok(frames)
}

/// One limb with its length in every frame.
struct Pass<'a, L: Fn(usize) -> f64> {
    track: &'a Track<'a>,
    length: L,
}

/// What one frame says: the size of the depth, its variance from the marks' noise, and the clip's cost of each sign.
#[derive(Clone, Copy, Default)]
struct Frame {
    depth: f64,
    variance: f64,
    clip: [f64; 2],
}

impl<'a, L: Fn(usize) -> f64> Pass<'a, L> {
    fn new(track: &'a Track<'a>, length: L) -> Self {
        Pass { track, length }
    }

    fn frame(&self, index: usize) -> Frame {
        let (planar, noise, length) = (self.track.planar[index], self.track.noise[index], (self.length)(index));
        let squared = (length * length - planar * planar).max(0.0);
        // The slope of the depth in the drawn length is planar / depth; near the picture plane noise bounds it.
        let variance = (noise * planar).powi(2) / squared.max(2.0 * noise * length).max(1e-12);
        let (depth, spread) = (squared.sqrt(), self.track.doubt.powi(2) + variance);
        let clip = [-depth, depth].map(|depth| ((depth - self.track.clip[index]).powi(2) / spread).min(CLIP_CAP));
        Frame { depth, variance, clip }
    }

    /// The least cost of all choices of signs, and the signs of the last two frames (earlier in bit 1). `choices`
    /// takes, a frame, one bit for each pair of the two signs before: the sign before those.
    fn run(&self, mut choices: Option<&mut [u8]>) -> (f64, usize) {
        let count = self.track.planar.len();
        let mut first = self.frame(0);
        if count == 1 {
            let sign = usize::from(first.clip[1] <= first.clip[0]);
            return (first.clip[sign], sign);
        }
        let mut second = self.frame(1);
        let mut cost = [0, 1, 2, 3].map(|pair: usize| first.clip[pair >> 1] + second.clip[pair & 1]);
        let (least, mut constant) = (self.track.jolt * self.track.jolt, Product::default());
        for index in 2..count {
            let third = self.frame(index);
            let noise = third.variance + 4.0 * second.variance + first.variance;
            let spread = least + NOISE_SHARE * noise;
            constant.times(spread / least);
            // Three signs that are all turned jolt alike: pairs 2 and 3 see those of 1 and 0 with the first sign turned.
            let jolt = |pair: usize, sign: usize| {
                let jolt =
                    signed(third.depth, pair & 1) - 2.0 * signed(second.depth, pair >> 1) + signed(first.depth, sign);
                2.0 * ((1.0 + jolt * jolt / spread).sqrt() - 1.0)
            };
            let jolts = [[jolt(0, 0), jolt(0, 1)], [jolt(1, 0), jolt(1, 1)]];
            let mut choice = 0;
            let next = [0, 1, 2, 3].map(|pair: usize| {
                let (middle, last) = (pair >> 1, pair & 1);
                let [low, high] = if middle == 0 { jolts[pair] } else { [jolts[3 - pair][1], jolts[3 - pair][0]] };
                let (low, high) = (cost[middle] + low, cost[2 | middle] + high);
                choice |= u8::from(high < low) << pair;
                low.min(high) + third.clip[last]
            });
            if let Some(choices) = choices.as_deref_mut() {
                choices[index] = choice;
            }
            (first, second, cost) = (second, third, next);
        }
        let last = (0..4).fold(0, |best, pair| if cost[pair] < cost[best] { pair } else { best });
        (cost[last] + NORMALISER * constant.logarithm(), last)
    }

    /// The cost of the best signs as a density of drawn lengths rather than of depths.
    fn likelihood(&self) -> f64 {
        let (mut beyond, mut slopes) = (0.0, Product::default());
        for (index, (planar, noise)) in self.track.planar.iter().zip(self.track.noise).enumerate() {
            let length = (self.length)(index).max(1e-12);
            let error = noise.max(LEAST_ERROR * length);
            beyond += ((planar - length).max(0.0) / error).powi(2).min(OUTLIER_CAP);
            slopes.times((1.0 - (planar / length).powi(2)).max(2.0 * error / length));
        }
        self.run(None).0 + beyond + slopes.logarithm()
    }
}

/// The logarithm of a long product, taken in few pieces.
struct Product {
    logarithm: f64,
    factors: f64,
}

impl Default for Product {
    fn default() -> Self {
        Product { logarithm: 0.0, factors: 1.0 }
    }
}

impl Product {
    fn times(&mut self, factor: f64) {
        self.factors *= factor;
        if !(1e-200..1e200).contains(&self.factors) {
            self.logarithm += self.factors.ln();
            self.factors = 1.0;
        }
    }

    fn logarithm(&self) -> f64 {
        self.logarithm + self.factors.ln()
    }
}

fn signed(depth: f64, sign: usize) -> f64 {
    if sign == 1 { depth } else { -depth }
}

/// Follows the choices back from the last pair of signs.
fn trace(choices: &[u8], last: usize, track: &Track, lengths: &[f64], out: &mut [f64]) {
    let depth = |frame: usize| (lengths[frame].powi(2) - track.planar[frame].powi(2)).max(0.0).sqrt();
    let mut pair = last;
    for frame in (0..out.len()).rev() {
        out[frame] = signed(depth(frame), pair & 1);
        let before = if frame >= 2 { choices[frame] >> pair & 1 } else { 0 };
        pair = usize::from(before) << 1 | pair >> 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: f64 = 0.4;

    /// A limb that swings through the picture plane four times.
    fn swing(frames: usize) -> (Vec<f64>, Vec<f64>) {
        let angles = (0..frames).map(|frame| 0.8 * (frame as f64 * 0.13).sin());
        angles.map(|angle| (LENGTH * angle.cos(), LENGTH * angle.sin())).unzip()
    }

    fn track<'a>(planar: &'a [f64], clip: &'a [f64], noise: &'a [f64]) -> Track<'a> {
        Track { planar, clip, noise, jolt: 0.002, doubt: 0.2 }
    }

    #[test]
    fn signs_follow_the_motion_where_the_clip_hardly_says() {
        let (planar, depth) = swing(100);
        let (clip, noise) = (depth.iter().map(|depth| 0.1 * depth + 0.02).collect::<Vec<_>>(), vec![1e-5; 100]);
        let mut out = vec![0.0; 100];
        assert_eq!(limb_depths(&[track(&planar, &clip, &noise)], &[LENGTH; 100], &mut out), Ok(()));
        assert!(out.iter().zip(&depth).all(|(got, want)| (got - want).abs() < 1e-6));
    }

    #[test]
    fn one_and_two_frames_take_the_clips_sign() {
        let mut out = [0.0; 2];
        for frames in 1..=2 {
            let tracks = [track(&[0.0; 2][..frames], &[-0.3, 0.3][..frames], &[0.0; 2][..frames])];
            assert_eq!(limb_depths(&tracks, &[LENGTH; 2][..frames], &mut out[..frames]), Ok(()));
            assert_eq!(out[..frames], [-LENGTH, LENGTH][..frames]);
        }
    }

    #[test]
    fn the_true_length_costs_least() {
        let (planar, depth) = swing(100);
        let (noise, candidates) = (vec![1e-4; 100], [0.38, 0.39, LENGTH, 0.41, 0.43, 0.47]);
        let mut costs = [0.0; 6];
        assert_eq!(length_costs(&[track(&planar, &depth, &noise)], &candidates, &mut costs), Ok(()));
        assert!(costs.iter().enumerate().all(|(index, cost)| index == 2 || *cost > costs[2]), "{costs:?}");
    }

    #[test]
    fn sizes_are_checked() {
        let got = limb_depths(&[track(&[0.0; 2], &[0.0; 2], &[0.0; 1])], &[1.0; 2], &mut [0.0; 2]);
        assert!(matches!(got, Err(KernelError::Length { argument: "noise", .. })));
        let got = length_costs(&[track(&[0.0; 2], &[0.0; 2], &[0.0; 2])], &[1.0; 2], &mut [0.0; 1]);
        assert!(matches!(got, Err(KernelError::Length { argument: "out", .. })));
    }
}
