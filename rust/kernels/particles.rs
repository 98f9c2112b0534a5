//! Particles over one frame: flakes and drops that fall with the air's drag, meet moving limbs, cloth and the ground.
//!
//! The drag is that of a body with a terminal velocity, k = g / v^2 (the air's resistance grows with the square of the
//! speed), taken implicitly, so that no step is too long for it. Contacts are continuous (`sweep.rs`). What chance decides
//! is a hash of a particle's serial number (splitmix64, Steele et al. 2014), so the same input gives the same bits for any
//! number of threads.

use crate::cells::Cells;
use crate::chance::{chance, mix};
use crate::error::{KernelError, check_length};
use crate::particle::{Particle, phase};
use crate::sine::sine;
use crate::surroundings::{Surroundings, check, facets, swept};
use crate::sweep::{Bounds, Facet, Hit, Limb};
use glam::DVec3;
use rayon::prelude::*;

/// The host of what lies on the ground or on nothing.
const GROUND: i64 = -1;
/// How far up a surface must look, as the cosine to the vertical, for a flake to settle, and to stay when it turns.
const LEVEL: [f64; 2] = [0.3, 0.0];
/// Share of the speed along a surface that is left where a drop begins to run off.
const RUN: f64 = 0.15;
/// Radius of a droplet, as a share of its drop's.
const DROPLET_SIZE: f64 = 0.5;
/// Deeper than this share of its radius in a limb a particle is gone: limbs that close leave no room for it.
const CRUSHED: f64 = 0.5;

/// How particles behave.
#[derive(Debug, Clone, Copy)]
pub struct Nature {
    /// Seconds of a substep.
    pub step: f64,
    /// m/s^2.
    pub gravity: DVec3,
    /// Of the air's resistance, 1/m.
    pub drag: f64,
    /// Speed (m/s) and rate (1/s) of a flake's own sway.
    pub flutter: [f64; 2],
    /// Shares of those that touch something: stay on it, run off it. The others splash.
    pub fates: [f64; 2],
    /// Droplets of a splash, and their speed as a share of the impact's.
    pub splash: (u32, f64),
    /// Seconds that a falling, settled, splashed and sliding one lasts.
    pub lives: [f64; 4],
    /// Beyond these they are gone.
    pub low: DVec3,
    /// The other corner.
    pub high: DVec3,
}

/// Everything as it is in one substep.
struct Now<'a> {
    nature: &'a Nature,
    around: &'a Surroundings<'a>,
    limbs: Vec<Limb>,
    bounds: Bounds,
    facets: Vec<Facet>,
    cells: &'a Cells,
    time: f64,
}

/// What a particle's substep leads to besides its new state.
#[derive(Clone, Copy)]
enum Event {
    None,
    /// It is on the ground and becomes part of it.
    Landed,
    /// It bursts at the surface of this normal and way in the substep.
    Splashed(DVec3, DVec3),
    /// It bursts on the ground.
    Burst,
}

/// Moves particles on by a frame; returns places and radii of what came to the ground.
///
/// A row of `motion` is place (3), speed (3), radius and age, a row of `codes` serial number, host and phase.
pub fn step_particles(
    nature: &Nature,
    around: &Surroundings<'_>,
    motion: &mut [[f64; 8]],
    codes: &mut [[i64; 3]],
) -> Result<Vec<[f64; 4]>, KernelError> {
    check(around)?;
    check_length("codes", motion.len(), codes.len())?;
    let mut particles: Vec<Particle> =
        motion.iter().zip(codes.iter()).map(|(row, code)| Particle::of(row, code)).collect();
    let count = around.capsules.len() / (around.substeps + 1);
    let cells = Cells::new(&swept(around));
    let mut landed = Vec::new();
    let mut events = vec![Event::None; particles.len()];
    for substep in 0..around.substeps {
        let (old, new) = (&around.capsules[substep * count..], &around.capsules[(substep + 1) * count..]);
        let limbs: Vec<Limb> = old.iter().zip(&new[..count]).map(|(old, new)| Limb::new(old, new)).collect();
        let bounds = Bounds::new(&new[..count], &limbs);
        let time = around.time + substep as f64 * nature.step;
        let now = Now { nature, around, limbs, bounds, facets: facets(around, substep), cells: &cells, time };
        let pairs = particles.par_iter_mut().zip(events.par_iter_mut()).with_min_len(256);
        pairs.for_each(|(particle, event)| *event = now.advance(particle));
        settle_events(nature, &mut particles, &events, &mut landed);
    }
    for ((row, code), particle) in motion.iter_mut().zip(codes).zip(&particles) {
        (*row, *code) = particle.rows();
    }
    Ok(landed)
}

