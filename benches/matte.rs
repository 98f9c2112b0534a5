//! The mattes of a drawing of 1080p: a painted figure on white paper, and the same scanned, with noise everywhere.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pegbar_kernels::fill::fill_matte;
use pegbar_kernels::matte::{Mode, ink_alpha, matte, own_alpha};
use std::hint::black_box;

const WIDTH: usize = 1920;
const HEIGHT: usize = 1080;

/// A round figure of flat paint with an outline, and its labels.
fn drawing() -> (Vec<u8>, Vec<u8>) {
    let radius = |i: usize| ((i % WIDTH) as f64 - 960.).hypot((i / WIDTH) as f64 - 540.);
    let paint = |i: usize| match radius(i) {
        r if r < 440. => [240, 200, 170],
        r if r < 446. => [30, 20, 40],
        _ => [255; 3],
    };
    ((0..WIDTH * HEIGHT).flat_map(paint).collect(), (0..WIDTH * HEIGHT).map(|i| u8::from(radius(i) < 446.)).collect())
}

fn bench(c: &mut Criterion) {
    let (paper, labels) = drawing();
    let noise = |(i, value): (usize, &u8)| value.saturating_sub((i.wrapping_mul(2_654_435_761) >> 9) as u8 & 7);
    let scan: Vec<u8> = paper.iter().enumerate().map(noise).collect();
    let with_alpha: Vec<u8> =
        paper.as_chunks::<3>().0.iter().zip(&labels).flat_map(|(p, l)| [p[0], p[1], p[2], l * 255]).collect();
    let (mut color, mut alpha) = (vec![0; paper.len()], vec![0f32; labels.len()]);
    let mut group = c.benchmark_group("matte 1080p");
    group.throughput(Throughput::Elements(alpha.len() as u64));
    for (name, image) in [("paper", &paper), ("scan", &scan)] {
        group.bench_function(format!("ink alpha, {name}"), |b| {
            b.iter(|| ink_alpha(black_box(image), 3, WIDTH, &mut alpha))
        });
        group.bench_function(format!("unmix, {name}"), |b| {
            b.iter(|| matte(Mode::Unmix, black_box(image), 3, WIDTH, &mut color, &mut alpha))
        });
        group.bench_function(format!("fill, {name}"), |b| {
            b.iter(|| fill_matte(black_box(image), 3, WIDTH, &labels, &mut color, &mut alpha))
        });
    }
    group.bench_function("own alpha", |b| b.iter(|| own_alpha(black_box(&with_alpha), WIDTH, &mut alpha)));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
