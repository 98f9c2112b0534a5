//! fit_poses: 500 poses of 16 joints, one start and eight.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec2, DVec3};
use pegbar_kernels::pose::{Settings, fit_poses};
use pegbar_kernels::robust::Loss;
use std::hint::black_box;

const POSES: usize = 500;
const JOINTS: usize = 16;

/// A swaying figure of points, and its 200th pose seen from the side.
fn scene() -> (Vec<DVec2>, Vec<DVec3>) {
    let wave = |k: usize, t: f64| 0.5 * (k as f64 * 0.71).sin() + 0.2 * (t * 0.05 + k as f64).sin();
    let point =
        |t: usize, k: usize| DVec3::new(0.4 * wave(5 * k, t as f64), wave(7 * k, t as f64), 0.4 * wave(11 * k, 0.0));
    let poses: Vec<DVec3> = (0..POSES * JOINTS).map(|i| point(i / JOINTS, i % JOINTS)).collect();
    let side = |k: usize, p: &DVec3| {
        DVec2::new(639.5 - 900.0 * p.z / (4.0 - p.x) + 3.0 * wave(k, 0.0), 359.5 - 900.0 * p.y / (4.0 - p.x))
    };
    let joints = poses[200 * JOINTS..201 * JOINTS].iter().enumerate().map(|(k, p)| side(k, p)).collect();
    (joints, poses)
}

fn bench(c: &mut Criterion) {
    let (joints, poses) = scene();
    let (mut matrices, mut costs, mut distances) = (vec![[0.0; 12]; POSES], vec![0.0; POSES], vec![0.0; poses.len()]);
    let mut group = c.benchmark_group("fit_poses 500 x 16");
    group.throughput(Throughput::Elements(POSES as u64));
    for (loss, starts) in [(Loss::Huber, 1), (Loss::Huber, 8), (Loss::Squared, 8), (Loss::Cauchy, 8)] {
        let settings = Settings {
            principal: DVec2::new(639.5, 359.5),
            focal: 1758.0,
            focal_spread: Some(0.35),
            roll_spread: 0.087,
            elevation_spread: 0.52,
            loss,
            scale: 6.0,
            starts,
        };
        group.bench_function(format!("{loss:?}, {starts} starts"), |b| {
            b.iter(|| fit_poses(black_box(&joints), &poses, &settings, &mut matrices, &mut costs, &mut distances))
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