/// Makes droplets of what splashed, in the particles' order, as far as there are free slots.
fn settle_events(nature: &Nature, particles: &mut [Particle], events: &[Event], landed: &mut Vec<[f64; 4]>) {
    let mut slot = 0;
    for index in 0..particles.len() {
        let drop = particles[index];
        if matches!(events[index], Event::Landed | Event::Burst) {
            landed.push([drop.place.x, drop.place.y, drop.place.z, drop.radius]);
            particles[index].phase = phase::FREE;
        }
        let (normal, shift) = match events[index] {
            Event::None | Event::Landed => continue,
            Event::Burst => (DVec3::Y, DVec3::ZERO),
            Event::Splashed(normal, shift) => (normal, shift),
        };
        let surface = shift / nature.step;
        let impact = (drop.speed - surface).dot(normal).abs() * nature.splash.1;
        particles[index].phase = phase::FREE;
        for droplet in 0..nature.splash.0 {
            while slot < particles.len() && particles[slot].phase != phase::FREE {
                slot += 1;
            }
            if slot == particles.len() {
                break;
            }
            let serial = mix(drop.serial ^ mix(u64::from(droplet) + 1));
            let turn = std::f64::consts::TAU * chance(serial, 1);
            let (across, along) = normal.any_orthonormal_pair();
            let outward = turn.cos() * across + turn.sin() * along;
            let speed = impact * (0.5 + 0.5 * chance(serial, 2));
            let speed = surface + speed * (normal + (0.4 + 0.8 * chance(serial, 3)) * outward);
            let radius = DROPLET_SIZE * drop.radius;
            particles[slot] =
                Particle { place: drop.place, speed, radius, age: 0.0, serial, host: GROUND, phase: phase::DROPLET };
        }
    }
}

