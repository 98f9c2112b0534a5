//! Cloth over one frame: extended position-based dynamics (XPBD) in small substeps against exact moving capsules.
//!
//! After Macklin, Mueller, Chentanez 2016 (compliant constraints) and Macklin et al. 2019 (substeps take the place of
//! iterations). Links hold distances (threads, folds, seams), tethers keep every vertex within its length of cloth from
//! a pin (Kim, Chentanez, Mueller 2012), contacts come last, so that what is stored lies outside the volumes. One
//! vertex after the other in a fixed order: the same input gives the same bits.

use crate::contact::{Volume, Work};
use crate::error::{KernelError, check_length};
use crate::sheet::{Forces, Sheet};
use glam::DVec3;

/// Half the density of air in kg per cubic metre: the pressure of air that is stopped, over its speed squared.
const HALF_AIR: f64 = 0.6;

/// Share of the drag that acts along the cloth: air clings to it a little.
const CLING: f64 = 0.05;

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
        work.begin(positions);
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
    use crate::capsule::Capsule;

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
        let refused = step_cloth(&sheet(&[1.0; 3]), &FALL, &drive, &mut { STILL }, &mut { STILL });
        assert!(matches!(refused, Err(KernelError::Item { argument: "pins", index: 0, .. })));
        let drive = Drive { pins: &[], targets: &[], capsules: &[[0.0; 8]; 3], substeps: 1, rounds: 1 };
        let refused = step_cloth(&sheet(&[1.0; 3]), &FALL, &drive, &mut { STILL }, &mut { STILL });
        assert!(matches!(refused, Err(KernelError::Length { argument: "capsules", wanted: 2, got: 3 })));
        let refused = step_cloth(&sheet(&[1.0; 2]), &FALL, &drive, &mut { STILL }, &mut { STILL });
        assert!(matches!(refused, Err(KernelError::Length { argument: "weights", .. })));
    }
}
