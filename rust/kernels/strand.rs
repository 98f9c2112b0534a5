//! Strands over one frame: chains of points in small substeps against exact moving capsules and the ground.
//!
//! A substep predicts, bends implicitly, restores lengths directly (`chain.rs`) and pushes points and the middles of links
//! out of the volumes (`contact.rs`). Strands do not meet each other, so each goes through all substeps on its own and
//! the result does not depend on threads; bobs (balls at strands' ends) do meet, and where there are several their
//! strands go on substep by substep.

use crate::chain::{Bending, Lengths, Point};
use crate::cloth::Drive;
use crate::contact::{Touch, Volume, rub};
use crate::error::{KernelError, check_length};
use crate::sheet::Forces;
use glam::DVec3;
use rayon::prelude::*;

/// Strands as they are made.
#[derive(Debug, Clone, Copy)]
pub struct Strands<'a> {
    /// All points, strand by strand, as rows of `Point`.
    pub points: &'a [[f64; 8]],
    /// Where the next strand begins, by strand.
    pub ends: &'a [u32],
    /// Points that are balls and meet each other.
    pub bobs: &'a [u32],
}

/// Moves `positions` and `velocities` (n) on by all substeps. `forces.drag` multiplies the points' own, and
/// `forces.thickness` is added to their radii.
pub fn step_strands(
    strands: &Strands<'_>,
    forces: &Forces<'_>,
    drive: &Drive<'_>,
    positions: &mut [DVec3],
    velocities: &mut [DVec3],
) -> Result<(), KernelError> {
    check(strands, forces, drive, positions.len(), velocities.len())?;
    let volumes = volumes(drive);
    let mut threads = split(strands, forces, drive, positions, velocities);
    if strands.bobs.len() < 2 {
        threads.par_iter_mut().for_each(|thread| {
            for (substep, volumes) in volumes.iter().enumerate() {
                thread.go(forces, drive, substep, volumes);
                thread.take_velocities(forces.step);
            }
        });
        return Ok(());
    }
    for (substep, volumes) in volumes.iter().enumerate() {
        threads.iter_mut().for_each(|thread| thread.go(forces, drive, substep, volumes));
        part_bobs(strands.bobs, &mut threads);
        threads.iter_mut().for_each(|thread| thread.take_velocities(forces.step));
    }
    Ok(())
}

/// The capsules as they move in every substep.
fn volumes(drive: &Drive<'_>) -> Vec<Vec<Volume>> {
    let count = drive.capsules.len() / (drive.substeps + 1);
    let row = |substep: usize| &drive.capsules[substep * count..(substep + 1) * count];
    let pair = |substep: usize| row(substep).iter().zip(row(substep + 1)).map(|(old, new)| Volume::new(old, new));
    (0..drive.substeps).map(|substep| pair(substep).collect()).collect()
}

/// One strand on its way.
struct Thread<'a> {
    first: usize,
    points: Vec<Point>,
    air: &'a [DVec3],
    places: &'a mut [DVec3],
    velocities: &'a mut [DVec3],
    before: Vec<DVec3>,
    touches: Vec<Option<Touch>>,
    /// Pinned points and which of the drive's pins they are.
    pins: Vec<(usize, usize)>,
    /// By point the pinned point next to it along the strand, and the metres between.
    anchors: Vec<(usize, f64)>,
    bending: Option<Bending>,
    lengths: Lengths,
    thickest: f64,
}

fn split<'a>(
    strands: &Strands<'a>,
    forces: &Forces<'a>,
    drive: &Drive<'_>,
    mut positions: &'a mut [DVec3],
    mut velocities: &'a mut [DVec3],
) -> Vec<Thread<'a>> {
    let mut held = vec![usize::MAX; strands.points.len()];
    for (index, pin) in drive.pins.iter().enumerate() {
        held[*pin as usize] = index;
    }
    let (mut first, mut threads) = (0, Vec::with_capacity(strands.ends.len()));
    for end in strands.ends {
        let count = *end as usize - first;
        let (places, others) = positions.split_at_mut(count);
        let (moving, rest) = velocities.split_at_mut(count);
        (positions, velocities) = (others, rest);
        let points: Vec<Point> = strands.points[first..first + count].iter().map(Point::new).collect();
        let pins: Vec<(usize, usize)> =
            (0..count).filter(|k| held[first + k] != usize::MAX).map(|k| (k, held[first + k])).collect();
        threads.push(Thread {
            first,
            air: &forces.air[first..first + count],
            before: places.to_vec(),
            touches: vec![None; count],
            anchors: anchors(&points, &pins),
            pins,
            bending: Bending::new(&points, forces.step),
            lengths: Lengths::new(&points, forces.step),
            thickest: points.iter().fold(0.0, |thickest: f64, point| thickest.max(point.radius)),
            points,
            places,
            velocities: moving,
        });
        first += count;
    }
    threads
}

