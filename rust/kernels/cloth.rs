//! Cloth over one frame: extended position-based dynamics (XPBD) in small substeps against exact moving capsules.
//!
//! After Macklin, Mueller, Chentanez 2016 (compliant constraints) and Macklin et al. 2019 (substeps take the place of
//! iterations). Links hold distances (threads, folds, seams), tethers keep every vertex within its length of cloth from
//! a pin (Kim, Chentanez, Mueller 2012), contacts come last, so that what is stored lies outside the volumes. One
//! vertex after the other in a fixed order: the same input gives the same bits.

use crate::capsule::Capsule;
use crate::error::{KernelError, check_length};
use glam::DVec3;

/// Half the density of air in kg per cubic metre: the pressure of air that is stopped, over its speed squared.
const HALF_AIR: f64 = 0.6;

/// Share of the drag that acts along the cloth: air clings to it a little.
const CLING: f64 = 0.05;

/// A cloth as it is made.
#[derive(Debug, Clone, Copy)]
pub struct Sheet<'a> {
    /// 1/kg by vertex, 0 where it is pinned.
    pub weights: &'a [f64],
    /// Corners of the triangles: where air presses.
    pub triangles: &'a [[u32; 3]],
    /// Pairs of vertices at a distance, in the order they are solved, the one nearer to a pin first.
    pub links: &'a [[u32; 2]],
    /// Metres by link.
    pub lengths: &'a [f64],
    /// Pairs of vertices that face each other across a fold.
    pub folds: &'a [[u32; 2]],
    /// Metres by fold.
    pub spans: &'a [f64],
    /// A vertex and the pinned vertex it hangs from.
    pub tethers: &'a [[u32; 2]],
    /// Metres of cloth between the two.
    pub reaches: &'a [f64],
    /// Pairs of vertices some links apart on the way from a pin: they carry pulls farther than one link in one go.
    pub stays: &'a [[u32; 2]],
    /// Metres of cloth between them, which they may not exceed.
    pub spread: &'a [f64],
    /// Metres per newton by which links and folds give way.
    pub compliances: [f64; 2],
}

/// What acts on it.
#[derive(Debug, Clone, Copy)]
pub struct Forces<'a> {
    /// Seconds of a substep.
    pub step: f64,
    /// m/s^2.
    pub gravity: DVec3,
    /// The air's velocity by vertex.
    pub air: &'a [DVec3],
    /// How strongly air holds the cloth, 1 a plate of its size.
    pub drag: f64,
    /// Rate in 1/s at which motion dies.
    pub damping: f64,
    /// Metres kept clear of volumes and ground.
    pub thickness: f64,
    /// Of volumes and ground.
    pub friction: f64,
    /// Height of the ground, -inf for none.
    pub ground: f64,
}

/// What moves it: pinned vertices with their places (S x P), capsules before the first and after every substep.
#[derive(Debug, Clone, Copy)]
pub struct Drive<'a> {
    /// Pinned vertices.
    pub pins: &'a [u32],
    /// Their places after every substep.
    pub targets: &'a [DVec3],
    /// (S + 1) x C rows: start and its radius, end and its radius.
    pub capsules: &'a [[f64; 8]],
    /// S.
    pub substeps: usize,
    /// How often links are gone through in a substep: outwards, inwards and so on.
    pub rounds: usize,
}

/// A vertex that touched something in this substep: the normal there and how far that surface moved.
#[derive(Clone, Copy)]
struct Touch {
    normal: DVec3,
    shift: DVec3,
}

