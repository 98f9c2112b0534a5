"""Fixtures that several rooms' tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# No deadline: a busy machine is no reason to fail. The nightly run tries many more examples.
settings.register_profile("gate", deadline=None)
settings.register_profile("nightly", deadline=None, max_examples=2000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "gate"))

ROOT = Path(__file__).parents[1]
#: Where real clips and drawings are looked for; the gate runs the tests in a copy that has none beside it.
DATA = Path(os.environ.get("PEGBAR_TEST_DATA", ROOT.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def test_data() -> Path:
    """The folder of real clips and drawings; skips where it is missing, fails where it is required."""
    if not (DATA / "INDEX.csv").is_file():
        reason = f"no real data: PEGBAR_TEST_DATA points to {DATA}"
        (pytest.fail if os.environ.get("PEGBAR_REQUIRE_TEST_DATA") else pytest.skip)(reason)
    return DATA
