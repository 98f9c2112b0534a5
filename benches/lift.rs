//! lift and the limbs' signs: 200 frames of 19 markers, free poses, 20 components, depths and 13 candidate lengths.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pegbar_kernels::lift::{Lift, lift};
use pegbar_kernels::signs::{Track, length_costs, limb_depths};
use std::hint::black_box;

const FRAMES: usize = 200;
const MARKERS: usize = 19;
const LIMBS: usize = 18;

/// Numbers between -1 and 1 without pattern.
fn wave(count: usize) -> Vec<f64> {
    (0..count).map(|i| (i as f64 * 1.7).sin() * (i as f64 * 0.31).cos()).collect()
}

fn poses(c: &mut Criterion) {
    let prior = wave(FRAMES * 3 * MARKERS);
    let rows: Vec<[[f64; 4]; 2]> =
        wave(2 * FRAMES * MARKERS).chunks(2).map(|d| [[1.0, 0.0, 0.2, d[0]], [0.0, -1.0, 0.1, d[1]]]).collect();
    let limbs: Vec<[i64; 2]> = (0..LIMBS as i64).map(|limb| [limb, limb + 1]).collect();
    let (lengths, mean) = (vec![0.4; FRAMES * LIMBS], wave(3 * MARKERS));
    let components: Vec<f64> = (0..20 * 3 * MARKERS).map(|i| f64::from(u8::from(i % 57 == i / 57))).collect();
    let mut out = vec![0.0; prior.len()];
    let mut group = c.benchmark_group("lift, 200 frames of 19 markers");
    group.throughput(Throughput::Elements(FRAMES as u64));
    for (name, mean, components) in [("free", &[][..], &[][..]), ("20 components", &mean[..], &components[..])] {
        let shared = Lift { markers: MARKERS, limbs: &limbs, limb_weight: 1e-3, prior_weight: 0.1, mean, components };
        group.bench_function(name, |b| b.iter(|| lift(&shared, black_box(&rows), &lengths, &prior, &mut out)));
    }
    group.finish();
}

fn signs(c: &mut Criterion) {
    let (planar, clip, noise) =
        (wave(FRAMES).iter().map(|x| 0.4 * x.abs()).collect::<Vec<_>>(), wave(FRAMES), [1e-3; FRAMES]);
    let track = Track { planar: &planar, clip: &clip, noise: &noise, jolt: 0.01, doubt: 0.2 };
    let tracks = [track; LIMBS];
    let (lengths, candidates) = ([0.41; FRAMES * LIMBS], [0.42; 13 * LIMBS]);
    let (mut depths, mut costs) = ([0.0; FRAMES * LIMBS], [0.0; 13 * LIMBS]);
    let mut group = c.benchmark_group("signs, 200 frames of 18 limbs");
    group.bench_function("depths", |b| b.iter(|| limb_depths(black_box(&tracks), &lengths, &mut depths)));
    group.bench_function("13 lengths", |b| b.iter(|| length_costs(black_box(&tracks), &candidates, &mut costs)));
    group.finish();
}

criterion_group!(benches, poses, signs);
criterion_main!(benches);
