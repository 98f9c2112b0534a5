//! The first pass of the search: 24 drawings against 5,000 clip frames in 24 views, as marked and exchanged.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pegbar_kernels::search::{Clips, Drawn, Found, View, search_clips};
use std::hint::black_box;

const FRAMES: usize = 5_000;
const LIMBS: usize = 10;
const DRAWINGS: usize = 24;

fn bench(c: &mut Criterion) {
    let vectors: Vec<f32> = (0..3 * LIMBS * FRAMES).map(|i| (i as f32 * 0.37).sin()).collect();
    let angles: Vec<f32> = (0..2 * DRAWINGS * LIMBS).map(|i| 3.0 * (i as f32 * 0.73).sin()).collect();
    let weights = vec![0.1; angles.len()];
    let order: Vec<u32> = (0..DRAWINGS as u32).collect();
    let steps = [[1, 5]; DRAWINGS];
    let views: Vec<View> = (0..24)
        .map(|i| {
            let (sine, cosine) = (i as f32 * 0.26).sin_cos();
            [[cosine, 0.0, -sine], [0.0, -1.0, 0.0]]
        })
        .collect();
    let clips = Clips { vectors: &vectors, limbs: LIMBS, ranges: &[[0, FRAMES as u64]] };
    let drawn = Drawn { angles: &angles, weights: &weights, frames: DRAWINGS, orders: &order, steps: &steps };
    let mut found = vec![Found::NOTHING; 2 * views.len()];
    let mut group = c.benchmark_group("search_clips");
    group.throughput(Throughput::Elements((FRAMES * DRAWINGS * views.len() * 2) as u64));
    group.bench_function("24 views", |b| b.iter(|| search_clips(black_box(clips), drawn, &views, FRAMES, &mut found)));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
