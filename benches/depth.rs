//! limb_depth at 1080p, 16 limbs on 30% of the pixels, beside a copy of as many bytes.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use pegbar_kernels::depth::{Interpolation, limb_depth};
use std::hint::black_box;

const WIDTH: usize = 1920;
const HEIGHT: usize = 1080;

fn scene() -> (Vec<u8>, Vec<[DVec2; 2]>, Vec<[f64; 2]>) {
    let mut labels = vec![0u8; WIDTH * HEIGHT];
    let (mut ends, mut depths) = (Vec::new(), Vec::new());
    for limb in 0..16 {
        let (left, top) = (60 + (limb % 4) * 480, 20 + (limb / 4) * 270);
        for row in top..top + 230 {
            labels[row * WIDTH + left..row * WIDTH + left + 169].fill(limb as u8 + 1);
        }
        let corner = DVec2::new(left as f64, top as f64);
        ends.push([corner, corner + DVec2::new(169., 230.)]);
        depths.push([4.0, 4.0 + limb as f64 / 8.0]);
    }
    (labels, ends, depths)
}

fn bench(c: &mut Criterion) {
    let (labels, ends, depths) = scene();
    let mut out = vec![0f32; labels.len()];
    let mut group = c.benchmark_group("limb_depth 1080p");
    group.throughput(Throughput::Elements(labels.len() as u64));
    for how in [Interpolation::Linear, Interpolation::Perspective] {
        group.bench_function(format!("{how:?}"), |b| {
            b.iter(|| limb_depth(black_box(&labels), WIDTH, &ends, &depths, how, &mut out))
        });
    }
    let (from, mut to) = (vec![1u8; labels.len() * 5 / 2], vec![0u8; labels.len() * 5 / 2]);
    group.bench_function("copy of as many bytes", |b| b.iter(|| to.copy_from_slice(black_box(&from))));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
