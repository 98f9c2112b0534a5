//! time_warp of 2000 drawn with 5000 clip frames, and the distances of as many poses.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pegbar_kernels::descriptor::{Poses, pose_distance};
use pegbar_kernels::warp::{Rules, time_warp};
use std::hint::black_box;

const DRAWN: usize = 2000;
const CLIP: usize = 5000;
const LIMBS: usize = 8;

fn angles(poses: usize, pace: f64) -> Vec<f64> {
    (0..poses * LIMBS).map(|i| ((i / LIMBS) as f64 * pace + (i % LIMBS) as f64).sin() * 3.0).collect()
}

fn bench(c: &mut Criterion) {
    let (drawn, clip) = (angles(DRAWN, 0.05), angles(CLIP, 0.02));
    let mut cost = vec![0.0; DRAWN * CLIP];
    let mut group = c.benchmark_group("2000 x 5000");
    group.sample_size(20).throughput(Throughput::Elements((DRAWN * CLIP) as u64));
    group.bench_function("pose_distance, 8 limbs", |b| {
        let (a, b_poses) = (Poses { angles: &drawn, trust: &[] }, Poses { angles: &clip, trust: &[] });
        b.iter(|| pose_distance(black_box(a), b_poses, &[1.0; LIMBS], &mut cost))
    });
    for (name, open, slope_limit) in [("closed", false, None), ("open", true, None), ("slope limit 3", false, Some(3))]
    {
        let rules = Rules { open_begin: open, open_end: open, slope_limit };
        group.bench_function(format!("time_warp, {name}"), |b| b.iter(|| time_warp(black_box(&cost), CLIP, rules)));
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