fn anchors(points: &[Point], pins: &[(usize, usize)]) -> Vec<(usize, f64)> {
    let mut found = vec![(0, f64::INFINITY); points.len()];
    for (pin, _) in pins {
        found[*pin] = (*pin, 0.0);
    }
    for k in 1..points.len() {
        let (pin, reach) = found[k - 1];
        if reach + points[k - 1].length < found[k].1 {
            found[k] = (pin, reach + points[k - 1].length);
        }
    }
    for k in (1..points.len()).rev() {
        let (pin, reach) = found[k];
        if reach + points[k - 1].length < found[k - 1].1 {
            found[k - 1] = (pin, reach + points[k - 1].length);
        }
    }
    found
}

impl Thread<'_> {
    /// A substep but for the velocities.
    fn go(&mut self, forces: &Forces<'_>, drive: &Drive<'_>, substep: usize, volumes: &[Volume]) {
        self.before.copy_from_slice(self.places);
        self.touches.fill(None);
        self.blow(forces);
        let keep = (-forces.damping * forces.step).exp();
        for ((place, velocity), point) in self.places.iter_mut().zip(self.velocities.iter_mut()).zip(&self.points) {
            if point.weight > 0.0 {
                *velocity = (*velocity + forces.gravity * (point.gravity * forces.step)) * keep;
                *place += *velocity * forces.step;
            }
        }
        for (point, pin) in &self.pins {
            self.places[*point] = drive.targets[substep * drive.pins.len() + pin];
        }
        if let Some(bending) = &mut self.bending {
            bending.relax(self.places);
        }
        self.lengths.restore(&self.points, drive.rounds, self.places);
        self.push_out(forces, volumes);
    }

    /// Air drags along the velocity, implicitly: never beyond its own speed. Across a strand more than along it.
    fn blow(&mut self, forces: &Forces<'_>) {
        let last = self.points.len() - 1;
        for (k, point) in self.points.iter().enumerate() {
            let pull = point.drag * forces.drag * point.weight * forces.step;
            if pull == 0.0 {
                continue;
            }
            let against = self.air[k] - self.velocities[k];
            let slowed = |wind: DVec3, pull: f64| wind * (pull * wind.length() / (1.0 + pull * wind.length()));
            let along = (self.before[(k + 1).min(last)] - self.before[k.max(1) - 1]).normalize_or_zero();
            self.velocities[k] += if point.cling >= 1.0 {
                slowed(against, pull)
            } else {
                let lengthwise = against.dot(along) * along;
                slowed(against - lengthwise, pull) + slowed(lengthwise, pull * point.cling)
            };
        }
    }

    /// Out of the volumes and up to the ground: the middles of links first, then the points.
    fn push_out(&mut self, forces: &Forces<'_>, volumes: &[Volume]) {
        let low = self.places.iter().fold(DVec3::INFINITY, |low, place| low.min(*place));
        let high = self.places.iter().fold(DVec3::NEG_INFINITY, |high, place| high.max(*place));
        let margin = self.thickest + forces.thickness;
        for volume in volumes.iter().filter(|volume| volume.capsule.may_touch_box(low, high, margin)) {
            for link in 0..self.points.len() - 1 {
                self.push_link(link, forces, volume);
            }
            for k in 0..self.points.len() {
                self.push_point(k, forces, volume);
            }
        }
        for (k, (place, point)) in self.places.iter_mut().zip(&self.points).enumerate() {
            let depth = forces.ground + point.radius + forces.thickness - place.y;
            if point.weight > 0.0 && depth > 0.0 {
                let touch = Touch { normal: DVec3::Y, shift: DVec3::ZERO };
                *place = rub(*place + depth * DVec3::Y, self.before[k], touch, forces.friction * depth);
                self.touches[k] = Some(touch);
            }
        }
    }

    fn push_link(&mut self, link: usize, forces: &Forces<'_>, volume: &Volume) {
        let [first, second] = [self.points[link], self.points[link + 1]];
        let (radius, sum) = (first.radius.min(second.radius) + forces.thickness, first.weight + second.weight);
        let middle = 0.5 * (self.places[link] + self.places[link + 1]);
        if sum == 0.0 || !volume.capsule.may_touch(middle, radius) {
            return;
        }
        let near = volume.capsule.nearest(middle);
        let depth = radius - near.distance;
        if depth > 0.0 {
            let free = depth - self.slack(link, radius, volume).max(self.slack(link + 1, radius, volume));
            let push = near.normal * (2.0 * free.max(0.0) / sum);
            self.places[link] += first.weight * push;
            self.places[link + 1] += second.weight * push;
        }
    }

    fn push_point(&mut self, k: usize, forces: &Forces<'_>, volume: &Volume) {
        let (point, place) = (self.points[k], self.places[k]);
        let radius = point.radius + forces.thickness;
        if point.weight == 0.0 || !volume.capsule.may_touch(place, radius) {
            return;
        }
        let near = volume.capsule.nearest(place);
        if near.distance >= radius {
            return;
        }
        let depth = radius - near.distance - self.slack(k, radius, volume);
        if depth > 0.0 {
            let shift = volume.shifts[0].lerp(volume.shifts[1], near.share);
            let touch = Touch { normal: near.normal, shift };
            self.places[k] = rub(place + depth * near.normal, self.before[k], touch, forces.friction * depth);
            self.touches[k] = Some(touch);
        }
    }

    /// How deep a point has to stay since its pin is deeper.
    fn slack(&self, k: usize, radius: f64, volume: &Volume) -> f64 {
        let (pin, reach) = self.anchors[k];
        if reach.is_infinite() {
            return 0.0;
        }
        (radius - volume.capsule.nearest(self.places[pin]).distance - reach).max(0.0)
    }

    /// What was pushed out leaves the surface no faster than the surface moves.
    fn take_velocities(&mut self, step: f64) {
        for (k, velocity) in self.velocities.iter_mut().enumerate() {
            *velocity = (self.places[k] - self.before[k]) / step;
            if let Some(touch) = self.touches[k] {
                let leaving = (*velocity - touch.shift / step).dot(touch.normal);
                *velocity -= leaving.max(0.0) * touch.normal;
            }
        }
    }
}

