"""Tests with Blender itself: `.ci/blender` runs them, the gate does not."""

from __future__ import annotations

import pytest

from pegbar.simulate.blender.locate import Blender, find_blender


@pytest.fixture(scope="session")
def blender() -> Blender:
    """The Blender that is installed; without one every test fails, and says how to install it."""
    return find_blender()
