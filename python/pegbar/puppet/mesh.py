"""A layered triangle mesh of a figure with bone vertices (Hornung et al. 2007, section 6 and figure 3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pegbar.errors import DegenerateError
from pegbar.puppet.layers import Layer
from pegbar.puppet.outline import outlines
from pegbar.puppet.parts import bone_distances
from pegbar.puppet.triangulation import triangulate
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
#: Triangles of a small and of a large picture's figure.
FEWEST, MOST = 700, 2400
#: How near to a corner of the mesh, in parts of the spacing, no further one is put.
_NEAR = 0.55
#: How near, in parts of the spacing, vertices along different bones may be, and how near in pixels joints are one.
_LEAST, _SAME = 0.25, 0.5
#: How far from the outline a vertex inside is at least, in pixels.
_CLEAR = 0.3
#: How far a region is grown, so that its soft border is on the mesh, and how simple its outline is made: the later ones
#: are for regions whose simplified outline crosses itself.
_ATTEMPTS = ((1, 1.0), (1, 0.5), (2, 1.0), (3, 0.5), (2, 0.0))


@dataclass(frozen=True, eq=False)
class LayeredMesh:
    """Vertices, triangles, handles and boundary of a puppet: the fields of `Puppet` with the same names."""

    vertices: Floats
    triangles: Ints
    triangle_layer: Ints
    triangle_bone: Ints
    handles: Ints
    handle_bone: Ints
    handle_fraction: Floats
    joint_handles: Ints
    boundary: Flags


def mesh_spacing(region_area: float) -> float:
    """How far apart vertices are, in pixels, for a figure that covers ``region_area`` pixels.

    A figure of 30 000 pixels gets about 900 triangles, one of 300 000 2 000.
    """
    count = np.clip(8.0 * region_area**0.44, FEWEST, MOST)
    return max(3.0, math.sqrt(region_area / count / (math.sqrt(3) / 4)))


def layered_mesh(source: PuppetInput, layers: Sequence[Layer], bones: NDArray[np.uint8], spacing: float) -> LayeredMesh:
    """Triangulate the layers of a figure, joined at the vertices that they share.

    Parameters
    ----------
    source : PuppetInput
        Marks and bones.
    layers : sequence of Layer
        Front to back.
    bones : (H, W) uint8
        The bone that each pixel belongs to, v + 1; 0 for none.
    spacing : float
        How far apart vertices are, in pixels.
    """
    builder = _Builder(source, layers, spacing)
    # A layer that another hangs on comes later: it takes over the other's corners.
    order = sorted(range(len(layers)), key=lambda index: layers[index].parent < 0)
    for index in order:
        builder.add(index)
    return builder.finish(bones)


class _Builder:
    """Collects the vertices and triangles of the layers; those that hang on others come first."""

    def __init__(self, source: PuppetInput, layers: Sequence[Layer], spacing: float) -> None:
        self.source, self.layers, self.spacing = source, layers, spacing
        self.points: list[Floats] = []
        self.triangles: list[Ints] = []
        self.layer_of: list[Ints] = []
        self.edge: set[int] = set()
        self.handles: list[tuple[int, int, float]] = []
        self.joints: dict[int, int] = {}
        self.shared: dict[int, list[int]] = {index: [] for index in range(len(layers))}

    def add(self, index: int) -> None:
        """Triangulate one layer: as simplified as its outline allows without crossing itself."""
        layer = self.layers[index]
        problem: ValueError | None = None
        for grown, tolerance in _ATTEMPTS:
            size = 2 * grown + 1
            region = cv2.dilate(layer.region.view(np.uint8), np.ones((size, size), np.uint8)).astype(bool)
            state = len(self.points), len(self.handles), dict(self.joints)
            try:
                self._triangulate(index, region, *outlines(region, self.spacing, tolerance=tolerance))
                return
            except ValueError as error:
                problem = error
                del self.points[state[0] :], self.handles[state[1] :]
                self.joints = state[2]
        raise DegenerateError(f"layer {layer.name}: its outline cannot be triangulated: {problem}")

    def _triangulate(self, index: int, region: Flags, outer: list[Floats], holes: list[Floats]) -> None:
        layer = self.layers[index]
        if not outer:
            raise ValueError("it has no outline")
        corners = [i for ring in (*outer, *holes) for i in self._new(ring)]
        known = np.array([self.points[i] for i in corners])
        within = [i for i in self.shared[index] if _is_inside(self.points[i], outer, holes)]
        inside = self._apart([*self._bone_vertices(layer, outer, holes), *within])
        known = np.concatenate([known, np.array([self.points[i] for i in inside]).reshape(-1, 2)])
        grid = _grid(region, self.spacing, known)
        inner = self._new(np.array([place for place in grid if _is_inside(place, outer, holes)]).reshape(-1, 2))
        local = [*corners, *inside, *inner]
        places = np.array([self.points[i] for i in (*inside, *inner)]).reshape(-1, 2)
        found = triangulate(outer, holes=holes, points=places, split_edges=False)
        self.triangles.append(np.array(local, np.int64)[found.triangles])
        self.layer_of.append(np.full(len(found.triangles), index, np.int64))
        self._join(layer, corners)

    def finish(self, bones: NDArray[np.uint8]) -> LayeredMesh:
        """The mesh, without vertices that no triangle has."""
        vertices, triangles = np.array(self.points), np.concatenate(self.triangles)
        held = self._held(triangles)
        triangles, layer_of = triangles[held], np.concatenate(self.layer_of)[held]
        used, compact = np.unique(triangles, return_inverse=True)
        place = np.full(len(vertices), -1, np.int64)
        place[used] = np.arange(len(used))
        handles = [(int(place[vertex]), bone, part) for vertex, bone, part in self.handles if place[vertex] >= 0]
        index_of = {vertex: index for index, (vertex, _, _) in enumerate(handles)}
        joints = [index_of.get(int(place[self.joints[j]]), -1) if j in self.joints else -1 for j in self._all_joints()]
        boundary = np.zeros(len(used), bool)
        boundary[[place[i] for i in self.edge if place[i] >= 0]] = True
        vertices, triangles = vertices[used], compact.reshape(triangles.shape).astype(np.int64)
        return LayeredMesh(
            vertices=vertices,
            triangles=triangles,
            triangle_layer=layer_of,
            triangle_bone=self._bone_of(vertices[triangles].mean(axis=1), layer_of, bones),
            handles=np.array([handle[0] for handle in handles], np.int64),
            handle_bone=np.array([handle[1] for handle in handles], np.int64),
            handle_fraction=np.array([handle[2] for handle in handles], np.float64),
            joint_handles=np.array(joints, np.int64),
            boundary=boundary,
        )

    def _held(self, triangles: Ints) -> Flags:
        """Which triangles hang together with a handle; others could not be placed."""
        links = (np.ones(2 * len(triangles)), (triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()))
        pieces = connected_components(coo_array(links, shape=(len(self.points),) * 2), directed=False)[1]
        held: Flags = np.isin(pieces[triangles[:, 0]], pieces[[handle[0] for handle in self.handles]])
        return held

    def _all_joints(self) -> range:
        return range(len(self.source.names))

    def _new(self, places: Floats) -> list[int]:
        start = len(self.points)
        self.points.extend(places)
        return list(range(start, len(self.points)))

    def _bone_vertices(self, layer: Layer, outer: list[Floats], holes: list[Floats]) -> list[int]:
        """The vertices along the layer's bones; those at joints are shared by all layers that meet there."""
        found: list[int] = []
        for bone in layer.bones:
            ends = [int(joint) for joint in self.source.bones[bone]]
            start, end = self.source.marks[ends]
            parts = max(1, round(float(np.linalg.norm(end - start)) / self.spacing))
            joints = [joint for joint in ends if _is_inside(self.source.marks[joint], outer, holes)]
            for joint in joints:
                found.append(self._joint_vertex(joint, bone, found))
            for step in range(1, parts):
                place = start + step / parts * (end - start)
                apart = min((math.dist(place, self.points[i]) for i in found), default=math.inf)
                if apart > _LEAST * self.spacing and _is_inside(place, outer, holes):
                    found += (vertex := self._new(place[None]))
                    self.handles.append((vertex[0], bone, step / parts))
        return found

    def _apart(self, vertices: list[int]) -> list[int]:
        """The vertices, each once, without those at an earlier one's place (of limbs drawn one over the other)."""
        kept: list[int] = []
        for vertex in dict.fromkeys(vertices):
            if all(math.dist(self.points[vertex], self.points[other]) > _SAME for other in kept):
                kept.append(vertex)
        return kept

    def _joint_vertex(self, joint: int, bone: int, found: Sequence[int]) -> int:
        """The vertex at a joint, new where there is none; its handle is at the end of the bone that leads to it.

        Joints at one place share the vertex if it is among those ``found`` on the layer already.
        """
        if joint not in self.joints:
            place = self.source.marks[joint]
            twin = next((j for j in self.joints if self._is_twin(j, place, found)), None)
            self.joints[joint] = self._new(place[None])[0] if twin is None else self.joints[twin]
            if twin is None:
                leading = np.flatnonzero(self.source.bones[:, 1] == joint)
                handle = (self.joints[joint], int(leading[0]), 1.0) if len(leading) else (self.joints[joint], bone, 0.0)
                self.handles.append(handle)
        return self.joints[joint]

    def _is_twin(self, joint: int, place: Floats, found: Sequence[int]) -> bool:
        return self.joints[joint] in found and math.dist(self.source.marks[joint], place) < _SAME

    def _join(self, layer: Layer, outline: Sequence[int]) -> None:
        """Note which vertices of a layer's outline are on its parent too: those behind the joint that it hangs by."""
        behind: set[int] = set()
        if layer.parent >= 0:
            joint = self.source.marks[layer.joint]
            ahead = np.mean([self.source.marks[self.source.bones[bone, 1]] for bone in layer.bones[:1]], axis=0) - joint
            region = self.layers[layer.parent].region
            inner = cv2.erode(region.view(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
            behind = {i for i in outline if (self.points[i] - joint) @ ahead <= 0 and _holds(inner, self.points[i])}
            self.shared[layer.parent] += sorted(behind)
        self.edge |= set(outline) - behind

    def _bone_of(self, centres: Floats, layer_of: Ints, bones: NDArray[np.uint8]) -> Ints:
        """The bone of each triangle: its pixels' where that is of its layer, else the nearest of the layer."""
        columns, rows = np.rint(centres).astype(int).T
        found = bones[rows.clip(0, bones.shape[0] - 1), columns.clip(0, bones.shape[1] - 1)]
        owner: Ints = found.astype(np.int64) - 1
        for index, layer in enumerate(self.layers):
            own = np.array(layer.bones, np.int64)
            strange = np.flatnonzero((layer_of == index) & ~np.isin(owner, own))
            ends = self.source.marks[self.source.bones[own]]
            owner[strange] = own[np.argmin(bone_distances(centres[strange], ends)[0], axis=1)]
        return owner


def _grid(region: Flags, spacing: float, known: Floats) -> Floats:
    """Points of an even triangular grid inside a region, none near to a ``known`` one."""
    rows, columns = np.nonzero(region)
    high = spacing * math.sqrt(3) / 2
    y = np.arange(rows.min() + high / 2, rows.max() + 1, high)
    x = np.arange(columns.min(), columns.max() + spacing, spacing)
    grid = np.stack(np.broadcast_arrays(x[None] + spacing / 2 * (np.arange(len(y)) % 2)[:, None], y[:, None]), axis=2)
    points = grid.reshape(-1, 2)
    points = points[[_holds(region, point) for point in points]]
    near = cKDTree(known).query(points)[0] < _NEAR * spacing if len(points) else np.zeros(0, bool)
    kept: Floats = points[~near]
    return kept


def _is_inside(place: Floats, outer: Sequence[Floats], holes: Sequence[Floats]) -> bool:
    """Whether a place lies inside an outline and outside the holes, and not on one of them."""

    def deep(ring: Floats) -> float:
        return float(cv2.pointPolygonTest(ring.astype(np.float32), (float(place[0]), float(place[1])), True))

    return any(deep(ring) > _CLEAR for ring in outer) and all(deep(ring) < -_CLEAR for ring in holes)


def _holds(region: Flags, place: Floats) -> bool:
    x, y = round(float(place[0])), round(float(place[1]))
    return 0 <= y < region.shape[0] and 0 <= x < region.shape[1] and bool(region[y, x])
