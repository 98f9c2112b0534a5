"""Pages that people open in a browser, offline: words, tables and pictures in one HTML file."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

#: Media types of what a page may hold, by suffix.
MEDIA = {
    ".png": "image/png",
    ".apng": "image/apng",
    ".gif": "image/gif",
    ".webp": "image/webp",
    ".jpg": "image/jpeg",
    ".mp4": "video/mp4",
    ".webm": "video/webm",
}
_STYLE = """
:root { color-scheme: light dark; --line: #8884; --warn: #b45309; --good: #15803d; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 1100px; padding: 1.5rem; }
h1 { margin-bottom: .2rem; } h2 { border-top: 1px solid var(--line); margin-top: 2.5rem; padding-top: 1rem; }
table { border-collapse: collapse; margin: 1rem 0; }
td { border-bottom: 1px solid var(--line); padding: .25rem 1.5rem .25rem 0; vertical-align: top; }
td + td { font-variant-numeric: tabular-nums; }
pre { background: #8882; overflow-x: auto; padding: .7rem 1rem; }
.pictures { display: grid; gap: 1rem; grid-template-columns: repeat(auto-fit, minmax(min(100%, 440px), 1fr)); }
figure { margin: 0; overflow-x: auto; } .wide { grid-column: 1 / -1; }
img, video { background: #fff; border: 1px solid var(--line); max-width: 100%; }
figure label { cursor: zoom-in; } figure input { display: none; }
input:checked + label { cursor: zoom-out; } input:checked + label img { max-width: none; }
figcaption { font-size: .85rem; opacity: .8; } .warning { color: var(--warn); } .good { color: var(--good); }
.legend { list-style: none; padding: 0; } .legend li { display: inline-block; margin-right: 1.5rem; }
.legend span { border: 1px solid var(--line); display: inline-block; height: .9em; margin-right: .4em; width: .9em; }
@media (prefers-color-scheme: dark) { :root { --warn: #f59e0b; --good: #4ade80; } }
""".strip()


@dataclass(frozen=True)
class Figure:
    """A row of a table: a name, its value, a verdict on it ("" for none), and whether that is good."""

    name: str
    value: str
    verdict: str = ""
    good: bool = True


@dataclass(frozen=True)
class Picture:
    """A picture, an animation or a video: ``source`` is a path relative to the page, or a data address.

    A ``wide`` one has a row for itself, others stand side by side.
    """

    source: str
    caption: str
    wide: bool = False

    @property
    def is_video(self) -> bool:
        """Whether a player is needed."""
        return self.source.startswith("data:video/") or self.source.lower().endswith((".mp4", ".webm"))


@dataclass(frozen=True)
class Section:
    """A part of a page: a title, then words, warnings, figures, colours and what they mean, commands, files, pictures.

    Colours are as CSS writes them, commands are whole lines, files are paths relative to the page, with words.
    """

    title: str
    words: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    table: tuple[Figure, ...] = ()
    legend: tuple[tuple[str, str], ...] = ()
    commands: tuple[str, ...] = ()
    files: tuple[tuple[str, str], ...] = ()
    pictures: tuple[Picture, ...] = ()


def html_page(title: str, words: str, sections: Sequence[Section]) -> str:
    """Return a whole HTML page that needs nothing else but the files that its pictures name."""
    body = "\n".join(_section(section, number) for number, section in enumerate(sections))
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{escape(title)}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<link rel="icon" href="data:,">\n'
        f"<style>\n{_STYLE}\n</style>\n</head>\n<body>\n<h1>{escape(title)}</h1>\n<p>{escape(words)}</p>\n"
        f"{body}\n</body>\n</html>\n"
    )


def data_address(data: bytes, suffix: str) -> str:
    """Return ``data`` of a kind told by ``suffix`` (one of `MEDIA`) as an address that holds it."""
    return f"data:{MEDIA[suffix.lower()]};base64,{base64.b64encode(data).decode('ascii')}"


def _section(section: Section, number: int) -> str:
    parts = [f"<section>\n<h2>{escape(section.title)}</h2>"]
    parts += [f"<p>{escape(word)}</p>" for word in section.words]
    parts += [f'<p class="warning">{escape(warning)}</p>' for warning in section.warnings]
    if section.table:
        parts.append(f"<table>\n{chr(10).join(_row(figure) for figure in section.table)}\n</table>")
    if section.legend:
        items = (f'<li><span style="background: {escape(c)}"></span>{escape(what)}</li>' for c, what in section.legend)
        parts.append(f'<ul class="legend">\n{chr(10).join(items)}\n</ul>')
    if section.commands:
        parts.append(f"<pre>{escape(chr(10).join(section.commands))}</pre>")
    if section.files:
        rows = (f'<li><a href="{escape(path)}">{escape(path)}</a> {escape(what)}</li>' for path, what in section.files)
        parts.append(f"<ul>\n{chr(10).join(rows)}\n</ul>")
    if section.pictures:
        shown = (_picture(picture, f"zoom-{number}-{place}") for place, picture in enumerate(section.pictures))
        parts += ['<div class="pictures">', *shown, "</div>"]
    return "\n".join([*parts, "</section>"])


def _row(figure: Figure) -> str:
    kind = "good" if figure.good else "warning"
    verdict = f'<td class="{kind}">{escape(figure.verdict)}</td>' if figure.verdict else "<td></td>"
    return f"<tr><td>{escape(figure.name)}</td><td>{escape(figure.value)}</td>{verdict}</tr>"


def _picture(picture: Picture, name: str) -> str:
    """A figure whose picture is seen in full size at a click: its file, or, where the page holds it, in its place."""
    caption = escape(picture.caption)
    image = f'<img src="{escape(picture.source)}" alt="{caption}">'
    if picture.is_video:
        shown = f'<video src="{escape(picture.source)}" controls loop muted></video>'
    elif picture.source.startswith("data:"):
        shown = f'<input type="checkbox" id="{name}"><label for="{name}">{image}</label>'
    else:
        shown = f'<a href="{escape(picture.source)}">{image}</a>'
    kind = ' class="wide"' if picture.wide else ""
    return f"<figure{kind}>{shown}<figcaption>{caption}</figcaption></figure>"
