from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "SOURCES",
    "Deformer",
    "average_triangles",
    "capsule_distances",
    "composite_matte",
    "constrained_delaunay",
    "convert_srgb",
    "depth_composite",
    "fill_matte",
    "fill_polygon",
    "fit_poses",
    "fit_triangles",
    "forward_kinematics",
    "geodesic_labels",
    "grow_labels",
    "has_alpha",
    "ink_alpha",
    "inside_rings",
    "length_costs",
    "lift_markers",
    "limb_depth",
    "limb_depths",
    "matte",
    "nearest_view",
    "over_ground",
    "own_alpha",
    "pack_gif_frames",
    "palette_labels",
    "parse_amc",
    "parse_bvh",
    "pose_distance",
    "render_passes",
    "render_sheet",
    "resample_view",
    "resolve_passes",
    "rim_depth",
    "search_clips",
    "segment_rows",
    "segment_stick_figure",
    "step_cloth",
    "step_particles",
    "step_strands",
    "stroke_polyline",
    "time_warp",
    "unpremultiply",
]

SOURCES: str

_Floats = NDArray[np.float32]
_Doubles = NDArray[np.float64]
_Indices = NDArray[np.uint32]
_Place = tuple[float, float, float]
_Pictures = tuple[_Floats, _Floats, _Floats, NDArray[np.uint16]]