/// Moves `positions` and `velocities` (n) on by all substeps.
pub fn step_cloth(
    sheet: &Sheet<'_>,
    forces: &Forces<'_>,
    drive: &Drive<'_>,
    positions: &mut [DVec3],
    velocities: &mut [DVec3],
) -> Result<(), KernelError> {
    check(sheet, forces, drive, positions.len(), velocities.len())?;
    let count = drive.capsules.len() / (drive.substeps + 1);
    let pinned = drive.pins.len();
    let mut work = Work::new(sheet, positions);
    for substep in 0..drive.substeps {
        let (old, new) = (&drive.capsules[substep * count..], &drive.capsules[(substep + 1) * count..]);
        let volumes: Vec<Volume> = old.iter().zip(&new[..count]).map(|(old, new)| Volume::new(old, new)).collect();
        work.before.copy_from_slice(positions);
        blow(sheet, forces, positions, velocities);
        let keep = (-forces.damping * forces.step).exp();
        for ((place, velocity), weight) in positions.iter_mut().zip(velocities.iter_mut()).zip(sheet.weights) {
            if *weight > 0.0 {
                *velocity = (*velocity + forces.gravity * forces.step) * keep;
                *place += *velocity * forces.step;
            }
        }
        for (pin, target) in drive.pins.iter().zip(&drive.targets[substep * pinned..]) {
            positions[*pin as usize] = *target;
        }
        work.touches.fill(None);
        hold(sheet.folds.iter().zip(sheet.spans), sheet.compliances[1], sheet.weights, forces.step, positions);
        for round in 0..drive.rounds {
            hold_stays(sheet, positions);
            // Outwards and inwards in turn, so that pulls travel both ways.
            let links = sheet.links.iter().zip(sheet.lengths);
            if round % 2 == 0 {
                hold(links, sheet.compliances[0], sheet.weights, forces.step, positions);
            } else {
                hold(links.rev(), sheet.compliances[0], sheet.weights, forces.step, positions);
            }
        }
        hold_tethers(sheet, positions);
        work.push_out(sheet, forces, &volumes, positions);
        work.take_velocities(forces.step, positions, velocities);
    }
    Ok(())
}

/// A capsule with the way its ends have come in this substep.
struct Volume {
    capsule: Capsule,
    shifts: [DVec3; 2],
}

impl Volume {
    fn new(old: &[f64; 8], new: &[f64; 8]) -> Self {
        let way = |k: usize| DVec3::new(new[k] - old[k], new[k + 1] - old[k + 1], new[k + 2] - old[k + 2]);
        Volume { capsule: Capsule::new(new), shifts: [way(0), way(4)] }
    }
}

/// The pressure of the air on every triangle, as if the air's relative speed there fell towards zero.
fn blow(sheet: &Sheet<'_>, forces: &Forces<'_>, positions: &[DVec3], velocities: &mut [DVec3]) {
    if forces.drag == 0.0 {
        return;
    }
    for corners in sheet.triangles {
        let [a, b, c] = corners.map(|corner| corner as usize);
        let normal = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
        let doubled = normal.length();
        if doubled <= f64::MIN_POSITIVE {
            continue;
        }
        let normal = normal / doubled;
        let third = 1.0 / 3.0;
        let against =
            (forces.air[a] + forces.air[b] + forces.air[c] - velocities[a] - velocities[b] - velocities[c]) * third;
        let across = against.dot(normal);
        let pull = HALF_AIR * forces.drag * doubled * 0.5 * third * forces.step;
        let push = across.abs() * across * normal + CLING * against.length() * (against - across * normal);
        for vertex in [a, b, c] {
            let change = push * (pull * sheet.weights[vertex]);
            // A light cloth in strong wind: no more than to the air's own speed.
            let most = against.length();
            let size = change.length();
            velocities[vertex] += if size > most { change * (most / size) } else { change };
        }
    }
}

/// Brings pairs of vertices to their lengths, one after the other.
fn hold<'a>(
    pairs: impl Iterator<Item = (&'a [u32; 2], &'a f64)>,
    compliance: f64,
    weights: &[f64],
    step: f64,
    positions: &mut [DVec3],
) {
    let give = compliance / (step * step);
    for (pair, length) in pairs {
        let [a, b] = pair.map(|vertex| vertex as usize);
        let (first, second) = (weights[a], weights[b]);
        let sum = first + second;
        let apart = positions[a] - positions[b];
        let now = apart.length();
        if sum == 0.0 || now <= f64::MIN_POSITIVE {
            continue;
        }
        let change = apart * ((now - length) / (now * (sum + give)));
        positions[a] -= first * change;
        positions[b] += second * change;
    }
}

