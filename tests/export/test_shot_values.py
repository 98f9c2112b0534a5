"""A shot as arrays and as JSON: both hold it, and the same."""

import io
import json
from pathlib import Path

import numpy as np

from pegbar import PerspectiveCamera
from pegbar.export.shot_values import shot_arrays, shot_table
from tests.export.shots import FRAMES, shot


def stored(scene):
    file = io.BytesIO()
    np.savez_compressed(file, **shot_arrays(scene))
    file.seek(0)
    return np.load(file, allow_pickle=False), json.loads(
        json.dumps(shot_table(scene, Path("/shots/walk/export")), allow_nan=False)
    )


def test_both_give_the_shot_back():
    scene = shot(zoom=0.02, shift=(12.5, -3))
    arrays, table = stored(scene)
    assert table["frames"] == arrays["frames"].tolist() == list(FRAMES)
    assert arrays["drawings"].tolist() == [1, 1, 2, 2, 3, 3, -1, -1]
    assert table["drawings"][-3:] == [3, None, None]
    assert table["pictures"][:2] == ["../d.0001.png", "../d.0001.png"]
    assert (table["frame_rate"], table["image_size"], table["ground"]) == (12.0, [960, 540], 0.0)
    for row, camera in enumerate(scene.cameras):
        np.testing.assert_array_equal(arrays["camera_matrix"][row], camera.matrix)
        assert PerspectiveCamera(table["camera"]["matrix"][row], table["image_size"]) == camera
    for number, character in enumerate(scene.characters, 1):
        np.testing.assert_array_equal(arrays[f"character_{number}_markers"], character.markers)
        np.testing.assert_array_equal(arrays[f"character_{number}_end_radius"], character.volumes.end_radius)
        entry = table["characters"][number - 1]
        assert entry["name"] == character.name
        for index, name in enumerate(character.marker_names):
            listed = [[np.nan] * 3 if place is None else place for place in entry["markers"][name]]
            np.testing.assert_array_equal(listed, character.markers[:, index])
        for index, name in enumerate(character.limb_names):
            radii = [np.nan if value is None else value for value in entry["limbs"][name]["start_radius"]]
            np.testing.assert_array_equal(radii, character.volumes.start_radius[:, index])


def test_pose_focal_length_and_principal_point_make_the_matrix():
    scene = shot(zoom=0.02, shift=(12.5, -3))
    arrays, table = stored(scene)
    for row, camera in enumerate(scene.cameras):
        (wide, tall), (across, down) = table["camera"]["focal_length"][row], table["camera"]["principal_point"][row]
        pose = np.array(table["camera"]["to_world"][row]) @ np.diag([1.0, -1, -1, 1])
        inner = np.array([[wide, 0, across], [0, tall, down], [0, 0, 1]])
        np.testing.assert_allclose(inner @ np.linalg.inv(pose)[:3], camera.matrix, atol=1e-9)
    np.testing.assert_array_equal(arrays["focal_length"][3], table["camera"]["focal_length"][3])
