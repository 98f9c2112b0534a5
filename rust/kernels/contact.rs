//! What keeps cloth out of volumes and off the ground: vertices and the middles of links, with friction.
//!
//! Contacts are exact for the capsules' shape at the end of a substep. A vertex that is pushed out leaves the surface no
//! faster than the surface moves.

use crate::capsule::Capsule;
use crate::sheet::{Forces, Sheet};
use glam::DVec3;

/// A vertex that touched something in this substep: the normal there and how far that surface moved.
#[derive(Clone, Copy)]
pub struct Touch {
    /// Unit vector away from the surface.
    pub normal: DVec3,
    /// Metres in this substep.
    pub shift: DVec3,
}

/// A capsule with the way its ends have come in this substep.
pub struct Volume {
    /// Where it is after the substep.
    pub capsule: Capsule,
    /// Of its start and its end, metres.
    pub shifts: [DVec3; 2],
}

impl Volume {
    /// From the row before the substep and the one after it.
    pub fn new(old: &[f64; 8], new: &[f64; 8]) -> Self {
        let way = |k: usize| DVec3::new(new[k] - old[k], new[k + 1] - old[k + 1], new[k + 2] - old[k + 2]);
        Volume { capsule: Capsule::new(new), shifts: [way(0), way(4)] }
    }
}

/// What a frame's substeps need beside positions and velocities.
pub struct Work {
    before: Vec<DVec3>,
    touches: Vec<Option<Touch>>,
    /// By vertex the pin it hangs from and the cloth between.
    anchors: Vec<(u32, f64)>,
    /// Of all links at rest, metres.
    longest: f64,
}

impl Work {
    /// For a sheet where it is now.
    pub fn new(sheet: &Sheet<'_>, positions: &[DVec3]) -> Self {
        let mut anchors = vec![(0, f64::INFINITY); positions.len()];
        for ([vertex, pin], reach) in sheet.tethers.iter().zip(sheet.reaches) {
            anchors[*vertex as usize] = (*pin, *reach);
        }
        let longest = sheet.lengths.iter().fold(0.0, |longest: f64, length| longest.max(*length));
        Work { before: positions.to_vec(), touches: vec![None; positions.len()], anchors, longest }
    }

    /// Begins a substep at `positions`.
    pub fn begin(&mut self, positions: &[DVec3]) {
        self.before.copy_from_slice(positions);
        self.touches.fill(None);
    }

    /// Pushes everything out of the volumes and up to the ground.
    pub fn push_out(&mut self, sheet: &Sheet<'_>, forces: &Forces<'_>, volumes: &[Volume], positions: &mut [DVec3]) {
        let volumes = within_reach(volumes, forces.thickness, positions);
        let margin = forces.thickness + self.longest;
        let mut close = vec![0_u64; positions.len()];
        for (index, volume) in volumes.iter().enumerate() {
            // 64 volumes have a bit each; those beyond share the last one, which costs them time only.
            let bit = 1 << index.min(63);
            for (close, place) in close.iter_mut().zip(positions.iter()) {
                if volume.capsule.may_touch(*place, margin) && volume.capsule.nearest(*place).distance < margin {
                    *close |= bit;
                }
            }
            for link in sheet.links {
                if (close[link[0] as usize] | close[link[1] as usize]) & bit != 0 {
                    push_link(*link, sheet, forces, volume, positions, &self.anchors);
                }
            }
        }
        for (index, volume) in volumes.iter().enumerate() {
            for vertex in (0..positions.len()).filter(|vertex| close[*vertex] & (1 << index.min(63)) != 0) {
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
    pub fn take_velocities(&self, step: f64, positions: &[DVec3], velocities: &mut [DVec3]) {
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
pub fn rub(place: DVec3, before: DVec3, touch: Touch, limit: f64) -> DVec3 {
    let way = place - before - touch.shift;
    let along = way - way.dot(touch.normal) * touch.normal;
    let length = along.length();
    if length <= limit { place - along } else { place - along * (limit / length) }
}
