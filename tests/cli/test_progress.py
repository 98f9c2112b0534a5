"""The progress bar on a terminal, and nothing of it elsewhere."""

import io
import re

import pytest

from pegbar.cli.batch import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def terminal(monkeypatch):
    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "80")

    def put():
        # In the test itself: capturing puts its own stream back before it begins.
        stream = Terminal()
        monkeypatch.setattr("sys.stderr", stream)
        return stream

    return put


def counts(stream):
    """How far the bar says that the work is, each said once."""
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue())
    return list(dict.fromkeys(re.findall(r"(\d+/[\d?]+)", plain)))


def test_the_bar_counts_what_is_done_of_what_there_is(terminal):
    stream = terminal()
    with progress("align", 2) as advance:
        advance()
        advance()
    assert "align" in stream.getvalue()
    assert counts(stream)[-1] == "2/2"


def test_before_the_first_step_nothing_is_known(terminal):
    stream = terminal()
    with progress("align", 2):
        pass
    assert counts(stream) == ["0/?"]


def test_elsewhere_there_is_no_bar(capsys):
    with progress("align", 2) as advance:
        advance()
    captured = capsys.readouterr()
    assert captured.out + captured.err == ""