def convert_srgb(pixels: NDArray[np.float32], encode: bool) -> NDArray[np.float32]: ...
def depth_composite(
    drawing: NDArray[np.uint8],
    alpha: NDArray[np.float32],
    drawing_depth: NDArray[np.float32],
    rendered: NDArray[Any],
    rendered_depth: NDArray[np.float32],
    scale: int,
    linear: list[bool],
    out: NDArray[Any],
) -> None: ...
def limb_depth(
    labels: NDArray[np.uint8], ends: NDArray[np.float64], end_depths: NDArray[np.float64], perspective: bool
) -> NDArray[np.float32]: ...
def lift_markers(
    projection: NDArray[np.float64],
    limbs: NDArray[np.int64],
    lengths: NDArray[np.float64],
    prior: NDArray[np.float64],
    weights: tuple[float, float],
    subspace: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> NDArray[np.float64]: ...
def limb_depths(
    drawn: tuple[_Doubles, _Doubles, _Doubles, _Doubles], lengths: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def length_costs(
    drawn: tuple[_Doubles, _Doubles, _Doubles, _Doubles], candidates: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def segment_stick_figure(
    gray: NDArray[np.uint8], ends: NDArray[np.float64], half_widths: NDArray[np.float64], threshold: int
) -> NDArray[np.uint8]: ...
def over_ground(drawn: NDArray[np.uint8], ground: NDArray[np.uint8]) -> NDArray[np.uint8]: ...
def pack_gif_frames(
    frames: NDArray[np.uint8], table: NDArray[np.uint8], previous: NDArray[np.uint8] | None
) -> list[tuple[list[int], bytes]]: ...
def palette_labels(
    segmentation: NDArray[np.uint8], colors: NDArray[np.uint8], labels: NDArray[np.uint8], tolerance: float
) -> tuple[NDArray[np.uint8], int, list[int] | None]: ...
def grow_labels(labels: NDArray[np.uint8], figure: NDArray[np.uint8], reach: float | None) -> NDArray[np.uint8]: ...
def geodesic_labels(
    seeds: NDArray[np.uint8], costs: NDArray[np.float32], paces: NDArray[np.float64]
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]: ...
def ink_alpha(image: NDArray[np.uint8]) -> NDArray[np.float32]: ...
def own_alpha(image: NDArray[np.uint8]) -> NDArray[np.float32]: ...
def has_alpha(image: NDArray[np.uint8]) -> bool: ...
def matte(image: NDArray[np.uint8], mode: str) -> tuple[NDArray[np.uint8], NDArray[np.float32]]: ...
def fill_matte(
    image: NDArray[np.uint8], labels: NDArray[np.uint8]
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]: ...
def fill_polygon(
    pixels: NDArray[np.uint8], points: NDArray[np.float64], color: tuple[int, int, int, int], antialias: bool
) -> None: ...
def stroke_polyline(
    pixels: NDArray[np.uint8],
    points: NDArray[np.float64],
    widths: NDArray[np.float64],
    closed: bool,
    color: tuple[int, int, int, int],
    antialias: bool,
) -> None: ...
def unpremultiply(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]: ...
def render_passes(
    geometry: tuple[_Doubles, NDArray[np.uint32], _Floats, _Doubles, NDArray[np.uint16]],
    camera: tuple[list[list[float]], int, int],
    near: float,
    toon: tuple[tuple[float, float, float], _Floats],
    ink: tuple[float, tuple[float, float, float, float], float, float],
) -> _Pictures: ...
def resolve_passes(
    beauty: _Floats, depth: _Floats, coverage: _Floats, object_id: NDArray[np.uint16], factor: int
) -> _Pictures: ...
def composite_matte(
    alpha: NDArray[np.float32],
    drawing_depth: NDArray[np.float32],
    rendered_alpha: NDArray[np.float32] | None,
    rendered_depth: NDArray[np.float32],
    scale: int,
) -> NDArray[np.float32]: ...
def nearest_view(known: NDArray[np.uint8], view: list[float], size: list[int]) -> NDArray[np.int64]: ...
def resample_view(picture: NDArray[np.float32], view: list[float], size: list[int]) -> NDArray[np.float32]: ...
def rim_depth(rendered: NDArray[Any], rendered_depth: NDArray[np.float32]) -> NDArray[np.float32] | None: ...
def parse_amc(path: str, text: bytes, bones: list[tuple[str, int]]) -> tuple[list[str], int, int, _Doubles]: ...
def parse_bvh(
    path: str, text: bytes
) -> tuple[
    tuple[list[str], list[int], _Doubles, list[int], _Doubles], tuple[list[int], NDArray[np.uint8], float, _Doubles]
]: ...
def forward_kinematics(
    joints: tuple[list[int], _Doubles, _Doubles, list[int], NDArray[np.uint8]], values: _Doubles, degrees: bool
) -> tuple[_Doubles, _Doubles]: ...
def fit_poses(
    joints: _Doubles,
    poses: _Doubles,
    options: tuple[list[float], float, float | None, list[float], str, float, int],
) -> tuple[_Doubles, _Doubles, _Doubles]: ...
def pose_distance(a: _Doubles, b: _Doubles, weights: _Doubles, a_trust: _Doubles, b_trust: _Doubles) -> _Doubles: ...
def time_warp(
    cost: _Doubles, open_begin: bool, open_end: bool, slope_limit: int | None
) -> tuple[float, NDArray[np.int64]]: ...
def search_clips(
    vectors: _Floats,
    ranges: NDArray[np.uint64],
    views: _Floats,
    drawn: tuple[_Floats, _Floats, NDArray[np.uint32], NDArray[np.uint32]],
    block: int,
) -> tuple[_Floats, NDArray[np.uint32]]: ...
def segment_rows(
    costs: _Doubles, steps: NDArray[np.uint32], before: _Doubles
) -> tuple[_Doubles, NDArray[np.uint16]]: ...
def capsule_distances(points: _Doubles, capsules: _Doubles) -> tuple[_Doubles, NDArray[np.uint32]]: ...
def step_cloth(
    made: tuple[_Doubles, _Indices, _Indices, _Doubles, _Indices, _Doubles, _Indices, _Doubles, _Indices, _Doubles],
    acting: tuple[
        tuple[float, float],
        tuple[float, tuple[float, float, float]],
        tuple[float, float, float, float, float],
        int,
    ],
    air: _Doubles,
    pins: tuple[_Indices, _Doubles],
    capsules: _Doubles,
    state: tuple[_Doubles, _Doubles],
) -> None: ...
def step_particles(
    behaviour: tuple[
        tuple[float, tuple[float, float, float]],
        float,
        tuple[float, float],
        tuple[float, float],
        tuple[int, float],
        tuple[float, float, float, float],
        tuple[_Place, _Place],
    ],
    capsules: _Doubles,
    facets: tuple[_Doubles, _Doubles, _Indices],
    ground: tuple[float, bool, list[tuple[tuple[float, float], float, bool, _Doubles]]],
    air: tuple[_Place, _Doubles, float],
    state: tuple[_Doubles, NDArray[np.int64]],
) -> _Doubles: ...
def step_strands(
    made: tuple[_Doubles, _Indices, _Indices],
    acting: tuple[tuple[float, tuple[float, float, float]], tuple[float, float, float, float, float], int],
    air: _Doubles,
    pins: tuple[_Indices, _Doubles],
    capsules: _Doubles,
    state: tuple[_Doubles, _Doubles],
) -> None: ...
def fit_triangles(shapes: _Doubles, intermediate: _Doubles, triangles: NDArray[np.uint32]) -> _Doubles: ...
def average_triangles(fitted: _Doubles, triangles: NDArray[np.uint32], count: int) -> _Doubles: ...

@final
class Deformer:
    def __new__(
        cls,
        vertices: _Doubles,
        triangles: NDArray[np.uint32],
        handles: NDArray[np.uint32],
        guides: NDArray[np.uint32],
    ) -> Deformer: ...
    def deform(self, positions: _Doubles, shapes: _Doubles | None, iterations: int, average: bool) -> _Doubles: ...

def render_sheet(
    vertices: _Doubles,
    triangles: NDArray[np.uint32],
    texture_coordinates: _Doubles,
    texture: NDArray[np.uint8],
    size: tuple[int, int],
    samples: int,
) -> NDArray[np.uint8]: ...
def constrained_delaunay(
    points: _Doubles, edges: NDArray[np.uint32]
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]: ...
def inside_rings(places: _Doubles, rings: list[tuple[_Doubles, bool]]) -> NDArray[np.bool_]: ...
