"""The demo's page and a shot's report in a real browser: no console errors, no requests outside, something to see."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.io.frames import read_picture
from tests.pages import complaints

BROWSER = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no chromium here: apt-get install chromium")
# Where screenshots are kept to look at; else they go with the test's folder.
KEEP = os.environ.get("PEGBAR_SCREENSHOTS")


def look(page, folder):
    """Open ``page`` without a window; return console messages, addresses outside that it asked for, the screenshot."""
    log, shot = folder / "net.json", (Path(KEEP) if KEEP else folder) / f"{page.stem}.png"
    options = [
        *("--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1200,4800"),
        *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run"),
        *("--enable-logging=stderr", f"--user-data-dir={folder / 'profile'}", f"--log-net-log={log}"),
        *("--virtual-time-budget=5000", f"--screenshot={shot}"),
    ]
    done = subprocess.run([BROWSER, *options, page.as_uri()], capture_output=True, text=True, timeout=180)
    assert shot.is_file(), done.stderr
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return console, outside(log), read_picture(shot)


def outside(log):
    """Addresses that the page asked for: what the browser does of its own accord has no origin."""
    text = log.read_text()
    try:
        events = json.loads(text)["events"]
    except json.JSONDecodeError:  # the browser ended before the log did
        events = json.loads(text.rstrip().rstrip(",") + "]}")["events"]
    asked = [event.get("params") or {} for event in events]
    return {
        entry["url"]
        for entry in asked
        if entry.get("initiator", "not an origin") != "not an origin" and not entry.get("url", "").startswith("file:")
    }


@needs_browser
def test_what_a_page_misses_is_seen(tmp_path):
    page = tmp_path / "broken.html"
    page.write_text('<img src="none.png"><img src="http://127.0.0.1:9/x.png"><script>undefined_thing()</script>')
    console, asked, _ = look(page, tmp_path)
    assert "http://127.0.0.1:9/x.png" in asked
    assert any("undefined_thing" in line for line in console)
    assert len(complaints(page)) == 3


@needs_browser
def test_the_demos_page_and_the_report_open_offline(tmp_path):
    folder = tmp_path / "a demo ü"
    assert main(["demo", str(folder), "--length", "12"]) == 0
    assert main(["report", str(folder / "shot.toml")]) == 0
    for page in (folder / "index.html", folder / "report.html"):
        assert complaints(page) == []
        console, asked, picture = look(page, tmp_path)
        assert (console, asked) == ([], set())
        # A page of headings alone has a dozen colours, and little that is not paper.
        colors = np.unique(picture[..., :3].reshape(-1, 3), axis=0)
        inked = (picture[..., :3] != picture[-1, 0, :3]).any(axis=2).mean()
        assert len(colors) > 1000, page
        assert inked > 0.1, page
