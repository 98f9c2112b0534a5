//! Forward kinematics: where a skeleton's joints are, and how they are turned, in every frame.
//!
//! A joint's place is its parent's place plus its offset in the parent's axes; a position channel replaces the offset
//! along its axis. Its axes are its parent's, turned by its rotation channels in their order: `R = R_first ... R_last`
//! for columns. With rest axes C (Acclaim) the turn is `C R C^T`. Assumes that parents stand before their children.
//!
//! All of a frame's sines and cosines are taken at once: an angle is brought to a turn of at most 45 degrees from the
//! nearest quarter turn, exactly for degrees, where Taylor's series to the 16th power is as good as a double.

use crate::error::{KernelError, check_length};
use glam::{DMat3, DVec3};
use multiversion::multiversion;
use rayon::prelude::*;
use std::f64::consts::PI;

/// What one number of a frame does to its joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Replaces the offset along an axis (0 x, 1 y, 2 z).
    Position(usize),
    /// Turns about an axis.
    Rotation(usize),
}

impl Channel {
    /// The channel with a code: 0, 1, 2 place along x, y, z; 3, 4, 5 turn about them.
    pub fn from_code(code: u8) -> Option<Self> {
        match code {
            0..=2 => Some(Channel::Position(code.into())),
            3..=5 => Some(Channel::Rotation(usize::from(code) - 3)),
            _ => None,
        }
    }

    /// The code that `from_code` takes.
    pub fn code(self) -> u8 {
        match self {
            Channel::Position(axis) => axis as u8,
            Channel::Rotation(axis) => axis as u8 + 3,
        }
    }
}

/// A skeleton at rest and what the numbers of a frame mean.
#[derive(Debug, Clone, Copy)]
pub struct Skeleton<'a> {
    /// Each joint's parent, which stands before it, or -1.
    pub parents: &'a [i32],
    /// Each joint's place in its parent's axes.
    pub offsets: &'a [DVec3],
    /// Each joint's rest axes; empty where they are the parent's.
    pub axes: &'a [DMat3],
    /// How many channels each joint has.
    pub counts: &'a [usize],
    /// The channels, joint by joint.
    pub channels: &'a [Channel],
    /// Whether angles are degrees, else radians.
    pub degrees: bool,
}

impl Skeleton<'_> {
    fn check(&self) -> Result<(), KernelError> {
        let joints = self.parents.len();
        check_length("offsets", joints, self.offsets.len())?;
        check_length("counts", joints, self.counts.len())?;
        check_length("axes", if self.axes.is_empty() { 0 } else { joints }, self.axes.len())?;
        let wanted = self.counts.iter().fold(0usize, |sum, count| sum.saturating_add(*count));
        check_length("channels", wanted, self.channels.len())?;
        if joints == 0 || wanted == 0 {
            return Err(KernelError::Argument { argument: "channels", problem: "want a joint with a channel" });
        }
        let stray = |(joint, parent): (usize, &i32)| *parent < -1 || *parent >= 0 && *parent as usize >= joint;
        match self.parents.iter().enumerate().position(stray) {
            Some(index) => {
                Err(KernelError::Item { argument: "parents", problem: "want -1 or a joint that stands before", index })
            }
            None => Ok(()),
        }
    }

    /// One frame: fills each joint's place and its axes, row by row.
    fn pose(&self, values: &[f64], places: &mut [[f64; 3]], turns: &mut [[f64; 9]], scratch: &mut Scratch) {
        if self.degrees {
            sines_and_cosines(values, &mut scratch.turns);
        } else {
            scratch.turns.iter_mut().zip(values).for_each(|(turn, value)| *turn = value.sin_cos().into());
        }
        let mut column = 0;
        for joint in 0..self.parents.len() {
            let (before, own) = scratch.world.split_at_mut(joint);
            let base = usize::try_from(self.parents[joint]).map_or(&Pose::WORLD, |parent| &before[parent]);
            let mut offset = self.offsets[joint];
            let rest = self.axes.get(joint);
            let mut axes = rest.map_or(base.axes, |rest| base.axes * *rest);
            let end = column + self.counts[joint];
            while column < end {
                match self.channels[column] {
                    Channel::Position(axis) => offset[axis] = values[column],
                    // Much of a body stands still: half of all angles are 0 in many files.
                    Channel::Rotation(_) if values[column] == 0.0 => {}
                    Channel::Rotation(axis) => turn(&mut axes, axis, scratch.turns[column]),
                }
                column += 1;
            }
            let axes = rest.map_or(axes, |rest| axes * rest.transpose());
            let place = base.place + base.axes * offset;
            own[0] = Pose { place, axes };
            places[joint] = place.to_array();
            turns[joint] = axes.transpose().to_cols_array();
        }
    }
}

