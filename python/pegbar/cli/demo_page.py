"""What the demo's page says: the sample shot, the three jobs, what the colours mean, and how to go on."""

from __future__ import annotations

from pegbar.report.figures import NEARNESS, SIDES
from pegbar.report.page import Picture, Section


def demo_sections() -> list[Section]:
    """Return a section for what the artist gives and one for each job; paths begin at the demo's folder."""
    return [_given(), *_secondary(), _lift(), _animate()]


def next_step() -> Section:
    """Return what to do with drawings of one's own."""
    return Section(
        "Now your own drawings",
        (
            "The guide, docs/getting-started.md in the folder that pegbar was installed from, says what to draw and "
            "where clips are to be had. In short, with drawings, dots on the joints and limb colours in my_shot, and "
            "clips in mocap:",
        ),
        commands=(
            "pegbar init my_shot                  # writes my_shot/shot.toml: look it over",
            "pegbar dots my_shot/shot.toml        # dots on the joints become marks: annotation.json",
            "pegbar match my_shot/annotation.json mocap -o my_shot/match --write my_shot/shot.toml",
            "pegbar check my_shot/shot.toml       # all problems at once",
            "pegbar align my_shot/shot.toml       # look at my_shot/align/sheet.png",
            "pegbar secondary my_shot/shot.toml   # or lift: a 3D animation",
            "pegbar report my_shot/shot.toml      # all of it on one page, with limits",
            "pegbar animate picture.png --clip walk.bvh -o walk.gif   # a single picture",
        ),
    )


def _given() -> Section:
    return Section(
        "What the artist gives",
        (
            "Drawings with marked joints and limb colours, and a motion-capture clip. Every limb has a colour of its "
            "own; the skirt and the hair belong to the limb that they move with (shot.toml says which).",
        ),
        files=(
            ("annotation.json", "joint marks"),
            ("dots/dots.0001.png", "or, instead of marks, a dot on every joint (dots.toml takes them)"),
            ("clip.bvh", "the clip"),
            ("shot.toml", "the shot file: which files belong together, what is to be made"),
        ),
        pictures=(Picture("drawings/dancer.0001.png", "a drawing"), Picture("labels/labels.0001.png", "its limbs")),
    )


def _secondary() -> list[Section]:
    return [
        Section(
            "1. Secondary motion",
            (
                "pegbar secondary: cloth and balls collide with the drawn limbs, in right depth order.",
                "Below, what they collide with: thin lines are limb boxes measured in the drawing, bands and discs the "
                "volumes in 3D. The limbs of the middle are green here.",
            ),
            legend=SIDES[:2],
            commands=("pegbar secondary shot.toml",),
            files=(("secondary/report.json", "penetration, stretch, seconds"),),
            pictures=(
                Picture("secondary/animation.png", "scarves, skirt and balls, simulated by pegbar"),
                Picture("secondary/volumes.png", "limb boxes and collision volumes", wide=True),
            ),
        ),
        Section(
            "... or rendered elsewhere",
            ("pegbar composite: a hoop and a ribbon from another 3D package, in front of and behind the drawn limbs.",),
            legend=NEARNESS,
            commands=("pegbar composite shot.toml",),
            pictures=(
                Picture("animation.png", "hoop and ribbon"),
                Picture("contact_sheet.png", "drawing, its depth, composite, and so on", wide=True),
            ),
        ),
    ]


def _lift() -> Section:
    return Section(
        "2. Lifted to 3D",
        ("pegbar lift: the artist's poses and timing on a 3D skeleton.",),
        legend=SIDES,
        commands=("pegbar lift shot.toml",),
        files=(
            ("lift/animation.glb", "glTF, opens in viewers, Blender and engines"),
            ("lift/animation.bvh", "BVH"),
            ("lift/report.json", "figures"),
        ),
        pictures=(
            Picture("lift/preview.gif", "left the skeleton over the drawing, right turning on its floor", wide=True),
            Picture(
                "align/sheet.png",
                "pegbar align: the clip as broad pale lines, the drawn joints as thin ones (a ring: hidden), and the "
                "same from the side",
                wide=True,
            ),
        ),
    )


def _animate() -> Section:
    return Section(
        "3. One picture, animated",
        ("pegbar animate: a single drawing performs the clip.",),
        commands=("pegbar animate drawings/dancer.0001.png --joints annotation.json --clip clip.bvh -o animated.gif",),
        pictures=(Picture("animated.gif", "made of the first drawing alone"),),
    )
