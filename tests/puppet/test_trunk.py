import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar.puppet.asap import AsapShapes
from pegbar.puppet.drawn_pose import drawn_pose
from pegbar.puppet.make import make_puppet
from pegbar.puppet.trunk import Trunk
from tests.figures import animal, clip, figure


@pytest.fixture(scope="module")
def person():
    puppet = make_puppet(figure(), clip(), completion="flat", view="front")
    return puppet, drawn_pose(puppet)


def turned(poses, puppet, degrees):
    """A pose turned about the pelvis, by each of ``degrees``."""
    middle = poses[puppet.names.index("pelvis")]
    about = Rotation.from_euler("y", np.array(degrees, float)[:, None], degrees=True).as_matrix()
    return np.einsum("fij,nj->fni", about, poses - middle) + middle


def test_the_trunk_is_as_broad_as_drawn_in_the_drawn_pose_and_narrower_in_a_turn(person):
    puppet, rest = person
    trunk = Trunk.of_puppet(puppet, rest)
    assert {puppet.names[puppet.bones[bone, 1]] for bone in trunk.spine} == {"chest", "neck"}
    breadths = trunk.breadths(puppet.camera, turned(rest, puppet, [0, 20, 40, -40, 85]))
    assert breadths[0] == pytest.approx(1)
    assert 1 > breadths[1] > breadths[2] > breadths[4]
    assert breadths[2] == pytest.approx(breadths[3], abs=0.03)
    # 0.77 of the distance is seen, beside 0.3 of it that always counts.
    assert breadths[2] == pytest.approx((np.cos(np.radians(40)) + 0.3) / 1.3, abs=0.03)
    assert breadths[4] == 0.7


def test_the_waist_follows_the_breadth(person):
    puppet, rest = person
    shapes = AsapShapes.of_puppet(puppet, rest, inflation=0).shapes(turned(rest, puppet, [0, 45]))
    chest = puppet.marks[puppet.names.index("chest")]
    waist = np.flatnonzero((np.abs(puppet.vertices - chest) < [24, 8]).all(axis=1))
    broad = np.ptp(shapes[:, waist, 0], axis=1)
    assert broad[0] > 25
    assert 0.65 < broad[1] / broad[0] < 0.9


def test_who_is_no_person_has_no_trunk():
    puppet = make_puppet(animal(), clip(), completion="flat")
    rest = drawn_pose(puppet)
    trunk = Trunk.of_puppet(puppet, rest)
    assert not trunk.spine
    np.testing.assert_array_equal(trunk.breadths(puppet.camera, turned(rest, puppet, [0, 60])), 1)
