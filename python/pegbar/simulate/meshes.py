"""The cache as meshes to render: cloth with patterns, strands, balls, boxes, props, and the characters' volumes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh, smooth_normals
from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Balls, Boxes, Cloth, Prop, Strands
from pegbar.simulate.field_meshes import field_mesh
from pegbar.simulate.fields import Puddle, SnowField
from pegbar.simulate.finer import Finer, finer_sheet
from pegbar.simulate.hulls import hull_triangles, hull_vertices, poses
from pegbar.simulate.particle_meshes import particle_mesh
from pegbar.simulate.pattern import sheet_colors
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes
from pegbar.simulate.tubes import strand_meshes
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: Metres between the two sides of a cloth whose back has its own colour.
TWO_SIDES = 0.0015
#: Around a ball and from pole to pole, and the lunes of a striped one.
AROUND, DOWN, LUNES = 24, 12, 6


class Models:
    """The meshes of a scene's elements, made ready once and put in place for every frame.

    ``finer`` divides every cloth triangle's sides, so that patterns have clean edges and folds are round.
    """

    def __init__(self, scene: SimulationScene, *, finer: int = 3) -> None:
        if not 1 <= finer <= 16:
            raise ValueError(f"finer: want 1 to 16, got {finer}")
        self._scene = scene
        self._sheets = {cloth.name: _dress(cloth, finer) for cloth in scene.elements if isinstance(cloth, Cloth)}

    def meshes(self, cache: Cache, frame: int) -> list[Mesh]:
        """Return the elements' meshes in ``frame`` (from 0); object ids count the scene's elements from 1.

        Strands are as wide as the scene's camera needs to see them without gaps. KeyError for a frame that is not in
        the cache.
        """
        camera = self._scene.cameras[frame] if self._scene.cameras else None
        found: list[Mesh] = []
        for element in self._scene.elements:
            state = cache.read(element.name, frame)
            number = self._scene.object_id(element.name)
            if isinstance(element, Particles):
                found.append(particle_mesh(element, state, camera, self._scene.frame_rate, number))
                continue
            if isinstance(element, SnowField | Puddle):
                found.append(field_mesh(element, state, self._scene.ground or 0.0, number))
                continue
            positions = np.asarray(state["positions"], np.float64)
            found += self._of(element, positions, state.get("rotations"), camera)
        return found

    def _of(
        self,
        element: Cloth | Strands | Balls | Boxes | Prop,
        positions: Floats,
        rotations: NDArray[np.float64] | None,
        camera: PerspectiveCamera | None,
    ) -> list[Mesh]:
        number = self._scene.object_id(element.name)
        if isinstance(element, Cloth):
            return self._sheets[element.name].meshes(positions, number)
        if isinstance(element, Strands):
            return strand_meshes(element, positions, number, camera)
        if isinstance(element, Balls | Boxes):
            turns = np.tile([0.0, 0, 0, 1], (len(positions), 1)) if rotations is None else rotations
            return [_bodies(element, positions, np.asarray(turns, np.float64), number)]
        colors = np.array(element.look.color, np.float32) if element.colors is None else element.colors
        return [Mesh(positions, element.triangles, colors, number)]


def volume_meshes(scene: SimulationScene, frame: int, color: tuple[float, ...] = (0.4, 0.4, 0.4, 1.0)) -> list[Mesh]:
    """Return the characters' volumes in ``frame`` as one mesh: to look at, and to cast shadows; object id 65535."""
    rows = Volumes(scene, ()).at(np.array([float(frame)]))[0]
    centers, turns = poses(rows)
    vertices = [
        Rotation.from_quat(turn).apply(hull_vertices(float(np.linalg.norm(row[4:7] - row[:3])), row[3], row[7]))
        + center
        for row, center, turn in zip(rows, centers, turns, strict=True)
    ]
    if not vertices:
        return []
    count = len(vertices[0])
    triangles = np.concatenate([hull_triangles().astype(np.int64) + index * count for index in range(len(rows))])
    return [Mesh(np.concatenate(vertices), triangles, np.array(color, np.float32), 0xFFFF)]


