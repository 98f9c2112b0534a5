//! render_passes at 1080p with 2x2 samples, beside one fill of the same buffers; then with 1k to 1M triangles.
//!
//! The scene is a torus with a colour at every vertex that fills most of the picture. RAYON_NUM_THREADS sets the threads.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use pegbar_kernels::ink::Ink;
use pegbar_kernels::raster::{Passes, render_passes};
use pegbar_kernels::shade::Toon;
use pegbar_kernels::surface::{Scene, View};
use std::f64::consts::TAU;
use std::hint::black_box;

const WIDTH: usize = 3840;
const HEIGHT: usize = 2160;
const LIGHT: DVec3 = DVec3::new(0.4, 0.8, -0.45);
const NO_INK: Ink = Ink { width: 0.0, color: [0.0; 4], crease_angle: 7.0, depth_jump: 0.01 };
const INK: Ink = Ink { width: 3.0, color: [0.0, 0.0, 0.0, 1.0], crease_angle: 1.0, depth_jump: 0.01 };

struct Mesh {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    colors: Vec<[f32; 4]>,
    normals: Vec<DVec3>,
    objects: Vec<u16>,
}

/// A torus, tilted, three metres before the camera.
fn torus(rings: usize, sides: usize) -> Mesh {
    let (mut vertices, mut colors, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    for (i, j) in (0..rings).flat_map(|i| (0..sides).map(move |j| (i, j))) {
        let (a, b) = (i as f64 / rings as f64 * TAU, j as f64 / sides as f64 * TAU);
        let normal = DVec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
        let point = DVec3::new(a.cos(), a.sin(), 0.0) + normal * 0.45;
        let tilt = glam::DQuat::from_rotation_x(0.7);
        vertices.push(tilt * point + DVec3::new(0.0, 0.0, 3.0));
        normals.push(tilt * normal);
        colors.push([0.5 + 0.5 * a.cos() as f32, 0.4, 0.5 + 0.5 * b.sin() as f32, 1.0]);
    }
    let name = |i: usize, j: usize| ((i % rings) * sides + j % sides) as u32;
    let triangles: Vec<[u32; 3]> = (0..rings)
        .flat_map(|i| (0..sides).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let corners = [name(i, j), name(i + 1, j), name(i + 1, j + 1), name(i, j + 1)];
            [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
        })
        .collect();
    let objects = vec![1; triangles.len()];
    Mesh { vertices, triangles, colors, normals, objects }
}

struct Buffers {
    beauty: Vec<[f32; 4]>,
    depth: Vec<f32>,
    coverage: Vec<f32>,
    object_id: Vec<u16>,
}

impl Buffers {
    fn new() -> Self {
        let size = WIDTH * HEIGHT;
        Buffers {
            beauty: vec![[1.0; 4]; size],
            depth: vec![1.0; size],
            coverage: vec![1.0; size],
            object_id: vec![1; size],
        }
    }

    fn fill(&mut self, value: f32) {
        self.beauty.fill([value; 4]);
        self.depth.fill(value);
        self.coverage.fill(value);
        self.object_id.fill(value as u16);
    }

    fn render(&mut self, mesh: &Mesh, bands: &[f32], ink: Ink) {
        let Mesh { vertices, triangles, colors, normals, objects } = mesh;
        let scene = Scene { vertices, triangles, colors, normals, objects };
        let (x, y, focal) = (WIDTH as f64 / 2.0, HEIGHT as f64 / 2.0, 2300.0);
        let matrix = [[focal, 0.0, x, 0.0], [0.0, focal, y, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let view = View { matrix, near: 0.01, width: WIDTH, height: HEIGHT, margin: 0 };
        let Buffers { beauty, depth, coverage, object_id } = self;
        let out = Passes { beauty, depth, coverage, object_id };
        assert_eq!(render_passes(&scene, &view, Toon { light: LIGHT, bands }, ink, out), Ok(()));
    }
}

fn passes(c: &mut Criterion) {
    let mut buffers = Buffers::new();
    let mesh = torus(184, 90);
    let mut group = c.benchmark_group("raster 1080p 2x2, 33k triangles");
    group.sample_size(10);
    group.bench_function("fill of the same buffers", |b| b.iter(|| buffers.fill(black_box(1.0))));
    group.bench_function("flat", |b| b.iter(|| buffers.render(black_box(&mesh), &[], NO_INK)));
    let covered = buffers.coverage.iter().sum::<f32>() / buffers.coverage.len() as f32;
    assert!(covered > 0.4, "the scene must fill the picture, it covers {covered}");
    group.bench_function("toon", |b| b.iter(|| buffers.render(black_box(&mesh), &[0.4, 0.7, 1.0], NO_INK)));
    group.bench_function("toon and ink", |b| b.iter(|| buffers.render(black_box(&mesh), &[0.4, 0.7, 1.0], INK)));
    group.finish();
}

fn growth(c: &mut Criterion) {
    let mut buffers = Buffers::new();
    let mut group = c.benchmark_group("raster 1080p 2x2, triangles");
    group.sample_size(10);
    for (rings, sides) in [(32, 16), (100, 50), (320, 158), (1000, 500)] {
        let mesh = torus(rings, sides);
        let count = mesh.triangles.len() as u64;
        group.throughput(Throughput::Elements(count));
        group.bench_function(BenchmarkId::from_parameter(count), |b| b.iter(|| buffers.render(&mesh, &[], NO_INK)));
    }
    group.finish();
}

criterion_group!(benches, passes, growth);
criterion_main!(benches);
