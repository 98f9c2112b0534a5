"""The guide's code blocks, and a folder with everything that its commands name."""

from __future__ import annotations

import glob
import re
import shlex
import shutil
import textwrap
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from pegbar import read_annotations
from pegbar.cli.main import main
from pegbar.io.frames import read_picture, write_image
from pegbar.io.joint_map import read_joint_map
from pegbar.sample.figure import LABELS, PALETTE
from pegbar.shot.load import validate_shot

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", ROOT / "DEVELOP.md", *(ROOT / "docs").glob("*.md")])
#: Why a block may stay unrun, as its mark begins: `<!-- not run: needs Blender -->`.
REASONS = ("installs", "needs Blender", "needs Nuke", "needs the network", "takes minutes", "after a change in rust")
_BLOCK = re.compile(
    r"(?:^ *<!-- (?P<mark>[^>]*) -->\n)?^(?P<indent> *)```(?P<language>\w+)\n(?P<text>.*?)^(?P=indent)```$",
    re.DOTALL | re.MULTILINE,
)


@dataclass(frozen=True)
class Block:
    """A fenced block: its page, line, language, text, and the HTML comment right above it."""

    page: Path
    line: int
    language: str
    text: str
    mark: str

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"

    @property
    def reason(self) -> str | None:
        """Why it is not run; None where it is."""
        # The gate runs the README's commands for users and the tests themselves.
        if self.mark in ("demo command", "test command"):
            return "installs"
        return self.mark.removeprefix("not run: ") if self.mark.startswith("not run: ") else None