/// Pulls together what is farther apart than its length of cloth.
fn hold_stays(sheet: &Sheet<'_>, positions: &mut [DVec3]) {
    for (pair, most) in sheet.stays.iter().zip(sheet.spread) {
        let [a, b] = pair.map(|vertex| vertex as usize);
        let apart = positions[a] - positions[b];
        let (now, sum) = (apart.length(), sheet.weights[a] + sheet.weights[b]);
        if now > *most && sum > 0.0 {
            let change = apart * ((now - most) / (now * sum));
            positions[a] -= sheet.weights[a] * change;
            positions[b] += sheet.weights[b] * change;
        }
    }
}

/// Keeps every vertex within its length of cloth from its pin.
fn hold_tethers(sheet: &Sheet<'_>, positions: &mut [DVec3]) {
    for ([vertex, pin], reach) in sheet.tethers.iter().zip(sheet.reaches) {
        let anchor = positions[*pin as usize];
        let apart = positions[*vertex as usize] - anchor;
        let now = apart.length();
        if now > *reach {
            positions[*vertex as usize] = anchor + apart * (reach / now);
        }
    }
}

struct Work {
    before: Vec<DVec3>,
    touches: Vec<Option<Touch>>,
    /// By vertex the pin it hangs from and the cloth between.
    anchors: Vec<(u32, f64)>,
}

impl Work {
    fn new(sheet: &Sheet<'_>, positions: &[DVec3]) -> Self {
        let mut anchors = vec![(0, f64::INFINITY); positions.len()];
        for ([vertex, pin], reach) in sheet.tethers.iter().zip(sheet.reaches) {
            anchors[*vertex as usize] = (*pin, *reach);
        }
        Work { before: positions.to_vec(), touches: vec![None; positions.len()], anchors }
    }

    fn push_out(&mut self, sheet: &Sheet<'_>, forces: &Forces<'_>, volumes: &[Volume], positions: &mut [DVec3]) {
        let volumes = within_reach(volumes, forces.thickness, positions);
        for volume in &volumes {
            for link in sheet.links {
                push_link(*link, sheet, forces, volume, positions, &self.anchors);
            }
        }
        for volume in &volumes {
            for vertex in 0..positions.len() {
                self.push_vertex(vertex, sheet, forces, volume, positions);
            }
        }
        let floor = forces.ground + forces.thickness;
        for (vertex, place) in positions.iter_mut().enumerate() {
            if sheet.weights[vertex] > 0.0 && place.y < floor {
                let touch = Touch { normal: DVec3::Y, shift: DVec3::ZERO };
                let depth = floor - place.y;
                *place = rub(place.with_y(floor), self.before[vertex], touch, forces.friction * depth);
                self.touches[vertex] = Some(touch);
            }
        }
    }

    fn push_vertex(
        &mut self,
        vertex: usize,
        sheet: &Sheet<'_>,
        forces: &Forces<'_>,
        volume: &Volume,
        positions: &mut [DVec3],
    ) {
        let place = positions[vertex];
        if sheet.weights[vertex] == 0.0 || !volume.capsule.may_touch(place, forces.thickness) {
            return;
        }
        let near = volume.capsule.nearest(place);
        let mut depth = forces.thickness - near.distance;
        if depth > 0.0 {
            depth -= slack(self.anchors[vertex], volume, forces, positions);
        }
        if depth > 0.0 {
            let shift = volume.shifts[0].lerp(volume.shifts[1], near.share);
            let touch = Touch { normal: near.normal, shift };
            positions[vertex] = rub(place + depth * near.normal, self.before[vertex], touch, forces.friction * depth);
            self.touches[vertex] = Some(touch);
        }
    }

    /// What was pushed out leaves the surface no faster than the surface moves: contacts do not throw.
    fn take_velocities(&self, step: f64, positions: &[DVec3], velocities: &mut [DVec3]) {
        for (vertex, velocity) in velocities.iter_mut().enumerate() {
            *velocity = (positions[vertex] - self.before[vertex]) / step;
            if let Some(touch) = self.touches[vertex] {
                let leaving = (*velocity - touch.shift / step).dot(touch.normal);
                *velocity -= leaving.max(0.0) * touch.normal;
            }
        }
    }
}

