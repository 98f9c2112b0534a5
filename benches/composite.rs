//! depth_composite at 1080p on worst-case content (nothing empty, opaque or ordered), beside a copy of as many bytes.

use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime};
use pegbar_kernels::color::Space;
use pegbar_kernels::composite::{Layer, Render, Rendered, Target, depth_composite};
use std::hint::black_box;

const WIDTH: usize = 1920;
const HEIGHT: usize = 1080;
const COUNT: usize = WIDTH * HEIGHT;

/// Numbers without a pattern, always the same.
fn noise(count: usize, mut state: u32) -> Vec<u8> {
    let step = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    std::iter::repeat_with(step).take(count).collect()
}

fn floats(count: usize, seed: u32, from: f32) -> Vec<f32> {
    noise(count, seed).into_iter().map(|byte| from + f32::from(byte) / 255.0).collect()
}

fn run(
    group: &mut BenchmarkGroup<WallTime>,
    name: &str,
    scale: usize,
    floating: bool,
    spaces: [Space; 2],
    bytes: bool,
) {
    let samples = COUNT * scale * scale;
    let (drawing, alpha, depth) = (noise(COUNT * 4, 1), floats(COUNT, 2, 0.0), floats(COUNT, 3, 1.0));
    let (straight, premultiplied) = (noise(samples * 4, 4), floats(samples * 4, 5, 0.0));
    let rendered_depth = floats(samples, 6, 1.0);
    let pixels = if floating { Rendered::Floats(&premultiplied) } else { Rendered::Bytes(&straight) };
    let layer = Layer { pixels: &drawing, channels: 4, width: WIDTH, alpha: &alpha, depth: &depth };
    let render = Render { pixels, depth: &rendered_depth, scale, space: spaces[0] };
    let (mut out_bytes, mut out_floats) = (vec![0u8; COUNT * 4], vec![0f32; COUNT * 4]);
    group.bench_function(name, |b| {
        b.iter(|| {
            let out = if bytes { Target::Bytes(&mut out_bytes) } else { Target::Floats(&mut out_floats) };
            depth_composite(black_box(&layer), black_box(&render), spaces[1], out)
        })
    });
}

fn bench(c: &mut Criterion) {
    use Space::{Display, Linear};
    let mut group = c.benchmark_group("depth_composite 1080p");
    group.throughput(Throughput::Elements(COUNT as u64)).sample_size(20);
    run(&mut group, "bytes", 1, false, [Display, Display], true);
    run(&mut group, "floats", 1, true, [Display, Display], false);
    run(&mut group, "linear floats to display bytes", 1, true, [Linear, Display], true);
    run(&mut group, "linear floats, 2 x 2, to display bytes", 2, true, [Linear, Display], true);
    let (from, mut to) = (vec![1u8; COUNT * 12], vec![0u8; COUNT * 12]);
    group.bench_function("copy of as many bytes as bytes", |b| b.iter(|| to.copy_from_slice(black_box(&from))));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
