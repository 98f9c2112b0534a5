"""Builds the guide into target/docs/site: the pages, and a reference of every public name from its docstring.

Run it from anywhere: python docs/build.py. It wants pip install ".[docs]", and no network.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "target/docs/pages"
_OUTSIDE = re.compile(r'<script src="https?://[^>]*></script>')
_NAME = re.compile(r"^from \.(?P<module>[\w.]+) import (?P<name>\w+) as (?P=name)$", re.MULTILINE)


def public_names(stub: str) -> dict[str, list[tuple[str, str]]]:
    """Return the names that the stub of the package gives out as (module, name), by room, in the stub's order."""
    rooms: dict[str, list[tuple[str, str]]] = {}
    for match in _NAME.finditer(stub):
        rooms.setdefault(match["module"].split(".")[0], []).append((match["module"], match["name"]))
    return rooms


def write_reference(folder: Path, rooms: dict[str, list[tuple[str, str]]]) -> None:
    """Write a page for every room, and an index of all names in their order."""
    folder.mkdir(parents=True)
    places = {}
    for room, names in rooms.items():
        parts = [f"# pegbar: {room}\n\nEvery name is imported from `pegbar` itself.\n"]
        for module, name in names:
            parts.append(f"::: pegbar.{module}.{name}\n")
            places[name] = f"[`{name}`]({room}.md#pegbar.{module}.{name})"
        (folder / f"{room}.md").write_text("\n".join(parts), encoding="utf-8")
    lines = [f"- {places[name]}" for name in sorted(places, key=str.lower)]
    text = "# All public names\n\nFrom Python everything is imported from `pegbar` itself.\n\n"
    (folder / "index.md").write_text(text + "\n".join(lines) + "\n", encoding="utf-8")


def indented(text: str) -> str:
    """Return Markdown with lists as Python-Markdown wants them: what belongs to an item four columns in, and a blank
    line before a list and after an item of several paragraphs.
    """
    lines: list[str] = []
    inside, parted, fenced = 0, False, False
    for line in text.splitlines():
        fenced ^= line.startswith("```")
        item = None if fenced else re.match(r"(-|\*|\d+\.) +", line)
        if item:
            if lines and lines[-1].strip() and (parted or not inside):
                lines.append("")
            inside, parted = item.end(), False
        elif line and not line.startswith(" "):
            inside = 0
        elif inside and line.startswith(" " * inside):
            parted = parted or not lines[-1].strip()
            line = " " * (4 - inside) + line
        lines.append(line)
    return "\n".join(lines) + "\n"


def put_together() -> None:
    """Copy the guide's pages and pictures, and write the reference beside them."""
    shutil.rmtree(PAGES.parent, ignore_errors=True)
    shutil.copytree(ROOT / "docs", PAGES, ignore=shutil.ignore_patterns("*.py", "*.js", "__pycache__"))
    for page in PAGES.glob("*.md"):
        page.write_text(indented(page.read_text(encoding="utf-8")), encoding="utf-8")
    write_reference(PAGES / "api", public_names((ROOT / "python/pegbar/__init__.pyi").read_text(encoding="utf-8")))


def main() -> int:
    """Build the site; broken links, anchors and references fail."""
    put_together()
    code = subprocess.run([sys.executable, "-m", "zensical", "build", "--clean", "--strict"], cwd=ROOT).returncode
    # The theme asks another computer for a piece without which pages from the disk cannot be searched.
    own = f"<script>{(ROOT / 'docs/worker.js').read_text(encoding='utf-8')}</script>"
    for page in (PAGES.parent / "site").rglob("*.html"):
        page.write_text(_OUTSIDE.sub(lambda _: own, page.read_text(encoding="utf-8")), encoding="utf-8")
    return code


if __name__ == "__main__":
    sys.exit(main())
