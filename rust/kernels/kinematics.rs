//! Forward kinematics: where a skeleton's joints are, and how they are turned, in every frame.
//!
//! A joint's place is its parent's place plus its offset in the parent's axes; a position channel replaces the offset
//! along its axis. Its axes are its parent's, turned by its rotation channels in their order: `R = R_first ... R_last`
//! for columns. With rest axes C (Acclaim) the turn is `C R C^T`. Assumes that parents stand before their children.

use crate::error::{KernelError, check_length};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

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
    /// Radians in one unit of angle.
    pub angle: f64,
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

    /// One frame: fills each joint's place and its axes, as columns.
    fn pose(&self, values: &[f64], places: &mut [[f64; 3]], turns: &mut [[f64; 9]], world: &mut [Pose]) {
        let mut next = 0;
        for joint in 0..self.parents.len() {
            let mut offset = self.offsets[joint];
            let parent = usize::try_from(self.parents[joint]).ok().map(|parent| world[parent]);
            let base = parent.unwrap_or(Pose { place: DVec3::ZERO, axes: DMat3::IDENTITY });
            let rest = self.axes.get(joint);
            let mut axes = rest.map_or(base.axes, |rest| base.axes * *rest);
            for column in next..next + self.counts[joint] {
                match self.channels[column] {
                    Channel::Position(axis) => offset[axis] = values[column],
                    Channel::Rotation(axis) => turn(&mut axes, axis, values[column] * self.angle),
                }
            }
            next += self.counts[joint];
            let axes = rest.map_or(axes, |rest| axes * rest.transpose());
            let place = base.place + base.axes * offset;
            world[joint] = Pose { place, axes };
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

/// Turns axes about one of their own: `axes R(axis, angle)`.
#[inline(always)]
fn turn(axes: &mut DMat3, axis: usize, angle: f64) {
    let (sine, cosine) = angle.sin_cos();
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    let (from_b, from_c) = (axes.col(b), axes.col(c));
    *axes.col_mut(b) = from_b * cosine + from_c * sine;
    *axes.col_mut(c) = from_c * cosine - from_b * sine;
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
    let work = positions.par_chunks_mut(joints).zip(rotations.par_chunks_mut(joints)).zip(values.par_chunks(width));
    let start = vec![Pose { place: DVec3::ZERO, axes: DMat3::IDENTITY }; joints];
    work.with_min_len(32).for_each_init(
        || start.clone(),
        |world, ((places, turns), values)| skeleton.pose(values, places, turns, world),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn near(got: &[f64], wanted: &[f64]) {
        assert!(got.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{got:?} {wanted:?}");
    }

    const CHAIN: [i32; 3] = [-1, 0, 1];

    fn run(channels: &[Channel], counts: &[usize], axes: &[DMat3], values: &[f64]) -> (Vec<[f64; 3]>, Vec<[f64; 9]>) {
        let offsets = [DVec3::ZERO, DVec3::X, DVec3::X];
        let skeleton = Skeleton { parents: &CHAIN, offsets: &offsets, axes, counts, channels, angle: PI / 180.0 };
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
            angle: 1.0,
        };
        let got = forward_kinematics(&skeleton, &[0.0], &mut [[0.0; 3]; 2], &mut [[0.0; 9]; 2]);
        assert!(matches!(got, Err(KernelError::Item { argument: "parents", index: 1, .. })));
    }
}
