"""Examples in docstrings and in the guide run as they stand; the README names commands that exist."""

import doctest
import importlib
import importlib.util
import pkgutil
import re
import tomllib
from pathlib import Path

import pytest

import pegbar

ROOT = Path(__file__).parents[1]
# What runs inside Blender has Blender's modules only there.
MODULES = sorted(
    name
    for _, name, _ in pkgutil.walk_packages(pegbar.__path__, "pegbar.")
    # What runs inside Blender imports bpy.
    if not name.endswith(("__main__", "._kernels")) and ".blender.inside." not in name
)
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])


@pytest.mark.parametrize("name", MODULES)
def test_docstring_examples_run(name):
    found = doctest.testmod(importlib.import_module(name))
    assert found.failed == 0


def test_public_functions_have_examples():
    documented = {name for name in dir(pegbar) if callable(getattr(pegbar, name)) and name[0].islower()}
    assert "limb_depth" in documented
    assert [name for name in sorted(documented) if ">>>" not in (getattr(pegbar, name).__doc__ or "")] == []


def test_the_annotation_in_the_guide_is_one(tmp_path):
    page = (ROOT / "docs" / "compositing.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    (tmp_path / "a.json").write_text(block)
    drawing = pegbar.read_annotations(tmp_path / "a.json")
    assert drawing.depths.shape == (1, 5)
    assert len(drawing.limbs) == 3


def test_links_in_the_guide_lead_somewhere():
    for page in PAGES:
        for link in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
            assert link.startswith("http") or (page.parent / link).exists(), f"{page.name}: {link}"


def builder():
    """The script that puts the site together."""
    spec = importlib.util.spec_from_file_location("build_guide", ROOT / "docs/build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def pages_of(nav):
    """Every page that a part of the navigation names."""
    for entry in nav:
        for value in entry.values():
            yield from [value] if isinstance(value, str) else pages_of(value)


def test_every_page_can_be_reached():
    nav = tomllib.loads((ROOT / "zensical.toml").read_text(encoding="utf-8"))["project"]["nav"]
    there = [*(path.name for path in (ROOT / "docs").glob("*.md")), "api/index.md"]
    assert sorted(pages_of(nav)) == sorted(there)
    # On GitHub there is no navigation: the index names the pages instead.
    index = (ROOT / "docs/index.md").read_text(encoding="utf-8")
    assert [name for name in there[:-1] if name != "index.md" and f"({name})" not in index] == []


def test_the_reference_has_every_public_name(tmp_path):
    build = builder()
    rooms = build.public_names((ROOT / "python/pegbar/__init__.pyi").read_text(encoding="utf-8"))
    assert sorted(name for names in rooms.values() for _, name in names) == sorted(pegbar.__all__)
    build.write_reference(tmp_path / "api", rooms)
    index = (tmp_path / "api/index.md").read_text()
    for room, names in rooms.items():
        page = (tmp_path / f"api/{room}.md").read_text()
        for module, name in names:
            assert f"\n::: pegbar.{module}.{name}\n" in page
            assert f"[`{name}`]({room}.md#pegbar.{module}.{name})" in index
            assert getattr(importlib.import_module(f"pegbar.{module}"), name) is getattr(pegbar, name)


def test_lists_are_indented_as_the_site_wants_them():
    text = (
        "1. One\n   more\n\n   ```sh\n   ls\n   ```\n2. Two\n3. Three\n\nText\n   far\n- a\n  b\n\n```text\n- c\n```\n"
    )
    steps, rest = "1. One\n    more\n\n    ```sh\n    ls\n    ```\n\n2. Two\n3. Three\n", "Text\n   far\n\n- a\n    b\n"
    wanted = f"{steps}\n{rest}\n```text\n- c\n```\n"
    assert builder().indented(text) == wanted
