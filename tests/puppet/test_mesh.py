import cv2
import numpy as np
import pytest

from pegbar.puppet.layers import Layer
from pegbar.puppet.mesh import layered_mesh, mesh_spacing
from pegbar.puppet.outline import outlines
from pegbar.puppet.parts import grow_parts
from pegbar.puppet.template import covered
from tests.figures import animal, figure
from tests.puppet.test_layers import cut


def meshed(source, view=None):
    _, layers, _ = cut(source, view=view)
    parts = grow_parts(source, source.mask)
    return layers, layered_mesh(source, layers, parts.bones, mesh_spacing(source.mask.sum()))


@pytest.mark.parametrize("source", [figure(), figure(60), animal()], ids=["front", "half", "animal"])
def test_the_mesh_covers_each_layer_and_little_more(source):
    layers, mesh = meshed(source)
    for index, layer in enumerate(layers):
        own = covered(mesh.vertices, mesh.triangles[mesh.triangle_layer == index], source.image_size)
        assert not (layer.region & ~own).any()
        near = cv2.dilate(layer.region.view(np.uint8), np.ones((7, 7), np.uint8)).astype(bool)
        assert not (own & ~near).any()
    assert set(np.unique(mesh.triangles)) == set(range(len(mesh.vertices)))
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (area > 0).all()
    assert 300 < len(mesh.triangles) < 2600


@pytest.mark.parametrize("source", [figure(), figure(60), animal()], ids=["front", "half", "animal"])
def test_handles_lie_along_the_bones(source):
    _, mesh = meshed(source)
    ends = source.marks[source.bones[mesh.handle_bone]]
    want = ends[:, 0] + mesh.handle_fraction[:, None] * (ends[:, 1] - ends[:, 0])
    np.testing.assert_allclose(mesh.vertices[mesh.handles], want, atol=1e-9)
    np.testing.assert_allclose(mesh.vertices[mesh.handles[mesh.joint_handles]], source.marks, atol=0.5)
    assert len(set(mesh.handles.tolist())) == len(mesh.handles)
    assert set(mesh.handle_bone.tolist()) == set(range(len(source.bones)))


def test_layers_share_vertices_where_limbs_hang_and_nowhere_else():
    source = figure(60)
    layers, mesh = meshed(source)
    corners = [set(mesh.triangles[mesh.triangle_layer == index].ravel().tolist()) for index in range(len(layers))]
    body = next(index for index, layer in enumerate(layers) if layer.parent < 0)
    for index, layer in enumerate(layers):
        if index == body:
            continue
        shared = sorted(corners[index] & corners[body])
        assert mesh.handles[mesh.joint_handles[layer.joint]] in shared
        assert len(shared) > 2
        joint = source.marks[layer.joint]
        ahead = source.marks[source.bones[layer.bones[0], 1]] - joint
        assert ((mesh.vertices[shared] - joint) @ ahead <= 1e-9).all()
        assert not mesh.boundary[shared].any()
    assert mesh.boundary.any()


def test_triangles_hang_on_bones_of_their_layer():
    source = figure(60)
    layers, mesh = meshed(source)
    for bone, layer in zip(mesh.triangle_bone, mesh.triangle_layer, strict=True):
        assert bone in layers[layer].bones


def test_the_outline_is_simple_to_a_pixel_and_fine_enough():
    mask = figure().mask
    (outer,), holes = outlines(mask, 9.0)
    assert not holes
    sides = np.linalg.norm(outer - np.roll(outer, -1, axis=0), axis=1)
    assert sides.max() <= 9 + 1e-9
    contour = max(cv2.findContours(mask.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0], key=len)[:, 0]
    off = [abs(cv2.pointPolygonTest(outer.astype(np.float32), place.astype(float).tolist(), True)) for place in contour]
    assert max(off) <= 1.01


def test_a_region_whose_outline_touches_itself_is_still_triangulated():
    mask = np.zeros((90, 90), bool)
    for step in range(0, 60, 4):
        mask[10 + step : 13 + step, 10:80] = True
        mask[10 + step : 14 + step, 10 if step % 8 else 77] = True
    source = figure(mask=mask, marks=np.array([[20.0, 11.0], [60.0, 11.0]]), names=("pelvis", "neck"))
    source = type(source)(**{**vars(source), "bones": np.array([[0, 1]]), "image": np.zeros((90, 90, 4), np.uint8)})
    mesh = layered_mesh(source, [Layer("body", (0,), mask, mask)], mask.astype(np.uint8), 6.0)
    assert len(mesh.triangles) > 50