impl Now<'_> {
    fn advance(&self, particle: &mut Particle) -> Event {
        let lives = self.nature.lives;
        let life = match particle.phase {
            phase::FALLING => lives[0],
            phase::SETTLED => lives[1],
            phase::DROPLET => lives[2],
            phase::SLIDING => lives[3],
            _ => return Event::None,
        };
        particle.age += self.nature.step;
        if particle.age > life {
            particle.phase = phase::FREE;
            return Event::None;
        }
        let event = if particle.phase == phase::SETTLED { self.carry(particle) } else { self.fly(particle) };
        let (low, high) = (self.nature.low.cmple(particle.place), self.nature.high.cmpge(particle.place));
        if particle.phase != phase::SETTLED && !(low & high).all() {
            particle.phase = phase::FREE;
            return Event::None;
        }
        event
    }

    /// What lies on something goes with it, and falls off where that turns over.
    fn carry(&self, particle: &mut Particle) -> Event {
        let Ok(host) = usize::try_from(particle.host) else { return Event::None };
        let carried = match self.limbs.get(host) {
            Some(limb) => Some(limb.carry(particle.place)),
            None => self.facets.get(host - self.limbs.len()).and_then(|facet| facet.carry(particle.place)),
        };
        let Some((place, shift)) = carried else { return Event::None };
        (particle.place, particle.speed) = (place, shift / self.nature.step);
        if let Some(limb) = self.limbs.get(host)
            && limb.new.nearest(place).normal.y < LEVEL[1]
        {
            (particle.phase, particle.age) = (phase::SLIDING, 0.0);
        }
        self.crush(particle, host);
        Event::None
    }

    fn fly(&self, particle: &mut Particle) -> Event {
        let (step, nature) = (self.nature.step, self.nature);
        let against = self.air(particle) - particle.speed;
        let hold = nature.drag * against.length() * step;
        // Implicit in the speed: v' = v + dt g + hold (air - v'), with air - v = against.
        particle.speed += (step * nature.gravity + hold * against) / (1.0 + hold);
        let from = particle.place;
        particle.place = from + step * particle.speed;
        let event = match self.first(from, particle.place, particle.radius) {
            Some((hit, host)) => self.respond(particle, hit, host),
            None => Event::None,
        };
        if matches!(event, Event::None) && particle.phase != phase::SETTLED {
            self.push_out(particle);
            return self.land(particle);
        }
        event
    }

    /// The air at a particle: wind, gusts, and its own sway.
    fn air(&self, particle: &Particle) -> DVec3 {
        let mut air = self.around.air(particle.place, self.time);
        let [speed, rate] = self.nature.flutter;
        if speed > 0.0 && particle.phase == phase::FALLING {
            let turn = std::f64::consts::TAU * (rate * particle.age + chance(particle.serial, 11));
            let (tilt, other) = (chance(particle.serial, 12), 0.6 + 0.8 * chance(particle.serial, 13));
            let sway = DVec3::new(sine(turn + 6.0 * tilt), 0.0, sine(turn * other));
            air += speed * sway;
        }
        air
    }

    /// The first contact of a ball of `radius` on its way, with the limb's or triangle's index.
    fn first(&self, from: DVec3, to: DVec3, radius: f64) -> Option<(Hit, usize)> {
        let mut found: Option<(Hit, usize)> = None;
        let mut keep = |hit: Option<Hit>, host: usize| {
            if let Some(hit) = hit
                && found.is_none_or(|(best, _)| hit.share < best.share)
            {
                found = Some((hit, host));
            }
        };
        let (low, high) = (from.min(to), from.max(to));
        if !self.bounds.off_the_way(low, high, radius) {
            for (index, limb) in self.limbs.iter().enumerate() {
                keep(limb.meet(from, to, radius), index);
            }
        }
        if self.cells.reach(low - radius, high + radius) {
            for index in self.cells.near(low - radius, high + radius) {
                keep(self.facets[index as usize].meet(from, to, radius), self.limbs.len() + index as usize);
            }
        }
        found
    }

    fn respond(&self, particle: &mut Particle, hit: Hit, host: usize) -> Event {
        let fate = chance(particle.serial, 21);
        let [stick, run] = self.nature.fates;
        let surface = hit.shift / self.nature.step;
        if particle.phase == phase::DROPLET {
            particle.phase = phase::FREE;
            return Event::None;
        }
        let fresh = particle.phase == phase::FALLING;
        if fresh && fate < stick && hit.normal.y > LEVEL[0] {
            (particle.place, particle.speed) = (hit.place, surface);
            (particle.phase, particle.age, particle.host) = (phase::SETTLED, 0.0, host as i64);
            return Event::None;
        }
        if fresh && fate >= stick + run {
            particle.place = hit.place;
            return Event::Splashed(hit.normal, hit.shift);
        }
        let relative = particle.speed - surface;
        let into = relative.dot(hit.normal).min(0.0);
        let along = relative - into * hit.normal;
        if fresh {
            (particle.phase, particle.age) = (phase::SLIDING, 0.0);
        }
        particle.speed = surface + if fresh { RUN * along } else { along };
        particle.place = hit.place + (1.0 - hit.share) * self.nature.step * (particle.speed - surface);
        Event::None
    }

    /// Out of every limb; what finds no room is gone.
    fn push_out(&self, particle: &mut Particle) {
        if self.bounds.are_off(particle.place, particle.place, particle.radius) {
            return;
        }
        for limb in &self.limbs {
            if limb.new.may_touch(particle.place, particle.radius) {
                let near = limb.new.nearest(particle.place);
                particle.place += (particle.radius - near.distance).max(0.0) * near.normal;
            }
        }
        self.crush(particle, usize::MAX);
    }

    /// Ends what lies in a limb other than its host.
    fn crush(&self, particle: &mut Particle, host: usize) {
        let deep = -CRUSHED * particle.radius;
        let inside = |limb: &Limb| {
            limb.new.may_touch(particle.place, 0.0) && limb.new.nearest(particle.place).distance < deep.max(-1e-3)
        };
        if self.limbs.iter().enumerate().any(|(index, limb)| index != host && inside(limb)) {
            particle.phase = phase::FREE;
        }
    }

    /// What comes to the ground settles, splashes or becomes part of what lies there.
    fn land(&self, particle: &mut Particle) -> Event {
        let (height, absorbs) = self.around.surface(particle.place);
        let floor = height + particle.radius;
        if particle.phase == phase::FREE || particle.place.y > floor {
            return Event::None;
        }
        particle.place.y = floor;
        if particle.phase == phase::DROPLET {
            particle.phase = phase::FREE;
            return Event::None;
        }
        let splashes = self.nature.fates[0] == 0.0;
        if splashes && particle.phase == phase::FALLING {
            return Event::Burst;
        }
        if absorbs || splashes {
            return Event::Landed;
        }
        (particle.phase, particle.age, particle.host) = (phase::SETTLED, 0.0, GROUND);
        particle.speed = DVec3::ZERO;
        Event::None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surroundings::Bed;

    const NATURE: Nature = Nature {
        step: 0.01,
        gravity: DVec3::new(0.0, -10.0, 0.0),
        drag: 0.0,
        flutter: [0.0; 2],
        fates: [0.0; 2],
        splash: (2, 0.3),
        lives: [9.0; 4],
        low: DVec3::splat(-9.0),
        high: DVec3::splat(9.0),
    };
    const AROUND: Surroundings<'_> = Surroundings {
        capsules: &[],
        substeps: 10,
        vertices: [&[], &[]],
        triangles: &[],
        ground: 0.0,
        absorbs: false,
        beds: &[],
        wind: DVec3::ZERO,
        waves: &[],
        time: 0.0,
    };

    #[test]
    fn a_drop_falls_and_bursts_into_as_many_droplets_as_there_are_slots_for() {
        let mut motion = [[0.0, 0.03, 0.0, 0.0, -5.0, 0.0, 0.01, 0.0], [0.0; 8]];
        let mut codes = [[5, -1, phase::FALLING], [0, -1, phase::FREE]];
        let around = Surroundings { substeps: 1, ..AROUND };
        let landed = step_particles(&NATURE, &around, &mut motion, &mut codes);
        assert_eq!(landed, Ok(vec![[0.0, 0.01, 0.0, 0.01]]));
        assert!(codes.iter().all(|code| code[2] == phase::DROPLET), "{codes:?}");
        assert!(motion.iter().all(|row| row[1] == 0.01 && row[4] > 0.0 && row[6] == 0.005), "{motion:?}");
        assert_ne!(codes[0][0], codes[1][0]);
    }

    #[test]
    fn lists_that_do_not_fit_are_refused() {
        let tried = |around: Surroundings<'_>| step_particles(&NATURE, &around, &mut [], &mut []);
        assert!(tried(Surroundings { capsules: &[[0.0; 8]; 12], ..AROUND }).is_err());
        assert!(tried(Surroundings { triangles: &[[0, 1, 2]], ..AROUND }).is_err());
        let flat = Bed { origin: [0.0; 2], spacing: 1.0, columns: 3, absorbs: true, heights: &[0.5; 3] };
        assert!(tried(Surroundings { beds: &[flat], ..AROUND }).is_err());
        assert!(step_particles(&NATURE, &AROUND, &mut [[0.0; 8]], &mut []).is_err());
    }
}
