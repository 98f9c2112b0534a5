//! A frame of 5,000 particles round a figure of sixteen limbs and under a canopy, in four substeps.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use pegbar_kernels::particle::phase;
use pegbar_kernels::particles::{Nature, step_particles};
use pegbar_kernels::surroundings::Surroundings;
use std::f64::consts::TAU;

const COUNT: usize = 5000;
const SUBSTEPS: usize = 4;
const LIMBS: usize = 16;
const RINGS: u32 = 24;

/// A number from 0 to 1 of an index, spread evenly.
fn spread(index: usize, step: f64) -> f64 {
    (index as f64 * step).fract()
}

fn canopy() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let at = |ring: u32, spoke: u32| {
        let (out, turn) = (f64::from(ring) / f64::from(RINGS), f64::from(spoke) * TAU / 12.0);
        DVec3::new(out * turn.cos(), 2.2 - 0.3 * out * out, out * turn.sin())
    };
    let vertices = (0..RINGS).flat_map(|ring| (0..12).map(move |spoke| at(ring + 1, spoke))).collect();
    let quad = |ring: u32, spoke: u32| {
        let [a, b] = [ring * 12 + spoke, ring * 12 + (spoke + 1) % 12];
        [[a, b, a + 12], [b, b + 12, a + 12]]
    };
    (vertices, (0..RINGS - 1).flat_map(|ring| (0..12).flat_map(move |spoke| quad(ring, spoke))).collect())
}

fn bench(c: &mut Criterion) {
    let place = |k: usize| [3.0 * spread(k, 0.618) - 1.5, 3.0 * spread(k, 0.414), 3.0 * spread(k, 0.732) - 1.5];
    let motion: Vec<[f64; 8]> = (0..COUNT)
        .map(|k| {
            let [x, y, z] = place(k);
            [x, y, z, 0.0, -5.0, 0.0, 0.004, 0.0]
        })
        .collect();
    let codes: Vec<[i64; 3]> = (0..COUNT).map(|k| [k as i64, -1, phase::FALLING]).collect();
    let limb = |step: usize, k: usize| {
        let (x, y) = (0.2 * (k % 4) as f64 - 0.3 + 0.01 * step as f64, 0.4 * (k / 4) as f64);
        [x, y, 0.0, 0.08, x + 0.05, y + 0.4, 0.1, 0.06]
    };
    let capsules: Vec<_> = (0..=SUBSTEPS).flat_map(|step| (0..LIMBS).map(move |k| limb(step, k))).collect();
    let (vertices, triangles) = canopy();
    let wave = [0.4, 0.0, 0.2, 3.0, 0.5, 1.0, 4.0, 0.3];
    let nature = Nature {
        step: 1.0 / 96.0,
        gravity: DVec3::new(0.0, -9.81, 0.0),
        drag: 0.2,
        flutter: [0.3, 0.5],
        fates: [0.0, 0.25],
        splash: (3, 0.25),
        lives: [60.0, 5.0, 0.3, 60.0],
        low: DVec3::splat(-9.0),
        high: DVec3::splat(9.0),
    };
    let around = Surroundings {
        capsules: &capsules,
        substeps: SUBSTEPS,
        vertices: [&vertices, &vertices],
        triangles: &triangles,
        ground: 0.0,
        absorbs: false,
        beds: &[],
        wind: DVec3::X,
        waves: &[wave; 4],
        time: 0.0,
    };
    c.bench_function("particles 5,000, a frame", |b| {
        b.iter(|| step_particles(&nature, &around, &mut motion.clone(), &mut codes.clone()))
    });
}

criterion_group!(benches, bench);
criterion_main!(benches);
