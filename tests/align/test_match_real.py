"""The search on the 31 real clips: walks before anything else, cut-out pieces, and what does not fit."""

import dataclasses

import numpy as np
import pytest

from pegbar import OrthographicCamera, match_clips, read_annotations, read_clips
from pegbar.align.match import seen_from
from pegbar.scene.body import MARKERS
from tests.dancers import apart

WALKS = {
    "bvh/cmu_02_01.bvh": 2,
    "asfamc/02_01.amc": 2,
    "bvh/cmu_07_01.bvh": 7,
    "asfamc/07_05-walk.amc": 7,
    "bvh/cmu_35_01.bvh": 35,
    "bvh/cmu_16_11.bvh": 16,
    "asfamc/16_11.amc": 16,
    "bvh/cmu_08_07.bvh": 8,
    "c3d/pycgm_movement_trial.c3d": 0,
}
# Slow walks, and clips that begin or end with steps: neither right nor wrong for a walk.
NEITHER = {"bvh/cmu_131_01_max.bvh", "bvh/cmu_120_08_trim.bvh", "asfamc/17_03.amc"}


@pytest.fixture(scope="session")
def clips(test_data):
    folder = read_clips(test_data / "mocap", use_index=False)
    assert (folder.broken, folder.skipped, len(folder.clips)) == ({}, {}, 31)
    return {clip.name: clip for clip in folder.clips}


def facing(markers):
    left, right = (
        markers[:, [MARKERS.index(f"{side}_{j}") for j in ("hip", "shoulder")]] for side in ("left", "right")
    )
    across = (left - right).sum(axis=(0, 1))
    return np.degrees(np.arctan2(-across[2], across[0]))


def seen(clip, azimuth, *, start=None, seconds=2.0, rate=24.0, elevation=5.0):
    """Drawings of a clip from ``azimuth`` degrees to the person's left, and the camera's azimuth in the world."""
    count = int(min(seconds, clip.seconds) * rate)
    start = (clip.seconds - count / rate) / 2 if start is None else start
    markers = clip.at(clip.first + (start + np.arange(count) / rate) * clip.frame_rate)
    world = facing(markers) + azimuth
    return OrthographicCamera.from_angles(world, elevation).project(markers), world


@pytest.mark.parametrize("azimuth", [0, 45, 90], ids=["front", "three-quarter", "side"])
@pytest.mark.parametrize("name", ["bvh/cmu_35_01.bvh", "asfamc/02_01.amc"])
def test_walks_of_other_actors_come_before_runs_jumps_and_dances(clips, name, azimuth):
    marks, _ = seen(clips[name], azimuth)
    others = [clip for clip in clips.values() if WALKS.get(clip.name) != WALKS[name]]
    found = match_clips(marks, MARKERS, others, frame_rate=24, top=16)
    ranked = [match.clip for match in found.matches if match.clip not in NEITHER]
    firsts = list(dict.fromkeys(ranked))
    assert set(firsts[:5]) <= set(WALKS), firsts[:8]
    assert found.matches[0].verdict == "fits"
    assert all(match.clip in WALKS.keys() | NEITHER for match in found.matches if match.verdict == "fits")


@pytest.mark.parametrize(
    ("name", "start", "seconds", "azimuth"),
    [
        ("bvh/cmu_07_01.bvh", 0.4, 1.5, 90),
        ("asfamc/lambada.amc", 9.13, 2.0, 30),
        ("c3d/ktk_tennis_serve.c3d", 6.2, 1.0, 120),
        ("bvh/ad_fair1_jumping.bvh", 2.27, 1.0, 0),
        ("bvh/cmu_05_13.bvh", 3.011, 0.8, 200),
        ("asfamc/09_01.amc", 0.2, 0.9, 300),
    ],
)
def test_a_piece_cut_out_is_found_within_two_frames(clips, name, start, seconds, azimuth):
    clip = clips[name]
    marks, world = seen(clip, azimuth, start=start, seconds=seconds)
    found = match_clips(marks, MARKERS, clips.values(), frame_rate=24)
    # The same motion in another format is as good; between these the order is chance.
    match = next(match for match in found.matches if match.clip == name)
    assert match.cost - found.matches[0].cost < 1
    first = clip.first + start * clip.frame_rate
    last = first + (len(marks) - 1) / 24 * clip.frame_rate
    assert match.start == pytest.approx(first, abs=2)
    assert match.stop - 1 == pytest.approx(last, abs=2)
    assert apart(match.azimuth, world) < 3
    assert (match.verdict, match.mirrored, match.swapped) == ("fits", False, False)


