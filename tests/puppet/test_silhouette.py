import cv2
import numpy as np
import pytest

from pegbar.puppet.silhouette import find_silhouette, paper_mask, person_mask
from pegbar.puppet.template import covered, fit_template, person_template
from pegbar.scene.body import MARKERS
from tests.figures import animal, figure, marks, painted

RNG = np.random.default_rng(5)


def overlap(a, b):
    return (a & b).sum() / (a | b).sum()


def before_a_wall(source):
    """The figure before a wall of another colour, with grain."""
    wall = np.full((*source.mask.shape, 3), (120, 130, 90), np.uint8)
    wall[200:] = (90, 80, 70)
    image = np.where(source.mask[..., None], source.image[..., :3], wall).astype(int)
    image += RNG.integers(-12, 13, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("view", "layers"), [("front", 1), ("half profile", 4), ("side", 4), ("back", 1)])
def test_templates_have_the_layers_of_the_papers_figure(view, layers):
    template = person_template(view)
    assert len(template.layers) == layers
    mesh = template.mesh
    np.testing.assert_allclose(mesh.vertices[mesh.handles[mesh.joint_handles]], template.marks, atol=0.5)
    corners = [set(mesh.triangles[mesh.triangle_layer == index].ravel().tolist()) for index in range(layers)]
    body = next(index for index, layer in enumerate(template.layers) if layer.parent < 0)
    assert all(corners[index] & corners[body] for index in range(layers))


def test_a_template_at_its_own_joints_is_itself():
    template = person_template("front")
    np.testing.assert_allclose(
        fit_template(template, template.names, template.marks), template.mesh.vertices, atol=1e-6
    )
    moved = fit_template(template, template.names, 2 * template.marks + 7)
    np.testing.assert_allclose(moved, 2 * template.mesh.vertices + 7, atol=1e-6)


def test_a_template_follows_the_figures_joints():
    source = figure()
    template = person_template("front")
    shape = fit_template(template, source.names, source.marks)
    np.testing.assert_allclose(shape[template.mesh.handles[template.mesh.joint_handles]], source.marks, atol=0.5)
    likely = covered(shape, template.mesh.triangles, source.image_size)
    assert overlap(likely, source.mask) > 0.6
    with pytest.raises(ValueError, match="want both ends of one of a person's bones"):
        fit_template(template, ("tail", "wing"), np.zeros((2, 2)))


def test_a_person_is_cut_from_a_wall():
    source = figure()
    photo = figure(image=before_a_wall(source), mask=None)
    assert overlap(person_mask(photo), source.mask) > 0.93
    found, on_paper = find_silhouette(photo)
    assert not on_paper
    np.testing.assert_array_equal(found, person_mask(photo))


def test_what_lines_enclose_on_paper_is_the_figure():
    _, mask = painted(marks())
    paper = np.full((*mask.shape, 3), 235, np.uint8)
    paper = (paper + np.linspace(-12, 12, mask.shape[1])[None, :, None]).astype(np.uint8)
    outline = cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_GRADIENT, np.ones((5, 5), np.uint8)) > 0
    paper[outline] = 40
    drawn = mask | outline
    assert overlap(paper_mask(paper), drawn) > 0.97
    found, on_paper = find_silhouette(figure(image=paper, mask=None))
    assert on_paper
    np.testing.assert_array_equal(found, paper_mask(paper))
    assert paper_mask(RNG.integers(0, 255, paper.shape).astype(np.uint8)) is None


def test_an_animal_without_a_mask_needs_one():
    source = animal()
    noise = RNG.integers(0, 255, (*source.mask.shape, 3)).astype(np.uint8)
    source = type(source)(**{**vars(source), "mask": None, "image": noise})
    with pytest.raises(ValueError, match="the figure has limbs that a person has not: give a mask"):
        find_silhouette(source)


def test_the_head_is_among_what_is_found():
    source = figure()
    mask = person_mask(figure(image=before_a_wall(source), mask=None))
    columns, rows = np.rint(source.marks).astype(int).T
    assert mask[rows, columns].all()
    assert mask[rows[MARKERS.index("head")] - 8, columns[MARKERS.index("head")]]