/// The volumes that may touch the box around all vertices.
fn within_reach<'a>(volumes: &'a [Volume], thickness: f64, positions: &[DVec3]) -> Vec<&'a Volume> {
    let low = positions.iter().fold(DVec3::INFINITY, |low, place| low.min(*place));
    let high = positions.iter().fold(DVec3::NEG_INFINITY, |high, place| high.max(*place));
    let near = |volume: &&Volume| volume.capsule.may_touch_box(low, high, thickness);
    volumes.iter().filter(near).collect()
}

/// Holds the middle of a link out of a volume.
fn push_link(
    link: [u32; 2],
    sheet: &Sheet<'_>,
    forces: &Forces<'_>,
    volume: &Volume,
    positions: &mut [DVec3],
    anchors: &[(u32, f64)],
) {
    let [a, b] = link.map(|vertex| vertex as usize);
    let middle = 0.5 * (positions[a] + positions[b]);
    if !volume.capsule.may_touch(middle, forces.thickness) {
        return;
    }
    let sum = sheet.weights[a] + sheet.weights[b];
    let near = volume.capsule.nearest(middle);
    let mut depth = forces.thickness - near.distance;
    if depth > 0.0 && sum > 0.0 {
        // The first is nearer to the pins, and pinned itself where the second hangs from it.
        depth -= slack(anchors[a], volume, forces, positions).max(slack(anchors[b], volume, forces, positions));
        let push = near.normal * (2.0 * depth.max(0.0) / sum);
        positions[a] += sheet.weights[a] * push;
        positions[b] += sheet.weights[b] * push;
    }
}

/// How deep a vertex has to stay since its pin is deeper: a pin inside a volume must not tear the cloth around it.
fn slack(anchor: (u32, f64), volume: &Volume, forces: &Forces<'_>, positions: &[DVec3]) -> f64 {
    let (pin, reach) = anchor;
    let place = positions[pin as usize];
    if reach.is_infinite() || !volume.capsule.may_touch(place, forces.thickness) {
        return 0.0;
    }
    (forces.thickness - volume.capsule.nearest(place).distance - reach).max(0.0)
}

/// Takes back the way along the surface that friction does not allow, at most `limit` metres of it.
fn rub(place: DVec3, before: DVec3, touch: Touch, limit: f64) -> DVec3 {
    let way = place - before - touch.shift;
    let along = way - way.dot(touch.normal) * touch.normal;
    let length = along.length();
    if length <= limit { place - along } else { place - along * (limit / length) }
}

fn check(
    sheet: &Sheet<'_>,
    forces: &Forces<'_>,
    drive: &Drive<'_>,
    count: usize,
    moving: usize,
) -> Result<(), KernelError> {
    check_length("velocities", count, moving)?;
    check_length("weights", count, sheet.weights.len())?;
    check_length("air", count, forces.air.len())?;
    check_length("lengths", sheet.links.len(), sheet.lengths.len())?;
    check_length("spans", sheet.folds.len(), sheet.spans.len())?;
    check_length("spread", sheet.stays.len(), sheet.spread.len())?;
    check_length("reaches", sheet.tethers.len(), sheet.reaches.len())?;
    check_length("targets", drive.substeps * drive.pins.len(), drive.targets.len())?;
    let capsules = drive.capsules.len() / (drive.substeps + 1);
    check_length("capsules", capsules * (drive.substeps + 1), drive.capsules.len())?;
    known("pins", drive.pins.iter().copied(), count)?;
    let lists = [("links", sheet.links), ("folds", sheet.folds), ("stays", sheet.stays), ("tethers", sheet.tethers)];
    for (argument, pairs) in lists {
        known(argument, pairs.iter().map(|pair| pair[0].max(pair[1])), count)?;
    }
    known("triangles", sheet.triangles.iter().map(|corners| corners[0].max(corners[1]).max(corners[2])), count)
}

