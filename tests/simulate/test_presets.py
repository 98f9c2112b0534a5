"""Presets: sizes from the character, clear of the body at the start, every wrong setting named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pegbar import _kernels
from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.elements import Balls, Cloth, Prop, Strands
from pegbar.simulate.figure import body_height, capsules_of, limb_between
from pegbar.simulate.presets import PRESETS, preset_elements
from pegbar.simulate.scene import Character, SimulationScene
from pegbar.simulate.wearing import grid_triangles
from tests.walkers import walker


def scaled(figure: Character, factor: float) -> Character:
    volumes = figure.volumes
    grown = replace(volumes, **{name: factor * getattr(volumes, name) for name in volumes.__dataclass_fields__})
    return replace(figure, markers=factor * figure.markers, volumes=grown)


@pytest.mark.parametrize("kind", PRESETS)
def test_sizes_are_the_characters(kind):
    small, large = (preset_elements(kind, scaled(walker(8), factor), ground=0.0, seed=1) for factor in (1, 2))
    assert [element.name for element in small] == [element.name for element in large]
    for one, two in zip(small, large, strict=True):
        if isinstance(one, Balls):
            assert two.radii == pytest.approx(2 * one.radii)
        elif isinstance(one, Strands):
            assert two.points == pytest.approx(2 * one.points, abs=0.01)
            assert two.radii == pytest.approx(2 * one.radii)
        elif isinstance(one, Cloth) and isinstance(two, Cloth):
            rests = [cloth.vertices if cloth.rest is None else cloth.rest for cloth in (one, two)]
            spans = [np.linalg.norm(np.ptp(rest, axis=0)) for rest in rests]
            assert spans[1] == pytest.approx(2 * spans[0], rel=0.05)


@pytest.mark.parametrize("kind", PRESETS)
def test_every_preset_makes_a_scene_with_its_names(kind):
    figure = walker(8)
    elements = preset_elements(kind, figure, name="mine", ground=0.0)
    assert all(element.name.startswith("mine") for element in elements)
    SimulationScene(24, 8, elements, (figure,), ground=0.0)


def test_a_skirt_starts_outside_of_trunk_and_legs():
    figure = walker(8)
    (skirt,) = preset_elements("skirt", figure)
    lower = [i for i, name in enumerate(figure.limb_names) if name.partition("_")[2] in ("thigh", "shin") or i == 0]
    rows = np.ascontiguousarray(capsules_of(figure, 0)[lower])
    points = np.concatenate([skirt.vertices, skirt.vertices[skirt.triangles].mean(axis=1)])
    assert _kernels.capsule_distances(points, rows)[0].min() > 0
    assert skirt.pins[0].vertices.tolist() == list(range(72))
    top = skirt.vertices[:72]
    assert np.ptp(top[:, 1]) < 1e-9
    assert np.linalg.norm(skirt.rest[:72] - top, axis=1).max() < 1e-9


def test_scarves_hang_at_the_wrists():
    figure = walker(8)
    scarves = preset_elements("scarves", figure, length=0.5)
    assert [scarf.name for scarf in scarves] == ["scarves_left", "scarves_right"]
    for side, scarf in zip(("left", "right"), scarves, strict=True):
        hand, elbow = (figure.markers[0, figure.marker_names.index(f"{side}_{joint}")] for joint in ("hand", "elbow"))
        wrist = elbow + 0.85 * (hand - elbow)
        assert np.linalg.norm(scarf.vertices[scarf.pins[0].vertices] - wrist, axis=1).max() < 0.06
        assert np.ptp(scarf.rest[:, 0]) == pytest.approx(0.5 * body_height(figure))
        assert scarf.pins[0].target == f"{side}_forearm"
    assert len(preset_elements("scarves", figure, hands="left")) == 1


def test_balls_lie_apart_on_the_ground_and_a_seed_gives_the_same():
    figure = walker(24)
    (balls,) = preset_elements("balls", figure, ground=0.02, seed=3, count=30)
    assert balls.centers[:, 1] == pytest.approx(0.02 + balls.radii)
    gaps = np.linalg.norm(balls.centers[:, None] - balls.centers[None], axis=2) - balls.radii - balls.radii[:, None]
    assert gaps[~np.eye(30, dtype=bool)].min() > 0
    assert _kernels.capsule_distances(balls.centers, capsules_of(figure, 0))[0].min() > 0.03
    (same,), (other,) = (preset_elements("balls", figure, ground=0.02, seed=seed, count=30) for seed in (3, 4))
    assert (same.centers == balls.centers).all()
    assert (other.centers != balls.centers).any()


def test_a_clothesline_runs_along_the_way_on_the_hands_side():
    figure = walker(24, speed=1.5)
    line, *pieces = preset_elements("clothesline", figure, ground=0.0, side="left", count=3)
    assert isinstance(line, Prop)
    assert len(pieces) == 3
    assert np.ptp(line.vertices[:, 2]) > 3 * np.ptp(line.vertices[:, 0])
    # The figure walks along +Z, so its left is +X.
    hand = figure.markers[:, figure.marker_names.index("left_hand"), 0].max()
    assert 0.5 * hand < line.vertices[:, 0].mean() <= hand
    for piece in pieces:
        assert piece.vertices[piece.pins[0].vertices, 1] == pytest.approx(piece.vertices[:, 1].max())


@pytest.mark.parametrize(
    ("kind", "settings", "words"),
    [
        ("kilt", {}, "no preset 'kilt': there are scarves, skirt, clothesline, balls, .*balloon, pompoms"),
        ("rope", {"length": 0.01}, "length: the hands are up to 0.[0-9]+ body heights apart, got 0.01"),
        ("rope", {"hands": "feet"}, "hands: want left, right or both, got 'feet'"),
        ("rope", {"fineness": 2}, "fineness: want 4 to 400"),
        ("rope", {"pattern": "plaid"}, "pattern: want one of"),
        ("rope", {"stiffness": -1}, "stiffness: want a finite number"),
        ("balloon", {"hand": "both"}, "hand: want left or right, got 'both'"),
        ("balloon", {"count": 0}, "count: want 1 to 50 on strings of 4 to 200 links"),
        ("balloon", {"size": 0}, "size: want a number above zero"),
        ("balloon", {"colors": ()}, "colors: want one or more"),
        ("pompoms", {"count": 3}, "count: want 8 to 5000 strands of 3 to 64 links"),
        ("pompoms", {"spread": 1}, "spread: want less than 1"),
        ("strands", {"at": "tail"}, "no marker 'tail'"),
        ("strands", {"side": "east"}, "side: want one of back, front"),
        ("strands", {"thickness": 0}, "thickness: want a number above zero"),
        ("skirt", {"lenght": 1}, "skirt: no setting 'lenght': there are color, second.*did you mean 'length'"),
        ("pompoms", {"size": "big"}, "pompoms: size: want a number, got 'big'"),
        ("pompoms", {"hands": 2}, "pompoms: hands: want a text in quotes, got 2"),
        ("skirt", {"length": -1}, "length: want a finite number"),
        ("skirt", {"flare": 1.0}, "flare: want less than 1"),
        ("skirt", {"fineness": 3}, "fineness: want 8 to 512"),
        ("skirt", {"color": "red"}, "skirt: color: want #rrggbb, got 'red'"),
        ("skirt", {"stiffness": -1}, "bend: want a finite number"),
        ("scarves", {"hands": "all"}, "hands: want left, right or both"),
        ("scarves", {"pattern": "paisley"}, "pattern: want one of"),
        ("balls", {"count": 0}, "count: want 1 to 2000"),
        ("balls", {"ground": None}, "balls: want a ground"),
        ("clothesline", {"side": "up"}, "side: want left or right"),
        ("clothesline", {"count": 0}, "count: want 1 to 50"),
    ],
)
def test_what_is_wrong_is_named(kind, settings, words):
    with pytest.raises(ValueError, match=words):
        preset_elements(kind, walker(4), **{"ground": 0.0, **settings})


def test_colours_may_be_written_as_in_pictures():
    (skirt,) = preset_elements("skirt", walker(4), color="#ff8000", second=(0.1, 0.2, 0.3, 1.0))
    assert skirt.look.color == pytest.approx((1.0, 0.2158605, 0.0, 1.0))
    assert skirt.look.second == (0.1, 0.2, 0.3, 1.0)


def test_limbs_are_found_by_their_markers_or_by_their_places():
    figure = walker(8)
    assert limb_between(figure, "left_hand", "left_elbow") == figure.limb_names.index("left_forearm")
    bare = replace(figure, limb_markers=None)
    for limb, (start, end) in enumerate(figure.limb_markers):
        assert limb_between(bare, start, end) == limb
    with pytest.raises(ValueError, match="walker: no limb from head to left_foot"):
        limb_between(figure, "head", "left_foot")
    with pytest.raises(ValueError, match="walker: no marker 'tail': there are pelvis"):
        limb_between(bare, "tail", "left_foot")


def test_grids_are_whole_and_closed():
    open_grid, closed = grid_triangles(3, 4), grid_triangles(3, 4, closed=True)
    assert len(open_grid) == 2 * 2 * 3
    assert len(closed) == 2 * 2 * 4
    edges = np.sort(np.concatenate([closed[:, [0, 1]], closed[:, [1, 2]], closed[:, [2, 0]]]), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 1).sum() == 8
    assert set(counts.tolist()) == {1, 2}
    # Every edge is gone along once in each direction: all triangles turn the same way.
    directed = np.concatenate([closed[:, [0, 1]], closed[:, [1, 2]], closed[:, [2, 0]]])
    assert len(np.unique(directed, axis=0)) == len(directed)


def hand_of(figure: Character, side: str) -> np.ndarray:
    return figure.markers[:, figure.marker_names.index(f"{side}_hand")]


def test_a_clothesline_hangs_across_the_picture_where_its_end_would_be_seen():
    figure, ahead = walker(24, speed=0.0), (PerspectiveCamera.look_at((0.1, 1, 5), (0, 1, 0), (96, 54), 0.8),)
    for found in (figure, walker(24, speed=1.5)):
        line, *_ = preset_elements("clothesline", found, ground=0.0, cameras=ahead)
        assert np.ptp(line.vertices[:, 0]) > 5 * np.ptp(line.vertices[:, 2])
    # Nobody says from where it is seen: then it hangs along the hips' line, and a walker's along the way.
    assert np.ptp(preset_elements("clothesline", figure, ground=0.0)[0].vertices[:, 0]) > 1
    beside = (PerspectiveCamera.look_at((5, 1, 0), (0, 1, 0), (96, 54), 0.8),)
    for cameras in ((), beside):
        line, *_ = preset_elements("clothesline", walker(24, speed=1.5), ground=0.0, cameras=cameras)
        assert np.ptp(line.vertices[:, 2]) > 5 * np.ptp(line.vertices[:, 0])
    for eye in (5, -5):
        cameras = (PerspectiveCamera.look_at((eye, 1, 0), (0, 1, 0), (96, 54), 0.8),)
        line, *_ = preset_elements("clothesline", walker(24, speed=1.5), ground=0.0, cameras=cameras)
        assert line.vertices[:, 0].mean() * eye < 0
    behind, before = (preset_elements("clothesline", figure, cameras=ahead, side=s)[0] for s in ("left", "right"))
    assert behind.vertices[:, 2].mean() < -0.1 < 0.1 < before.vertices[:, 2].mean()
    # The arms swing too little to brush what hangs behind; swung farther they do.
    assert np.allclose(preset_elements("clothesline", figure, cameras=ahead)[0].vertices, before.vertices)
    wide = walker(24, speed=0.0, swing=1.0)
    line, *_ = preset_elements("clothesline", wide, cameras=ahead)
    reach = min(hand_of(wide, side)[:, 2].min() for side in ("left", "right"))
    assert line.vertices[:, 2].mean() == pytest.approx(0.9 * reach, abs=0.02)


def test_a_rope_sags_between_the_hands_and_is_never_too_short():
    figure = walker(24)
    (rope,) = preset_elements("rope", figure, ground=0.0, length=0.8)
    assert rope.link_lengths.sum() == pytest.approx(0.8 * body_height(figure), rel=3e-3)
    assert np.ptp(rope.link_lengths[:-1]) < 0.02 * rope.link_lengths[0]
    for side, end in (("left", 0), ("right", -1)):
        assert rope.points[end] == pytest.approx(hand_of(figure, side)[0])
    assert [(pin.target, pin.vertices.tolist()) for pin in rope.pins] == [
        ("left_forearm", [0]),
        ("right_forearm", [40]),
    ]
    free = preset_elements("rope", figure)[0].link_lengths.sum()
    assert free > 1.2 * np.linalg.norm(hand_of(figure, "left") - hand_of(figure, "right"), axis=1).max()
    (hung,) = preset_elements("rope", figure, ground=0.0, hands="left", length=0.9)
    assert hung.points[:, 1].min() == pytest.approx(hung.radii[0])
    assert hung.link_lengths.sum() == pytest.approx(0.9 * body_height(figure), rel=3e-3)


def test_balloons_stand_over_the_hand_on_strings_of_their_length():
    figure = walker(4)
    height = body_height(figure)
    (one,) = preset_elements("balloon", figure, hand="right", length=0.4, size=0.2)
    assert one.bobs.radii == pytest.approx([0.1 * height])
    assert one.points[0] == pytest.approx(hand_of(figure, "right")[0])
    assert one.link_lengths[:-2].sum() == pytest.approx(0.4 * height)
    assert one.points[-1] - one.points[0] == pytest.approx([0, (0.4 + 0.114) * height, 0])
    (bunch,) = preset_elements("balloon", figure, count=7, seed=2)
    assert len(bunch.counts) == 7
    assert len(np.unique(bunch.bobs.colors, axis=0)) == 6
    (same,), (other,) = (preset_elements("balloon", figure, count=7, seed=seed) for seed in (2, 3))
    assert (same.points == bunch.points).all()
    assert (other.points != bunch.points).any()


def test_pom_poms_go_out_to_all_sides_of_the_hands():
    figure = walker(4)
    left, right = preset_elements("pompoms", figure, count=100, size=0.3, spread=0.2)
    assert (left.name, right.name) == ("pompoms_left", "pompoms_right")
    for side, pompom in (("left", left), ("right", right)):
        tips = pompom.points[np.cumsum(pompom.counts) - 1] - hand_of(figure, side)[0]
        lengths = np.linalg.norm(tips, axis=1) / body_height(figure)
        assert 0.12 <= lengths.min() < 0.13
        assert 0.145 < lengths.max() <= 0.15
        assert np.abs(tips.mean(axis=0)).max() < 0.01
        assert len(pompom.pins[0].vertices) == 200
    assert len(preset_elements("pompoms", figure, hands="left", count=10)) == 1


@pytest.mark.parametrize(("side", "axis", "sign"), [("back", 2, -1), ("front", 2, 1), ("left", 0, 1), ("up", 1, 1)])
def test_a_tuft_grows_out_of_the_head(side, axis, sign):
    figure = walker(4)
    (tuft,) = preset_elements("strands", figure, side=side, count=30)
    first = np.cumsum(tuft.counts) - tuft.counts
    assert _kernels.capsule_distances(tuft.points, capsules_of(figure, 0))[0].min() > 0
    roots, tips = tuft.points[first], tuft.points[first + tuft.counts - 1]
    assert (sign * (tips - roots)[:, axis]).min() > 0.1
    head = figure.markers[0, figure.marker_names.index("head")]
    assert np.linalg.norm(roots - head, axis=1).max() < 0.2
    assert tuft.pins[0].target == "head"


def test_strands_hold_a_marker_without_a_limb():
    figure = walker(4)
    torso = figure.limb_names.index("torso")
    keep = [i for i in range(len(figure.limb_names)) if i != torso]
    volumes = replace(
        figure.volumes, **{n: getattr(figure.volumes, n)[:, keep] for n in figure.volumes.__dataclass_fields__}
    )
    names, ends = (tuple(values[i] for i in keep) for values in (figure.limb_names, figure.limb_markers))
    bare = Character("bare", figure.marker_names, figure.markers, names, volumes, ends)
    (tuft,) = preset_elements("strands", bare, at="pelvis", count=3)
    assert (tuft.pins[0].kind, tuft.pins[0].target) == ("marker", "pelvis")
