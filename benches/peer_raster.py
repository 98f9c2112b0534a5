"""render_passes at 1080p with 2x2 samples: beside filling the same buffers once, by size, and beside Mesa's llvmpipe.

llvmpipe draws the same triangles through moderngl and EGL to four float and integer targets (beauty, planar depth,
coverage, object id) with as many threads; coverage and depth of both are compared in the run.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benches.measure import Row, alternate
from pegbar import Ink, Mesh, Passes, PerspectiveCamera, render_passes

SAMPLES = 2
CAMERA = PerspectiveCamera.look_at((0, 1.7, 2.5), (0, 0, 0), (1920, 1080), math.radians(50))
WIDTH, HEIGHT = (SAMPLES * side for side in CAMERA.image_size)
NEAR, FAR = 0.01, 100.0
BANDS = (0.4, 0.7, 1.0)

VERTEX_SHADER = """
#version 330
uniform mat4 view;
uniform vec3 eye;
in vec3 place;
in vec4 color;
in vec3 normal;
out vec4 vertex_color;
out vec3 vertex_normal;
out vec3 from_eye;
void main() {
    gl_Position = view * vec4(place, 1.0);
    vertex_color = color;
    vertex_normal = normal;
    from_eye = place - eye;
}
"""
FRAGMENT_SHADER = """
#version 330
uniform vec3 light;
in vec4 vertex_color;
in vec3 vertex_normal;
in vec3 from_eye;
layout(location = 0) out vec4 beauty;
layout(location = 1) out float depth;
layout(location = 2) out float coverage;
layout(location = 3) out uint object_id;
void main() {
    float turned = dot(normalize(faceforward(vertex_normal, from_eye, vertex_normal)), light);
    float factor = turned < -1.0 / 3.0 ? 0.4 : turned < 1.0 / 3.0 ? 0.7 : 1.0;
    beauty = vec4(vertex_color.rgb * vertex_color.a * factor, vertex_color.a);
    depth = 1.0 / gl_FragCoord.w;
    coverage = 1.0;
    object_id = 1u;
}
"""


def run() -> Iterator[Row]:
    """Yield rows: passes beside fills, growth with the triangles, and llvmpipe."""
    mesh = torus(184, 90)
    yield from beside_fills(mesh)
    yield from growth()
    yield from beside_llvmpipe(mesh)


def torus(rings: int, sides: int) -> Mesh:
    """A torus with a colour at every vertex and 2 * rings * sides triangles, most of the picture wide."""
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij"))
    a, b = 2 * np.pi * i / rings, 2 * np.pi * j / sides
    reach = 1 + 0.45 * np.cos(b)
    vertices = np.stack([reach * np.cos(a), 0.45 * np.sin(b), reach * np.sin(a)], axis=1)
    colors = np.stack([0.5 + 0.5 * np.cos(a), np.full(a.shape, 0.4), j / sides, np.ones(a.shape)], axis=1)
    p, q, r, s = ((i + di) % rings * sides + (j + dj) % sides for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return Mesh(vertices, np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)]), colors)


def buffers() -> list[NDArray[Any]]:
    """Passes of the supersampled size, not yet touched."""
    plane = (HEIGHT, WIDTH)
    return [np.empty((*plane, 4), np.float32), *(np.empty(plane, kind) for kind in (np.float32, np.float32, np.uint16))]


def fill(parts: list[NDArray[Any]]) -> None:
    """Write every value once."""
    for part in parts:
        part.fill(1)


def beside_fills(mesh: Mesh) -> Iterator[Row]:
    """Yield rows for flat colours, bands, and bands with ink, beside filling fresh and used buffers."""
    used = buffers()
    for name, options in {
        "flat": {},
        "bands": {"bands": BANDS},
        "bands and ink": {"bands": BANDS, "ink": Ink()},
    }.items():

        def render(options: dict[str, Any] = options) -> Passes:
            return render_passes([mesh], CAMERA, samples=SAMPLES, **options)

        ours, fresh, again = alternate(render, lambda: fill(buffers()), lambda: fill(used))
        yield Row(
            f"render_passes 33k triangles, {name}",
            f"{ours:.0f} ms",
            f"np.empty and fill {fresh:.0f} ms, fill again {again:.0f} ms",
            f"{ours / fresh:.1f}x and {ours / again:.1f}x",
            "promise 6x",
            f"covers {render().coverage.mean():.0%}",
        )


def growth() -> Iterator[Row]:
    """Yield rows for 1k to 1M triangles on the same picture."""
    for rings, sides in ((32, 16), (100, 50), (320, 158), (1000, 500)):
        mesh = torus(rings, sides)
        count = len(mesh.triangles)
        (taken,) = alternate(lambda mesh=mesh: render_passes([mesh], CAMERA, samples=SAMPLES), rounds=5)
        pace = f"{count / taken / 1e3:.2f} M triangles/s"
        yield Row(f"render_passes {count} triangles, flat", f"{taken:.0f} ms, {pace}", "", "")


def beside_llvmpipe(mesh: Mesh) -> Iterator[Row]:
    """Yield one row beside Mesa's software rasteriser, or why there is none."""
    os.environ.setdefault("LP_NUM_THREADS", os.environ.get("RAYON_NUM_THREADS", "1"))
    os.environ.setdefault("GALLIUM_DRIVER", "llvmpipe")
    try:
        import moderngl

        context = moderngl.create_context(standalone=True, backend="egl")
    except Exception as error:  # moderngl raises bare exceptions for a missing library or driver
        yield Row.left_out("llvmpipe", error)
        return
    draw, read = peer(context, mesh)

    def render() -> Passes:
        return render_passes([mesh], CAMERA, samples=SAMPLES, near=NEAR, light=(0.4, 0.8, 0.45), bands=BANDS)

    ours, drawn, both = alternate(render, draw, lambda: (draw(), read()))
    yield Row(
        "render_passes 33k triangles, bands",
        f"{ours:.0f} ms",
        f"{context.info['GL_RENDERER']}, {os.environ['LP_NUM_THREADS']} thread: drawn {drawn:.0f} ms, "
        f"with reading back {both:.0f} ms",
        f"{drawn / ours:.1f}x and {both / ours:.1f}x",
        "",
        agreement(render(), read()),
    )