#[derive(Clone, Copy)]
struct Pose {
    place: DVec3,
    axes: DMat3,
}

impl Pose {
    const WORLD: Self = Pose { place: DVec3::ZERO, axes: DMat3::IDENTITY };
}

/// What one frame needs: the poses so far, sine and cosine of each channel.
#[derive(Clone)]
struct Scratch {
    world: Vec<Pose>,
    turns: Vec<[f64; 2]>,
}

/// 1 / 3!, -1 / 5! and so on: the sine's series behind x - x^3 / 3!.
const SINE: [f64; 7] = series(3);
/// The cosine's behind 1 - x^2 / 2!.
const COSINE: [f64; 7] = series(4);

/// Coefficients 1 / n!, -1 / (n + 2)!, ... from the highest down.
const fn series(first: u64) -> [f64; 7] {
    let (mut found, mut index) = ([0.0; 7], 0);
    while index < 7 {
        let (mut factorial, mut n) = (1.0, first + 2 * index as u64);
        while n > 1 {
            factorial *= n as f64;
            n -= 1;
        }
        found[6 - index] = if index % 2 == 0 { 1.0 / factorial } else { -1.0 / factorial };
        index += 1;
    }
    found
}

/// The polynomial of seven coefficients, the highest first. Written out: a loop is not always unrolled, and then not
/// worked for several angles at a time.
#[inline(always)]
fn horner(c: &[f64; 7], x: f64) -> f64 {
    (((((c[0] * x + c[1]) * x + c[2]) * x + c[3]) * x + c[4]) * x + c[5]) * x + c[6]
}

/// Sine and cosine of angles in degrees, without branches so that several are worked at a time.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn sines_and_cosines(degrees: &[f64], out: &mut [[f64; 2]]) {
    for (turn, angle) in out.iter_mut().zip(degrees) {
        let quarters = (angle * (1.0 / 90.0)).round_ties_even();
        let x = (angle - quarters * 90.0) * (PI / 180.0);
        let square = x * x;
        let (sine, cosine) = (horner(&SINE, square), horner(&COSINE, square));
        let sine = x - x * square * sine;
        let cosine = 1.0 - (0.5 * square - square * square * cosine);
        // The quarter turn, 0 to 3: of odd ones sine and cosine change places, then signs.
        let quarter = quarters - 4.0 * (quarters * 0.25).floor();
        let is_odd = quarter == 1.0 || quarter == 3.0;
        let (s, c) = if is_odd { (cosine, sine) } else { (sine, cosine) };
        *turn = [if quarter >= 2.0 { -s } else { s }, if quarter == 1.0 || quarter == 2.0 { -c } else { c }];
    }
}

/// Turns axes about one of their own by an angle's sine and cosine: `axes R(axis, angle)`.
#[inline(always)]
fn turn(axes: &mut DMat3, axis: usize, [sine, cosine]: [f64; 2]) {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *axes;
    match axis {
        0 => (axes.y_axis, axes.z_axis) = (y * cosine + z * sine, z * cosine - y * sine),
        1 => (axes.z_axis, axes.x_axis) = (z * cosine + x * sine, x * cosine - z * sine),
        _ => (axes.x_axis, axes.y_axis) = (x * cosine + y * sine, y * cosine - x * sine),
    }
}

