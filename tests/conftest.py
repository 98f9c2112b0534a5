import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def test_data() -> Path:
    """The folder of real clips and drawings; tests that need it are skipped where it is missing."""
    named = os.environ.get("PEGBAR_TEST_DATA")
    folder = Path(named) if named else Path(__file__).parents[2] / "shared" / "data"
    if not folder.is_dir():
        if os.environ.get("PEGBAR_REQUIRE_TEST_DATA"):
            pytest.fail(f"no test data at {folder}")
        pytest.skip(f"no test data at {folder} (PEGBAR_TEST_DATA names another place)")
    return folder
