//! Painting at 960 x 540: a limb's outline, its pen line of 200 points, and the picture with straight alpha.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec2;
use pegbar_kernels::paint::{Ink, Picture, fill_polygon, stroke_polyline, unpremultiply};
use std::hint::black_box;

const WIDTH: usize = 960;
const HEIGHT: usize = 540;

fn bench(c: &mut Criterion) {
    let outline: Vec<DVec2> = (0..200)
        .map(|i| {
            let turn = f64::from(i) * std::f64::consts::TAU / 200.0;
            DVec2::new(480.0 + 30.0 * turn.cos(), 270.0 + 120.0 * turn.sin())
        })
        .collect();
    let widths: Vec<f64> = (0..200).map(|i| 2.5 + f64::from(i % 7) / 7.0).collect();
    let ink = Ink { color: [60, 40, 50, 255], antialias: true };
    let mut pixels = vec![0u8; WIDTH * HEIGHT * 4];
    let mut straight = pixels.clone();
    let mut group = c.benchmark_group("paint 960x540");
    group.bench_function("fill_polygon", |b| {
        b.iter(|| {
            let mut picture = Picture { pixels: &mut pixels, width: WIDTH, height: HEIGHT };
            fill_polygon(&mut picture, black_box(&outline), ink)
        })
    });
    group.bench_function("stroke_polyline", |b| {
        b.iter(|| {
            let mut picture = Picture { pixels: &mut pixels, width: WIDTH, height: HEIGHT };
            stroke_polyline(&mut picture, black_box(&outline), &widths, true, ink)
        })
    });
    group.bench_function("unpremultiply", |b| b.iter(|| unpremultiply(black_box(&pixels), &mut straight)));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
