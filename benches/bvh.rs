//! A BVH text of 31 joints and 2600 frames, 2 MB, parsed; its forward kinematics.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pegbar_kernels::bvh::parse;
use pegbar_kernels::kinematics::{Skeleton, forward_kinematics};
use std::fmt::Write;
use std::hint::black_box;

const JOINTS: usize = 31;
const FRAMES: usize = 2600;

fn text() -> String {
    let mut text = String::from("HIERARCHY\n");
    for joint in 0..JOINTS {
        let kind = if joint == 0 { "ROOT" } else { "JOINT" };
        let channels = if joint == 0 { "6 Xposition Yposition Zposition" } else { "3" };
        let turns = "Zrotation Yrotation Xrotation";
        let _ = writeln!(text, "{kind} joint{joint} {{ OFFSET 0.1 1.5 0.2 CHANNELS {channels} {turns}");
    }
    let _ = writeln!(text, "{}\nMOTION\nFrames: {FRAMES}\nFrame Time: .0083333", "}".repeat(JOINTS));
    for frame in 0..FRAMES {
        for channel in 0..3 * JOINTS + 3 {
            let _ = write!(text, "{:.4} ", (frame * channel % 3571) as f64 / 19.0 - 90.0);
        }
        text.push('\n');
    }
    text
}

fn bench(c: &mut Criterion) {
    let text = text();
    let Ok(clip) = parse(text.as_bytes()) else { return };
    let skeleton = Skeleton {
        parents: &clip.parents,
        offsets: &clip.offsets,
        axes: &[],
        counts: &clip.counts,
        channels: &clip.channels,
        degrees: true,
    };
    let (mut places, mut turns) = (vec![[0.0; 3]; FRAMES * JOINTS], vec![[0.0; 9]; FRAMES * JOINTS]);
    let mut group = c.benchmark_group("bvh 31 joints");
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("parse", |b| b.iter(|| parse(black_box(text.as_bytes()))));
    group.throughput(Throughput::Elements((FRAMES * JOINTS) as u64));
    group.bench_function("forward kinematics", |b| {
        b.iter(|| forward_kinematics(&skeleton, black_box(&clip.values), &mut places, &mut turns))
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