/// Fills the joints' world positions (frames x joints) and rotations, row by row, from `values` (frames x channels).
///
/// Frames are worked in parallel; each depends on its own values only.
pub fn forward_kinematics(
    skeleton: &Skeleton,
    values: &[f64],
    positions: &mut [[f64; 3]],
    rotations: &mut [[f64; 9]],
) -> Result<(), KernelError> {
    skeleton.check()?;
    let (joints, width) = (skeleton.parents.len(), skeleton.channels.len());
    let frames = values.len() / width;
    check_length("values", frames * width, values.len())?;
    check_length("positions", frames * joints, positions.len())?;
    check_length("rotations", frames * joints, rotations.len())?;
    let mut start = Scratch { world: vec![Pose::WORLD; joints], turns: vec![[0.0; 2]; width] };
    if rayon::current_num_threads() == 1 {
        // Without the wait for another thread.
        let frames = positions.chunks_mut(joints).zip(rotations.chunks_mut(joints)).zip(values.chunks(width));
        frames.for_each(|((places, turns), values)| skeleton.pose(values, places, turns, &mut start));
        return Ok(());
    }
    let work = positions.par_chunks_mut(joints).zip(rotations.par_chunks_mut(joints)).zip(values.par_chunks(width));
    work.with_min_len(32).for_each_init(
        || start.clone(),
        |scratch, ((places, turns), values)| skeleton.pose(values, places, turns, scratch),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: &[f64], wanted: &[f64]) {
        assert!(got.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{got:?} {wanted:?}");
    }

    const CHAIN: [i32; 3] = [-1, 0, 1];

    fn run(channels: &[Channel], counts: &[usize], axes: &[DMat3], values: &[f64]) -> (Vec<[f64; 3]>, Vec<[f64; 9]>) {
        let offsets = [DVec3::ZERO, DVec3::X, DVec3::X];
        let skeleton = Skeleton { parents: &CHAIN, offsets: &offsets, axes, counts, channels, degrees: true };
        let (mut places, mut turns) = (vec![[0.0; 3]; 3], vec![[0.0; 9]; 3]);
        assert_eq!(forward_kinematics(&skeleton, values, &mut places, &mut turns), Ok(()));
        (places, turns)
    }

    #[test]
    fn channels_turn_in_their_order_and_positions_replace_offsets() {
        use Channel::{Position, Rotation};
        let (places, turns) =
            run(&[Position(1), Rotation(2), Rotation(0), Position(0)], &[3, 0, 1], &[], &[5.0, 90.0, 90.0, 3.0]);
        near(&places[0], &[0.0, 5.0, 0.0]);
        near(&places[1], &[0.0, 6.0, 0.0]);
        near(&places[2], &[0.0, 9.0, 0.0]);
        near(&turns[2], &[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn sines_and_cosines_are_the_librarys_and_exact_at_quarter_turns() {
        let angles: Vec<f64> = (-40_000..40_000).map(|step| f64::from(step) * 0.0371).collect();
        let mut turns = vec![[0.0; 2]; angles.len()];
        sines_and_cosines(&angles, &mut turns);
        for (angle, turn) in angles.iter().zip(&turns) {
            let (sine, cosine) = (angle % 360.0).to_radians().sin_cos();
            assert!((turn[0] - sine).abs() < 1e-15 && (turn[1] - cosine).abs() < 1e-15, "{angle} {turn:?}");
        }
        let mut exact = [[0.0; 2]; 5];
        sines_and_cosines(&[0.0, 90.0, 180.0, -90.0, 36e10], &mut exact);
        assert_eq!(exact, [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0], [0.0, 1.0]]);
    }

    #[test]
    fn rest_axes_say_about_what_a_joint_turns() {
        let swap = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
        let (places, _) = run(&[Channel::Rotation(1)], &[1, 0, 0], &[swap; 3], &[90.0]);
        near(&places[2], &[0.0, 2.0, 0.0]);
    }

    #[test]
    fn a_parent_behind_its_child_is_refused() {
        let offsets = [DVec3::ZERO; 2];
        let channels = [Channel::Rotation(0)];
        let skeleton = Skeleton {
            parents: &[-1, 1],
            offsets: &offsets,
            axes: &[],
            counts: &[1, 0],
            channels: &channels,
            degrees: false,
        };
        let got = forward_kinematics(&skeleton, &[0.0], &mut [[0.0; 3]; 2], &mut [[0.0; 9]; 2]);
        assert!(matches!(got, Err(KernelError::Item { argument: "parents", index: 1, .. })));
    }
}