fn known(argument: &'static str, mut vertices: impl Iterator<Item = u32>, count: usize) -> Result<(), KernelError> {
    match vertices.position(|vertex| vertex as usize >= count) {
        Some(index) => Err(KernelError::Item { argument, problem: "names no vertex", index }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: [DVec3; 3] = [DVec3::ZERO; 3];
    const FALL: Forces<'_> = Forces {
        step: 1.0 / 480.0,
        gravity: DVec3::new(0.0, -10.0, 0.0),
        air: &STILL,
        drag: 0.0,
        damping: 0.0,
        thickness: 0.01,
        friction: 0.5,
        ground: f64::NEG_INFINITY,
    };

    fn sheet<'a>(weights: &'a [f64]) -> Sheet<'a> {
        Sheet {
            weights,
            triangles: &[[0, 1, 2]],
            links: &[[0, 1], [1, 2]],
            lengths: &[0.1, 0.1],
            folds: &[],
            spans: &[],
            tethers: &[],
            reaches: &[],
            stays: &[],
            spread: &[],
            compliances: [0.0; 2],
        }
    }

    #[test]
    fn what_is_free_falls_as_things_fall() {
        let mut places = [DVec3::ZERO, DVec3::new(0.1, 0.0, 0.0), DVec3::new(0.2, 0.0, 0.0)];
        let mut speeds = STILL;
        let drive = Drive { pins: &[], targets: &[], capsules: &[], substeps: 480, rounds: 1 };
        assert_eq!(step_cloth(&sheet(&[1.0; 3]), &FALL, &drive, &mut places, &mut speeds), Ok(()));
        assert!((places[2].y + 5.0).abs() < 0.02 && (speeds[0].y + 10.0).abs() < 1e-9, "{places:?} {speeds:?}");
    }

    #[test]
    fn a_thread_hangs_from_its_pin_at_its_length() {
        let mut places = [DVec3::ZERO, DVec3::new(0.1, 0.0, 0.0), DVec3::new(0.2, 0.0, 0.0)];
        let mut speeds = STILL;
        let targets = vec![DVec3::new(0.0, 1.0, 0.0); 4800];
        let drive = Drive { pins: &[0], targets: &targets, capsules: &[], substeps: 4800, rounds: 1 };
        let forces = Forces { damping: 3.0, ..FALL };
        assert_eq!(step_cloth(&sheet(&[0.0, 1.0, 1.0]), &forces, &drive, &mut places, &mut speeds), Ok(()));
        assert!((places[2] - DVec3::new(0.0, 0.8, 0.0)).length() < 2e-3, "{places:?}");
    }

    #[test]
    fn a_ball_and_the_ground_hold_what_falls_on_them() {
        let mut places = [DVec3::new(0.0, 0.6, 0.0), DVec3::new(0.1, 0.6, 0.0), DVec3::new(0.2, 0.6, 0.0)];
        let mut speeds = STILL;
        let row = [0.1, 0.0, 0.0, 0.5, 0.1, 0.0, 0.0, 0.5];
        let capsules = vec![row; 241];
        let drive = Drive { pins: &[], targets: &[], capsules: &capsules, substeps: 240, rounds: 1 };
        let forces = Forces { ground: 0.505, friction: 5.0, ..FALL };
        assert_eq!(step_cloth(&sheet(&[1.0; 3]), &forces, &drive, &mut places, &mut speeds), Ok(()));
        let ball = Capsule::new(&row);
        assert!(places.iter().all(|place| ball.nearest(*place).distance > 0.0099 && place.y > 0.5149), "{places:?}");
        assert!(places[1].y < 0.52 && speeds[1].length() < 0.1, "{places:?} {speeds:?}");
    }

    #[test]
    fn lists_that_do_not_fit_are_refused() {
        let drive = Drive { pins: &[3], targets: &[DVec3::ZERO], capsules: &[], substeps: 1, rounds: 1 };
        let refused = step_cloth(&sheet(&[1.0; 3]), &FALL, &drive, &mut STILL.clone(), &mut STILL.clone());
        assert!(matches!(refused, Err(KernelError::Item { argument: "pins", index: 0, .. })));
        let drive = Drive { pins: &[], targets: &[], capsules: &[[0.0; 8]; 3], substeps: 1, rounds: 1 };
        let refused = step_cloth(&sheet(&[1.0; 3]), &FALL, &drive, &mut STILL.clone(), &mut STILL.clone());
        assert!(matches!(refused, Err(KernelError::Length { argument: "capsules", wanted: 2, got: 3 })));
        let refused = step_cloth(&sheet(&[1.0; 2]), &FALL, &drive, &mut STILL.clone(), &mut STILL.clone());
        assert!(matches!(refused, Err(KernelError::Length { argument: "weights", .. })));
    }
}
