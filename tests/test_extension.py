"""The built extension belongs to the sources beside it: a stale one gives wrong answers that look like bugs."""

from pathlib import Path

import pytest

from pegbar import _kernels

RUST = Path(__file__).parents[1] / "rust"


def test_the_extension_was_built_of_these_sources():
    if not RUST.is_dir():
        pytest.skip("no Rust sources beside the tests")
    value = 0xCBF29CE484222325
    files = {path.relative_to(RUST).as_posix(): path for path in RUST.rglob("*.rs")}
    for name in sorted(files):
        for byte in name.encode() + files[name].read_bytes():
            value = ((value ^ byte) * 0x100000001B3) & (2**64 - 1)
    assert f"{value:016x}" == _kernels.SOURCES, "stale extension: run `maturin develop --release` or `pip install -e .`"
