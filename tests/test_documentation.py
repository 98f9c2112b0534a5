"""Examples in docstrings and in the guide run as they stand; the README names commands that exist."""

import doctest
import importlib
import pkgutil
import re
from pathlib import Path

import pytest

import pegbar
from pegbar.cli.main import COMMANDS

ROOT = Path(__file__).parents[1]
MODULES = sorted(
    name
    for _, name, _ in pkgutil.walk_packages(pegbar.__path__, "pegbar.")
    if not name.endswith(("__main__", "._kernels"))
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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_python_in_the_guide_runs(page):
    for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        exec(compile(block, str(page), "exec"), {})
    for block in re.findall(r"```sh\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        assert set(re.findall(r"^(?:.*&& )?(?:\.venv/bin/)?pegbar ([a-z]+)", block, re.MULTILINE)) <= set(COMMANDS)


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
