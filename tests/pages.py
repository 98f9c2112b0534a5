"""Whether a page can be opened offline: every file that it names is there, and it asks for nothing outside.

python tests/pages.py PAGE ...
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_NAMING = {"src", "href", "poster", "data", "action", "srcset", "background"}


class _References(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.found, self.scripts, self.styles = [], 0, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.scripts += tag == "script"
        for name, value in attrs:
            if name in _NAMING and value is not None:
                self.found.append(value)
            if name == "style":
                self.styles.append(value)

    def handle_data(self, data):
        if self.lasttag == "style":
            self.styles.append(data)


def complaints(page):
    """Return what a browser without a network would miss on ``page``."""
    seen = _References(page.read_text(encoding="utf-8"))
    addresses = seen.found + [
        found for style in seen.styles for found in re.findall(r"url\(['\"]?(.*?)['\"]?\)", style)
    ]
    addresses += [found for style in seen.styles for found in re.findall(r"@import\s+['\"](.*?)['\"]", style)]
    wrong = ["a script"] * seen.scripts
    for address in addresses:
        parts = urlsplit(address)
        if parts.scheme == "data" or (not parts.path and parts.fragment):
            continue
        if parts.scheme or parts.netloc:
            wrong.append(f"asks for {address[:80]}")
        elif not (page.parent / unquote(parts.path)).is_file():
            wrong.append(f"no such file: {address}")
    return wrong


if __name__ == "__main__":
    told = [f"{name}: {line}" for name in sys.argv[1:] for line in complaints(Path(name))]
    print("\n".join(told) or f"{len(sys.argv) - 1} pages are complete")
    sys.exit(1 if told else 0)