/// Pushes bobs that overlap apart, each by its ease of motion, pair by pair.
fn part_bobs(bobs: &[u32], threads: &mut [Thread<'_>]) {
    let place_of = |bob: u32| {
        let thread = threads.partition_point(|thread| thread.first <= bob as usize) - 1;
        (thread, bob as usize - threads[thread].first)
    };
    let bobs: Vec<(usize, usize)> = bobs.iter().map(|bob| place_of(*bob)).collect();
    for (index, (a, i)) in bobs.iter().copied().enumerate() {
        for (b, j) in bobs[index + 1..].iter().copied() {
            let (one, two) = (threads[a].points[i], threads[b].points[j]);
            let way = threads[b].places[j] - threads[a].places[i];
            let (apart, sum) = (way.length(), one.weight + two.weight);
            let depth = one.radius + two.radius - apart;
            if depth > 0.0 && sum > 0.0 && apart > 0.0 {
                let push = way * (depth / (apart * sum));
                threads[a].places[i] -= one.weight * push;
                threads[b].places[j] += two.weight * push;
            }
        }
    }
}

fn check(
    strands: &Strands<'_>,
    forces: &Forces<'_>,
    drive: &Drive<'_>,
    count: usize,
    moving: usize,
) -> Result<(), KernelError> {
    check_length("velocities", count, moving)?;
    check_length("points", count, strands.points.len())?;
    check_length("air", count, forces.air.len())?;
    check_length("targets", drive.substeps * drive.pins.len(), drive.targets.len())?;
    let capsules = drive.capsules.len() / (drive.substeps + 1);
    check_length("capsules", capsules * (drive.substeps + 1), drive.capsules.len())?;
    check_length("ends", count, strands.ends.last().map_or(0, |end| *end as usize))?;
    let starts = std::iter::once(&0).chain(strands.ends);
    if let Some(index) = strands.ends.iter().zip(starts).position(|(end, start)| end <= start) {
        return Err(KernelError::Item { argument: "ends", problem: "want a point and more by strand", index });
    }
    for (argument, list) in [("pins", drive.pins), ("bobs", strands.bobs)] {
        if let Some(index) = list.iter().position(|point| *point as usize >= count) {
            return Err(KernelError::Item { argument, problem: "names no point", index });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: [DVec3; 4] = [DVec3::ZERO; 4];
    const FALL: Forces<'_> = Forces {
        step: 1.0 / 480.0,
        gravity: DVec3::new(0.0, -10.0, 0.0),
        air: &STILL,
        drag: 1.0,
        damping: 0.0,
        thickness: 0.0,
        friction: 0.5,
        ground: f64::NEG_INFINITY,
    };
    const FREE: [f64; 8] = [1.0, 0.01, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0];

    fn line(height: f64) -> [DVec3; 4] {
        [0.0, 0.1, 0.2, 0.3].map(|x| DVec3::new(x, height, 0.0))
    }

    fn drive<'a>(capsules: &'a [[f64; 8]], substeps: usize) -> Drive<'a> {
        Drive { pins: &[], targets: &[], capsules, substeps, rounds: 2 }
    }

    #[test]
    fn what_is_free_falls_and_a_balloon_reaches_its_own_speed() {
        let mut points = [FREE; 4];
        points[3] = [1.0, 0.1, 0.0, 0.0, 0.0, -1.0, 2.5, 1.0];
        let strands = Strands { points: &points, ends: &[3, 4], bobs: &[3] };
        let (mut places, mut speeds) = (line(0.0), STILL);
        assert_eq!(step_strands(&strands, &FALL, &drive(&[], 480), &mut places, &mut speeds), Ok(()));
        assert!((places[1].y + 5.0).abs() < 0.02 && (speeds[0].y + 10.0).abs() < 1e-9, "{places:?} {speeds:?}");
        // 10 N of lift against 2.5 v^2.
        assert!((speeds[3].y - 2.0).abs() < 0.02, "{speeds:?}");
    }

    #[test]
    fn a_limb_and_the_ground_hold_what_falls_on_them() {
        let strands = Strands { points: &[FREE; 4], ends: &[4], bobs: &[] };
        let row = [0.1, 0.0, -1.0, 0.5, 0.1, 0.0, 1.0, 0.5];
        let (mut places, mut speeds) = (line(0.6), STILL);
        let forces = Forces { ground: 0.3, friction: 5.0, damping: 1.0, ..FALL };
        assert_eq!(step_strands(&strands, &forces, &drive(&[row; 481], 480), &mut places, &mut speeds), Ok(()));
        let limb = crate::capsule::Capsule::new(&row);
        assert!(places.iter().all(|place| limb.nearest(*place).distance > 0.0099), "{places:?}");
        let (mut places, mut speeds) = (line(0.6), STILL);
        assert_eq!(step_strands(&strands, &forces, &drive(&[], 480), &mut places, &mut speeds), Ok(()));
        assert!(places.iter().all(|place| (place.y - 0.31).abs() < 1e-9), "{places:?}");
        assert!(speeds.iter().all(|speed| speed.length() < 1e-6), "{speeds:?}");
    }

    #[test]
    fn a_limb_that_comes_along_takes_strands_with_it_and_its_own_pin_is_let_in() {
        let pinned = [0.0, 0.01, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0];
        let strands = Strands { points: &[pinned, FREE, FREE, FREE], ends: &[4], bobs: &[] };
        let row = [0.0, -1.0, 0.0, 0.15, 0.0, 1.0, 0.0, 0.15];
        let targets = [DVec3::ZERO; 240];
        let drive = Drive { pins: &[0], targets: &targets, capsules: &[row; 241], substeps: 240, rounds: 2 };
        let (mut places, mut speeds) = (line(0.0), STILL);
        let forces = Forces { gravity: DVec3::ZERO, ..FALL };
        assert_eq!(step_strands(&strands, &forces, &drive, &mut places, &mut speeds), Ok(()));
        assert!(places.iter().zip(line(0.0)).all(|(place, want)| place.distance(want) < 1e-6), "{places:?}");
    }

    #[test]
    fn bobs_part() {
        let bob = [1.0, 0.08, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let strands = Strands { points: &[bob; 4], ends: &[1, 2, 3, 4], bobs: &[0, 1, 2, 3] };
        let (mut places, mut speeds) = (line(0.0), STILL);
        assert_eq!(step_strands(&strands, &FALL, &drive(&[], 100), &mut places, &mut speeds), Ok(()));
        assert!(places.windows(2).all(|pair| pair[1].distance(pair[0]) > 0.1599), "{places:?}");
    }

    #[test]
    fn lists_that_do_not_fit_are_refused() {
        let refused = |strands: Strands<'_>, drive: Drive<'_>| {
            step_strands(&strands, &FALL, &drive, &mut { STILL }, &mut { STILL }).err()
        };
        let good = Strands { points: &[FREE; 4], ends: &[2, 4], bobs: &[] };
        assert_eq!(refused(good, drive(&[], 1)), None);
        let ends = refused(Strands { ends: &[2, 2, 4], ..good }, drive(&[], 1));
        assert!(matches!(ends, Some(KernelError::Item { argument: "ends", index: 1, .. })), "{ends:?}");
        let bobs = refused(Strands { bobs: &[4], ..good }, drive(&[], 1));
        assert!(matches!(bobs, Some(KernelError::Item { argument: "bobs", index: 0, .. })), "{bobs:?}");
        let capsules = refused(good, drive(&[[0.0; 8]; 3], 1));
        assert!(matches!(capsules, Some(KernelError::Length { argument: "capsules", .. })), "{capsules:?}");
    }
}
