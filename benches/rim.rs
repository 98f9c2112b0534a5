//! Depth for a render's rim at 1080p: a disc over 3 % of the frame, beside a copy of the depth map.

use criterion::{Criterion, criterion_group, criterion_main};
use pegbar_kernels::composite::Rendered;
use pegbar_kernels::rim::{fill, rim};
use std::hint::black_box;

const WIDTH: usize = 1920;
const HEIGHT: usize = 1080;
const COUNT: usize = WIDTH * HEIGHT;

/// Distance outside the disc's edge, in pixels.
fn outside(index: usize) -> f32 {
    let (x, y) = ((index % WIDTH) as f32 - 900.3, (index / WIDTH) as f32 - 520.7);
    x.hypot(y) - 141.0
}

fn bench(c: &mut Criterion) {
    let depth: Vec<f32> = (0..COUNT).map(|i| if outside(i) < 0.0 { 2.0 } else { f32::INFINITY }).collect();
    let floats: Vec<f32> = (0..COUNT).flat_map(|i| [(0.5 - outside(i)).clamp(0.0, 1.0); 4]).collect();
    let bytes: Vec<u8> = floats.iter().map(|value| (value * 255.0) as u8).collect();
    let mut out = vec![0.0; COUNT];
    let mut group = c.benchmark_group("rim 1080p");
    group.sample_size(30);
    for (name, pixels) in [("bytes", Rendered::Bytes(&bytes)), ("floats", Rendered::Floats(&floats))] {
        group.bench_function(name, |b| b.iter(|| rim(black_box(pixels), black_box(&depth), WIDTH)));
    }
    let found = rim(Rendered::Bytes(&bytes), &depth, WIDTH).unwrap_or_default();
    group.bench_function("fill", |b| b.iter(|| fill(black_box(&depth), &found, &mut out)));
    group.bench_function("copy of the map", |b| b.iter(|| out.copy_from_slice(black_box(&depth))));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
