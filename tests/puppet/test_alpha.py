"""Closed-form matting tells what the user waits for, while it happens."""

import logging
import sys
import threading
import types

import numpy as np
import pytest

from pegbar.puppet import alpha
from pegbar.puppet.alpha import figure_alpha

IMAGE = np.full((40, 40, 3), 200, np.uint8)
MASK = np.zeros((40, 40), bool)
MASK[8:32, 8:32] = True


@pytest.fixture
def matting(monkeypatch):
    """PyMatting's place taken by a function that does what the test says."""

    def put(work):
        module = types.ModuleType("pymatting")

        def estimate_alpha_cf(image, trimap):
            work()
            return trimap

        module.estimate_alpha_cf = estimate_alpha_cf
        monkeypatch.setitem(sys.modules, "pymatting", module)

    return put


def timers_end():
    """Wait for timers that are cancelled or done: they end by themselves."""
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.join(20)


def test_a_first_use_that_compiles_is_told_before_it_is_over(matting, monkeypatch):
    told, notes = threading.Event(), []

    class Listener(logging.Handler):
        def emit(self, record):
            notes.append(record.getMessage())
            told.set()

    monkeypatch.setattr(alpha, "_PATIENCE", 0.0)
    listener = Listener()
    logging.getLogger("pegbar").addHandler(listener)
    try:
        # The matting ends when the note is there.
        matting(lambda: pytest.fail("nothing was told") if not told.wait(20) else None)
        found = figure_alpha(IMAGE, MASK, "closed form")
    finally:
        logging.getLogger("pegbar").removeHandler(listener)
    # The note has reached the listener, and may still be on its way to what listens in the next test.
    timers_end()
    assert found[20, 20] == 1
    (note,) = notes
    assert "at its first use it compiles, for about a minute" in note


def test_what_is_quick_says_nothing_and_leaves_nothing_running(matting, monkeypatch, caplog):
    monkeypatch.setattr(alpha, "_PATIENCE", 1000.0)
    matting(lambda: None)
    before = threading.active_count()
    figure_alpha(IMAGE, MASK, "closed form")
    assert caplog.text == ""
    timers_end()
    assert threading.active_count() <= before


def test_a_failure_ends_the_waiting_too(matting, monkeypatch):
    monkeypatch.setattr(alpha, "_PATIENCE", 1000.0)

    def broken():
        raise ValueError("no matte")

    matting(broken)
    with pytest.raises(ValueError, match="no matte"):
        figure_alpha(IMAGE, MASK, "closed form")
    assert [t for t in threading.enumerate() if isinstance(t, threading.Timer) and not t.finished.is_set()] == []