def peer(context: Any, mesh: Mesh) -> tuple[Callable[[], None], Callable[[], list[NDArray[Any]]]]:
    """Two calls: one draws the mesh and waits, one brings the four targets to numpy."""
    kinds = ((4, "f4", np.float32), (1, "f4", np.float32), (1, "f4", np.float32), (1, "u2", np.uint16))
    targets = [context.texture((WIDTH, HEIGHT), channels, dtype=dtype) for channels, dtype, _ in kinds]
    frame = context.framebuffer(targets, context.depth_texture((WIDTH, HEIGHT)))
    program = context.program(vertex_shader=VERTEX_SHADER, fragment_shader=FRAGMENT_SHADER)
    program["view"].write(clip_matrix().T.astype("f4").tobytes())
    program["light"].value = tuple(np.array([0.4, 0.8, 0.45]) / np.linalg.norm([0.4, 0.8, 0.45]))
    program["eye"].value = tuple(CAMERA.position)
    vertices = np.concatenate([mesh.vertices, mesh.colors, mesh.normals], axis=1, dtype=np.float32)
    layout = [(context.buffer(vertices.tobytes()), "3f 4f 3f", "place", "color", "normal")]
    array = context.vertex_array(program, layout, context.buffer(mesh.triangles.astype("u4").tobytes()))

    def draw() -> None:
        frame.use()
        context.enable(context.DEPTH_TEST)
        frame.clear()
        array.render()
        context.finish()

    def read() -> list[NDArray[Any]]:
        out = []
        for target, (channels, _, kind) in zip(targets, kinds, strict=True):
            part = np.empty((HEIGHT, WIDTH, channels), kind)
            target.read_into(part)
            out.append(part)
        return out

    return draw, read


def clip_matrix() -> NDArray[np.float64]:
    """World to clip space such that the picture's first row is the target's first row in memory."""
    rows = CAMERA.scaled(SAMPLES).matrix
    x = 2 * (rows[0] + rows[2] / 2) / WIDTH - rows[2]
    y = 2 * (rows[1] + rows[2] / 2) / HEIGHT - rows[2]
    z = rows[2] * (FAR + NEAR) / (FAR - NEAR) - np.array([0, 0, 0, 2 * FAR * NEAR / (FAR - NEAR)])
    return np.stack([x, y, z, rows[2]])


def agreement(ours: Passes, theirs: list[NDArray[Any]]) -> str:
    """How far both differ; raises where it is more than rims and rounding."""
    covered = ours.coverage > 0, theirs[2][..., 0] > 0
    differ = float((covered[0] != covered[1]).mean())
    both = covered[0] & covered[1]
    depth = np.abs(theirs[1][..., 0][both] / ours.depth[both] - 1)
    color = np.abs(theirs[0][both] - ours.beauty[both]).max(axis=1)
    if differ > 1e-4 or np.quantile(depth, 0.999) > 1e-4 or np.quantile(color, 0.99) > 0.01:
        raise AssertionError(f"llvmpipe differs: coverage {differ}, depth {depth.max()}, colour {color.mean()}")
    return (
        f"coverage differs on {differ:.1e} of the samples, depth by {np.quantile(depth, 0.999):.0e} (99.9%), "
        f"colour by {np.quantile(color, 0.99):.0e} (99%)"
    )
