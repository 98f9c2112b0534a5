//! Labels at 1080p, 16 limbs: palettes exact and soft, growth over a rim of two pixels, stick figures.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use pegbar_kernels::grow::grow_labels;
use pegbar_kernels::palette::{Swatch, palette_labels};
use pegbar_kernels::segment::segment_stick_figure;
use std::hint::black_box;

const WIDTH: usize = 1920;
const HEIGHT: usize = 1080;

fn limbs() -> Vec<[DVec2; 2]> {
    let corner = |limb: usize| DVec2::new(60. + (limb % 4) as f64 * 480., 20. + (limb / 4) as f64 * 270.);
    (0..16).map(corner).map(|a| [a, a + DVec2::new(160., 200.)]).collect()
}

fn swatches() -> Vec<Swatch> {
    let color = |i: u8| [i.wrapping_mul(67), i.wrapping_mul(149), 255 - i.wrapping_mul(31)];
    let background = Swatch { color: [0, 0, 0], label: 0 };
    (1..=16).map(|label| Swatch { color: color(label), label }).chain([background]).collect()
}

fn bench(c: &mut Criterion) {
    let (limbs, swatches) = (limbs(), swatches());
    let dark = vec![0; WIDTH * HEIGHT];
    let mut labels = vec![0; WIDTH * HEIGHT];
    let mut figure = labels.clone();
    let segment = |half: f64, out: &mut [u8]| segment_stick_figure(&dark, WIDTH, &limbs, &[half; 16], 128, out);
    assert_eq!((segment(60., &mut labels), segment(62., &mut figure)), (Ok(()), Ok(())));
    let color = |label: &u8| swatches[usize::from(label.wrapping_sub(1)).min(16)].color;
    let painted: Vec<u8> = labels.iter().flat_map(color).collect();
    // The mean of a pixel and its right and lower neighbours: borders of one or two pixels.
    let below = |i: usize, step: usize| u16::from(*painted.get(i + step).unwrap_or(&0));
    let soft: Vec<u8> =
        (0..painted.len()).map(|i| ((below(i, 0) * 2 + below(i, 3) + below(i, WIDTH * 3)) / 4) as u8).collect();
    let mut out = vec![0; WIDTH * HEIGHT];
    let mut group = c.benchmark_group("labels 1080p");
    group.throughput(Throughput::Elements(out.len() as u64));
    group.bench_function("stick figure", |b| b.iter(|| segment(black_box(60.), &mut out)));
    group.bench_function("palette exact", |b| {
        b.iter(|| palette_labels(black_box(&painted), 3, WIDTH, &swatches, 0., &mut out))
    });
    group.bench_function("palette soft", |b| {
        b.iter(|| palette_labels(black_box(&soft), 3, WIDTH, &swatches, 20., &mut out))
    });
    group.bench_function("grow a rim", |b| b.iter(|| grow_labels(black_box(&labels), &figure, WIDTH, None, &mut out)));
    group.bench_function("grow everything", |b| {
        b.iter(|| grow_labels(black_box(&labels), &[1; WIDTH * HEIGHT], WIDTH, None, &mut out))
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