def blocks(page: Path) -> list[Block]:
    """Every fenced block of ``page`` that names its language."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(
            page,
            text.count("\n", 0, match.start("language")) + 1,
            match["language"],
            textwrap.dedent(match["text"]),
            match["mark"] or "",
        )
        for match in _BLOCK.finditer(text)
    ]


def run(block: Block, folder: Path) -> bool:
    """Run ``block`` in ``folder``, the working directory: True, or a failure where it does not do what it shows."""
    if block.language == "python":
        exec(compile("\n" * block.line + block.text, str(block.page), "exec"), {"__name__": "guide"})
    elif block.language == "sh":
        if "pegbar init my_shot" in block.text:
            new_shot(folder, dotted="pegbar dots" in block.page.read_text(encoding="utf-8"))
        for command in commands(block.text, folder):
            assert command[0] == "pegbar", f"{block}: only pegbar is run here; mark the block: {command}"
            assert call(command) == 0, f"{block}: {shlex.join(command)}"
            if command[1:] == ["init", "my_shot"]:
                fill_in(folder / "my_shot/shot.toml")
    elif block.language == "toml":
        read_toml(block, folder)
    elif block.language == "json":
        (folder / "block.json").write_text(block.text, encoding="utf-8")
        assert read_annotations(folder / "block.json").names, block
    return True


def call(command: list[str]) -> int:
    """Run a pegbar ``command`` and return its exit code.

    Few frames are done here: starting workers takes longer.
    """
    jobs = ["--jobs", "1"] if command[1] in ("check", "depth", "composite") else []
    return main([*command[1:], *jobs])


def fill_in(shot: Path) -> None:
    """Do what the guide tells users to do with a new shot file: name colours, and what is to be simulated."""
    text = shot.read_text(encoding="utf-8")
    demo = shot.parents[1] / "demo"
    dots = tomllib.loads((demo / "dots.toml").read_text(encoding="utf-8"))["dots"]
    # Limbs of dots are not called as those of the marks that come with the demo.
    named = demo / ("shot.toml" if (shot.parent / "annotation.json").exists() else "dots.toml")
    palette = tomllib.loads(named.read_text(encoding="utf-8"))["drawing"]["palette"]
    for color, joint in dots["joints"].items():
        assert text.count(f'# "{color}" = "?"') == 1, color
        text = text.replace(f'# "{color}" = "?"', f'"{color}" = "{joint}"')
    for limb, color in dots["limbs"].items():
        assert text.count(f'# ? = "{color}"') == 1, color
        text = text.replace(f'# ? = "{color}"', f'{limb} = "{color}"')
    for line in ("[drawing.palette]", "[secondary]", 'elements = ["scarves", "skirt", "balls"]'):
        assert text.count(f"# {line}") == 1, line
        text = text.replace(f"# {line}", line)
    further = "\n".join(f'"{color}" = "{limb}"' for color, limb in palette.items())
    text = text.replace('# "#8a4b2a" = "head"', further)
    shot.write_text(text, encoding="utf-8")


def read_toml(block: Block, folder: Path) -> None:
    """Read a TOML block: a part of a shot file, or what its mark calls it."""
    if block.mark == "joint map":
        (folder / "block.toml").write_text(block.text, encoding="utf-8")
        assert read_joint_map(folder / "block.toml"), block
        return
    table = tomllib.loads(block.text)
    table.setdefault("drawing", {}).setdefault("frames", "d.####.png")
    validate_shot(table, str(block))


def commands(text: str, folder: Path) -> Iterator[list[str]]:
    """The commands of shell ``text``, without comments, with file patterns filled in from ``folder``."""
    for line in text.replace("\\\n", " ").splitlines():
        for part in line.split(" && "):
            part = re.sub(r"(^|\s)#.*", "", part)
            words = [
                found
                for word in shlex.split(part)
                for found in (sorted(glob.glob(word, root_dir=folder)) if re.search(r"[*?]", word) else [word])
            ]
            if words:
                yield words


def new_shot(folder: Path, *, dotted: bool) -> None:
    """Make ``my_shot`` anew as an artist has it at first: with marks, or ``dotted`` and without."""
    demo, shot = folder / "demo", folder / "my_shot"
    if shot.exists():
        shutil.rmtree(shot)
    for name in ("drawings", "dots", "labels", "passes"):
        shutil.copytree(demo / name, shot / name)
    for name in ("clip.bvh",) if dotted else ("annotation.json", "clip.bvh"):
        shutil.copy2(demo / name, shot)


def make_workshop(folder: Path, data: Path) -> None:
    """Put into ``folder`` what the guide's commands name, given the finished demo in ``folder/demo``.

    Clips and a painted character come from the real ``data``.
    """
    demo = folder / "demo"
    new_shot(folder, dotted=False)
    shutil.copy2(demo / "shot.toml", folder)
    for name in ("walk.bvh", "wave.bvh", "mocap/dance.bvh", "clips/walk.bvh"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy2(demo / "clip.bvh", folder / name)
    for name in ("asfamc/16.asf", "asfamc/16_11.amc", "c3d/cmu_05_13.c3d"):
        shutil.copy2(data / "mocap" / name, folder / "clips")
    shutil.copy2(data / "mocap/bvh/cmu_16_11.bvh", folder / "mocap")
    (folder / "clips/papers").mkdir()
    for path in sorted((data / "mocap/bvh").glob("*.bvh")):
        (folder / "clips/papers" / path.name).symlink_to(path)
    for name in ("texture", "picture", "anna", "bert", "drawings/anna"):
        make_character(folder / name, data / "drawings/animated_drawings/char1")
    for number in range(1, 13):
        shutil.copy2(demo / f"drawings/dancer.{number:04d}.png", folder / f"d.{number:04d}.png")
        write_image(
            folder / f"l.{number:04d}.png", without_hair(read_picture(demo / f"labels/labels.{number:04d}.png"))
        )
        for name in "bz":
            shutil.copy2(demo / f"passes/passes.{number:04d}.exr", folder / f"{name}.{number:04d}.exr")
    shutil.copy2(demo / "annotation.json", folder / "a.json")


def without_hair(labels: np.ndarray) -> np.ndarray:
    """The label picture with limb colours alone, as it is asked for where there is no palette."""
    limbs = labels.copy()
    for color, limb in PALETTE.items():
        limbs[(labels == color).all(axis=2)] = LABELS[limb]
    return limbs


def make_character(target: Path, source: Path) -> None:
    """Write AnimatedDrawings' character in ``source`` at a third of its size, so that it moves quickly."""
    target.parent.mkdir(exist_ok=True)
    config = yaml.safe_load((source / "char_cfg.yaml").read_text())
    picture = read_picture(source / "texture.png")[::3, ::3]
    config["height"], config["width"] = picture.shape[:2]
    for joint in config["skeleton"]:
        joint["loc"] = [round(value / 3) for value in joint["loc"]]
    write_image(target.with_suffix(".png"), np.ascontiguousarray(picture))
    target.with_suffix(".yaml").write_text(yaml.safe_dump(config))
