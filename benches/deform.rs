//! A round of deformation of 2,400 triangles by 15 handles, what is factored once, and the rendering of it at 1080p.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec2;
use pegbar_kernels::deform::{Deformer, Frames, Stitch};
use pegbar_kernels::texels::Texture;
use pegbar_kernels::textured::{Sheet, Target, render_sheet};
use std::hint::black_box;

const SIDE: u32 = 36;

/// A grid in the unit square.
fn grid() -> (Vec<DVec2>, Vec<[u32; 3]>) {
    let part = |i: u32| f64::from(i) / f64::from(SIDE - 1);
    let vertices = (0..SIDE * SIDE).map(|i| DVec2::new(part(i % SIDE), part(i / SIDE))).collect();
    let corners = (0..SIDE * (SIDE - 1)).filter(|i| i % SIDE + 1 < SIDE);
    let triangles = corners.flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]]).collect();
    (vertices, triangles)
}

fn bench(c: &mut Criterion) {
    let (vertices, triangles) = grid();
    let handles: Vec<u32> = (0..15).map(|i| i * 83 + 40).collect();
    let mut group = c.benchmark_group("deform");
    group.bench_function("factor", |b| b.iter(|| Deformer::new(black_box(&vertices), &triangles, &handles, &[])));
    let Ok(deformer) = Deformer::new(&vertices, &triangles, &handles, &[]) else { return };
    let bent = |handle: &u32| {
        let place = vertices[*handle as usize];
        DVec2::from_angle(place.x).rotate(place)
    };
    let positions: Vec<DVec2> = handles.iter().map(bent).collect();
    let mut out = vec![DVec2::ZERO; vertices.len()];
    for iterations in [1, 5] {
        let frames = Frames { positions: &positions, shapes: None, iterations, stitch: Stitch::Poisson };
        group.bench_function(format!("{iterations} rounds"), |b| {
            b.iter(|| deformer.deform(black_box(frames), &mut out))
        });
    }
    group.finish();
    render(c, &out, &triangles, &vertices);
}

fn render(c: &mut Criterion, places: &[DVec2], triangles: &[[u32; 3]], rest: &[DVec2]) {
    let texture: Vec<[u8; 4]> = (0..1u32 << 20).map(|i| [i as u8, (i >> 8) as u8, (i >> 12) as u8, 255]).collect();
    let texture = Texture { pixels: &texture, width: 1024, height: 1024 };
    let vertices: Vec<DVec2> = places.iter().map(|place| *place * 700.0 + DVec2::new(700.0, 100.0)).collect();
    let coordinates: Vec<DVec2> = rest.iter().map(|place| *place * 1023.0).collect();
    let sheet = Sheet { vertices: &vertices, texture_coordinates: &coordinates, triangles };
    let mut pixels = vec![[0; 4]; 1920 * 1080];
    let mut group = c.benchmark_group("render_sheet 1080p");
    for samples in [1, 2] {
        group.bench_function(format!("{samples} x {samples} samples"), |b| {
            b.iter(|| {
                pixels.fill([0; 4]);
                render_sheet(black_box(sheet), texture, Target { pixels: &mut pixels, width: 1920, samples })
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
