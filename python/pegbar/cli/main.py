"""`pegbar`: finds the command and turns errors into one line and an exit code.

Exit codes: 0 done, 1 some frames failed (or `check` found problems), 2 wrong usage, 130 interrupted.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError

from pegbar.cli.overview import overview
from pegbar.errors import MissingExtraError, describe


def _version() -> str:
    # Of the standard library, but a sixth of the start-up.
    from importlib.metadata import version

    return version("pegbar")


app = App(
    name="pegbar",
    help="Hand-drawn animation and motion capture: 3D secondary motion, lifting to 3D, pictures that perform clips.",
    version=_version,
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
)
# The commands' modules are imported when they run, so that help comes quickly; what it says stands here.
COMMANDS = {
    "init": """Write a shot file for a folder of drawn frames.

Label pictures, annotations, dots and rendered passes are found by their names; what is missing stands in the file as a
comment to fill in.

Example: pegbar init demo --drawings drawings/dancer.####.png --output demo/new.toml""",
    "check": """Read all that a shot names; report every problem.

Nothing is written.

Example: pegbar check demo/shot.toml""",
    "depth": """Write the depth of every drawn pixel.

An EXR map in metres, and a picture of it.

Example: pegbar depth demo/shot.toml --frames 1-4""",
    "composite": """Composite drawing and passes in depth order.

Frames that are up to date are left alone, so run it again after a change or an interruption. Without a shot file give
at least --drawings, --beauty and --output, and --drawing-depth or --labels with --annotations.

Example: pegbar composite demo/shot.toml --frames 1-4 --keep-going

Example: pegbar composite --drawings demo/drawings --drawing-depth demo/depth/depth.####.exr --beauty demo/passes
--output demo/again/frame.####.png""",
    "match": """Find the clip that a drawing is like.

Which clip, which of its frames, and from where it is seen. Reads the joint marks and every BVH, AMC and C3D file in a
folder and the folders below; nothing needs to be set. Prints a table, and says so when nothing fits. Left and right
mixed up in the drawing, and mirrored motions, are found too.

Example: pegbar match demo/annotation.json demo -o demo/match --write demo/shot.toml""",
    "dots": """Read joint marks from a layer of coloured dots.

Every joint has a colour of its own. Writes the shot's annotations. Drawings without dots get marks carried from the
ones before and after them, along with the drawing's own motion.

Example: pegbar dots demo/dots.toml""",
    "align": """Find the cameras; put the drawn joints into 3D.

Retimes the clip of the shot's [clip] section to the drawings (or finds one in its folder), registers cameras, and
back-projects the marks. Writes overlays to look at, a warp plot, errors, and marks with cameras and depths, which
pegbar depth and composite then use.

Example: pegbar align demo/shot.toml""",
    "lift": """Make a 3D animation of a drawn sequence.

It has the artist's poses and timing. Aligns the shot first where that is out of date. Writes a skeleton posed as drawn
(BVH, glTF, USD), the 3D markers (CSV, npz), a sheet and an animation to look at, and a report. The shot file's [lift]
chooses the skeleton (the clip's or your rig's), the frame rate, loops, standing feet, held joints, and limbs whose
depth is to be turned.

Example: pegbar lift demo/shot.toml""",
    "secondary": """Add cloth and balls that collide with the drawing.

Secondary motion, to finished frames. Aligns the shot where that is needed and out of date, finds limb boxes and
collision volumes, simulates what the shot file's [secondary] section names, renders it, and composites it with the
drawings in depth order. Only what is out of date is done again. Leaves passes, finished frames, an animation, a
contact sheet and a report.

Example: pegbar secondary demo/shot.toml

Example: pegbar secondary demo/shot.toml --frames 1-4""",
    "effects": """List the presets of secondary motion.

What each makes; with a name all settings of that one, with their defaults. With --gallery a picture of each, on the
sample shot or on your own.

Example: pegbar effects

Example: pegbar effects pompoms

Example: pegbar effects balloon --gallery demo/effects --shot demo/shot.toml""",
    "export": """Write an aligned shot for other 3D packages.

Camera, joints in 3D, limbs and ground as USD, glTF, npz and JSON, and a script that sets up Blender to render passes
for the shot. Aligns the shot where that is needed and out of date.

Example: pegbar export demo/shot.toml

Example: pegbar export demo/shot.toml --formats npz,gltf --output demo/for_layout""",
    "import-passes": """Take passes rendered by another package.

Checks what comes back for an exported shot: frames, sizes, channels, unit, background, planar or radial depth, alpha,
and the camera. Says what is wrong in one table; writes the passes as pegbar has them and names them in the shot file.

Example: pegbar import-passes demo/shot.toml demo/passes/passes.####.exr --check

Example: pegbar import-passes demo/shot.toml demo/passes/passes.####.exr --output demo/imported""",
    "animate": """Let a drawn or photographed figure perform a clip.

Joints are found beside the picture: AnimatedDrawings' char_cfg.yaml, our annotations or COCO keypoints; a mask as
well. Writes GIF, APNG, WebP, numbered PNG files, and with pegbar[video] MP4, ProRes 4444 (.mov) or WebM. Several
pictures stand in one scene; several clips are performed in a row. With a folder to write to, every picture performs
every clip.

Example: pegbar animate demo/drawings/dancer.0001.png --joints demo/annotation.json --clip demo/clip.bvh -o
demo/dance.gif --size 320x320 --frames 1-12""",
    "report": """Write one page of what every stage has found.

An HTML file with overlays, plots and figures of all stages that have run. It opens offline, in any browser.

Example: pegbar report demo/shot.toml""",
    "motion": """Look at motion capture clips: info, plot.""",
    "demo": """Make a sample shot and run all three jobs on it.

A drawn dancer gets scarves, a skirt and balls, becomes a 3D animation, and one drawing of her performs the clip.
index.html shows all of it, offline.

Example: pegbar demo demo""",
    "reproduce": """Repeat an experiment of the papers on your clips.

jain2009-table1: a walk drawn by a known camera and lifted to 3D with another walk.

jain2010-fig9: how wrong a walk's depth is when it comes from other clips.

foot-contact: how much better feet and knees are placed when standing feet take their depth from the floor.

Tables are printed and written as CSV, plots as PNG.

Example: pegbar reproduce jain2009-table1 --data clips -o reproduced""",
}
#: Commands that are groups of commands: these are in the group's module.
GROUPS = {
    "motion": {
        "info": """Print what clips hold and how they were understood.

Frames, rate, unit, up axis, floor, facing, an inserted T-pose, joints found and missing. A clip that cannot be read is
named and the others are still shown; the exit code is then 1.

Folders are looked through with the folders below.

Example: pegbar motion info demo

Example: pegbar motion info demo/clip.bvh --joints demo/joints.toml""",
        "plot": """Draw poses of a clip from the front, the side and above.

Left is blue and right is red, later poses are darker; the line is the floor, the grid is in metres.

Example: pegbar motion plot demo/clip.bvh -o demo/poses.png --frames 0-10x5""",
    }
}


def _unwrapped(text: str) -> str:
    """Paragraphs as one line each, which the terminal wraps where it is wide enough."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


for command, text in COMMANDS.items():
    if command in GROUPS:
        app.command(App(name=command, help=_unwrapped(text)))
        for name, help_text in GROUPS[command].items():
            app[command].command(f"pegbar.cli.{command}:{name}", name=name, help=_unwrapped(help_text))
    else:
        module = command.replace("-", "_")
        app.command(f"pegbar.cli.{module}:{module}", name=command, help=_unwrapped(text))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line with ``arguments`` (None: the process's own) and return the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given in ([], ["--help"], ["-h"]):
        print(overview(COMMANDS))
        return 0
    try:
        code = app(given, exit_on_error=False, print_error=False, result_action="return_value")
    except CycloptsError as error:
        # Known only where it is needed: help comes without it.
        from pegbar.cli.usage import describe_usage

        return _fail(describe_usage(error, app))
    except (OSError, MissingExtraError) as error:
        return _fail(describe(error))
    except ValueError as error:
        return _fail(str(error))
    return code if isinstance(code, int) else 0


def _fail(message: str) -> int:
    for line in message.splitlines():
        print(f"pegbar: {line}", file=sys.stderr)
    return 2