@dataclass(frozen=True, eq=False)
class _Dressed:
    """A cloth's finer sheet with its colours, and those of its back where it has its own."""

    finer: Finer
    front: NDArray[np.float32]
    back: NDArray[np.float32] | None

    def meshes(self, positions: Floats, number: int) -> list[Mesh]:
        vertices, triangles = self.finer.place(positions), self.finer.triangles
        normals = smooth_normals(vertices, triangles)
        if self.back is None:
            return [Mesh(vertices, triangles, self.front, number, normals)]
        lift = normals * (TWO_SIDES / 2)
        front = Mesh(vertices + lift, triangles, self.front, number, normals)
        return [front, Mesh(vertices - lift, triangles, self.back, number, -normals)]


def _dress(cloth: Cloth, finer: int) -> _Dressed:
    plain = cloth.look.pattern == "plain" and cloth.look.texture is None
    sheet = finer_sheet(len(cloth.vertices), cloth.triangles, 2 if plain and finer > 2 else finer)
    front = sheet_colors(cloth, sheet)
    back = cloth.look.back
    behind = None if back is None else np.tile(np.array(back, np.float32), (len(front), 1))
    return _Dressed(sheet, front, behind)


def _bodies(element: Balls | Boxes, positions: Floats, rotations: Floats, number: int) -> Mesh:
    """All bodies of a set as one mesh."""
    if isinstance(element, Balls):
        vertices, triangles, second = _ball()
        normals, scales = vertices, np.repeat(element.radii[:, None], 3, axis=1)
    else:
        vertices, normals, triangles = _box()
        second, scales = np.zeros(len(vertices), bool), element.sizes / 2
    own = np.tile(np.array(element.look.color, np.float32), (len(positions), 1))
    own = own if element.colors is None else element.colors
    striped = second & (element.look.pattern != "plain")
    turns = Rotation.from_quat(rotations).as_matrix() if len(rotations) else np.empty((0, 3, 3))
    placed = np.einsum("bij,bvj->bvi", turns, vertices * scales[:, None]) + positions[:, None]
    pointed = np.einsum("bij,vj->bvi", turns, normals)
    colors = np.where(striped[None, :, None], np.array(element.look.second, np.float32), own[:, None])
    offsets = (np.arange(len(positions)) * len(vertices))[:, None, None]
    every = (triangles + offsets).reshape(-1, 3)
    return Mesh(placed.reshape(-1, 3), every, colors.reshape(-1, 4), number, pointed.reshape(-1, 3))


def _ball() -> tuple[Floats, Integers, NDArray[np.bool_]]:
    """A unit ball of lunes that share no vertices, so that their colours meet sharply, and which are the second's."""
    columns = AROUND // LUNES + 1
    rows = np.linspace(0, np.pi, DOWN + 1)
    vertices, triangles, second = [], [], []
    for lune in range(LUNES):
        turn = (lune + np.linspace(0, 1, columns)) * (2 * np.pi / LUNES)
        polar, around = np.meshgrid(rows, turn, indexing="ij")
        places = np.stack([np.sin(polar) * np.cos(around), np.cos(polar), np.sin(polar) * np.sin(around)], -1)
        vertices.append(places.reshape(-1, 3))
        i, j = np.meshgrid(np.arange(DOWN), np.arange(columns - 1), indexing="ij")
        a = (i * columns + j).ravel() + lune * columns * (DOWN + 1)
        corners = [np.stack([a, a + 1, a + columns], -1), np.stack([a + 1, a + columns + 1, a + columns], -1)]
        triangles += corners
        second.append(np.full(columns * (DOWN + 1), lune % 2 == 1))
    return np.concatenate(vertices), np.concatenate(triangles), np.concatenate(second)


def _box() -> tuple[Floats, Floats, Integers]:
    """A box from -1 to 1 with four own vertices a side."""
    vertices: list[Floats] = []
    normals: list[Floats] = []
    triangles: list[Integers] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = sign
            corners[:, u] = np.array([-1, 1, 1, -1]) * sign
            corners[:, v] = [-1, -1, 1, 1]
            normal = np.zeros(3)
            normal[axis] = sign
            first = 4 * len(vertices)
            vertices.append(corners)
            normals.append(np.tile(normal, (4, 1)))
            triangles.append(np.array([[first, first + 1, first + 2], [first, first + 2, first + 3]]))
    return np.concatenate(vertices), np.concatenate(normals), np.concatenate(triangles)