def test_jumping_jacks_do_not_fit_walks_and_scribbles_fit_nothing(clips):
    walks = [clips[name] for name in WALKS]
    jacks, _ = seen(clips["bvh/ad_cmu1_jumping_jacks.bvh"], 0)
    assert not match_clips(jacks, MARKERS, walks, frame_rate=24).found
    rng = np.random.default_rng(1)
    drifting = np.cumsum(rng.normal(0, 5, (24, 16, 2)), axis=0) + rng.normal(0, 50, (16, 2))
    assert not match_clips(drifting, MARKERS, clips.values(), frame_rate=24).found


def test_a_four_legged_animal_fits_nothing(clips, test_data):
    drawing = read_annotations(test_data / "drawings/animated_drawings/char6/char_cfg.yaml")
    with pytest.raises(ValueError, match="^names: want marks of at least 4 limbs to compare, got torso from pelvis"):
        match_clips(drawing.markers, drawing.names, clips.values())
    legs = {
        "hip_b": "hip",
        "knee_b": "knee",
        "foot_b": "foot",
        "hip_f": "shoulder",
        "knee_f": "elbow",
        "foot_f": "hand",
    }
    names = [f"{n.split('_')[0]}_{legs[n.split('_', 1)[1]]}" if n.count("_") == 2 else n for n in drawing.names]
    found = match_clips(drawing.markers, names, clips.values())
    assert not found.found, found.matches[0]


def test_the_annotated_walks_are_walks(clips, test_data):
    side = read_annotations(test_data / "annotated/morevna_side_walk/annotation.json")
    found = match_clips(side.markers, side.names, clips.values(), visible=side.visible, frame_rate=side.frame_rate)
    assert {match.clip for match in found.matches[:8]} <= set(WALKS)
    assert found.matches[0].verdict == "fits"
    assert {match.seen_from for match in found.matches[:5]} <= {"left", "front left", "back left"}
    assert all(match.sides_told for match in found.matches[:5])
    toon = read_annotations(test_data / "annotated/kenney_male_person_walk/annotation.json")
    found = match_clips(toon.markers, toon.names, clips.values(), visible=toon.visible, loops=toon.loops)
    assert {match.clip for match in found.matches[:4]} <= set(WALKS)
    assert found.found


def test_single_photos_find_a_pose(clips, test_data):
    photos = read_annotations(test_data / "annotated/yogait_photos/annotation.json")
    for photo in range(2):
        found = match_clips(
            photos.markers[photo, None], photos.names, clips.values(), visible=photos.visible[photo, None]
        )
        assert found.matches[0].clip == "bvh/ad_cmu1_jumping_jacks.bvh"
        assert (found.matches[0].seen_from, found.matches[0].verdict) == ("front", "fits")


def test_other_proportions_do_not_matter(clips):
    clip = clips["bvh/cmu_35_01.bvh"]
    marks, _ = seen(clip, 60)
    plain = match_clips(marks, MARKERS, [clip], frame_rate=24, top=1).matches[0]
    # A big head and short legs: every joint below the hips is moved towards its parent.
    short = marks.copy()
    for side in ("left", "right"):
        hip, knee, foot = (MARKERS.index(f"{side}_{joint}") for joint in ("hip", "knee", "foot"))
        short[:, knee] = marks[:, hip] + 0.5 * (marks[:, knee] - marks[:, hip])
        short[:, foot] = short[:, knee] + 0.5 * (marks[:, foot] - marks[:, knee])
    short[:, MARKERS.index("head")] += 3 * (marks[:, MARKERS.index("head")] - marks[:, MARKERS.index("neck")])
    found = match_clips(short, MARKERS, [clip], frame_rate=24, top=1).matches[0]
    assert found.start == pytest.approx(plain.start, abs=4)
    assert found.cost < 3


def test_clips_may_be_given_under_any_name(clips):
    clip = dataclasses.replace(clips["bvh/cmu_35_01.bvh"], name="x")
    marks, world = seen(clip, 90)
    assert match_clips(marks, MARKERS, [clip], frame_rate=24, top=1).matches[0].clip == "x"
    assert seen_from(clip.at(np.arange(200.0)), world) == "left"
