import base64
from html.parser import HTMLParser

from pegbar.report.page import Picture, Section, data_address, html_page
from tests.pages import complaints


class Elements(HTMLParser):
    """Collects elements, attributes and the words in them; complains of tags that are not closed in order."""

    def __init__(self, text):
        super().__init__()
        self.found, self.words, self.open = [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in ("meta", "link", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data.strip())

    def all(self, tag):
        return [attributes for name, attributes in self.found if name == tag]


def test_a_page_holds_what_its_sections_say():
    section = Section(
        "Title & <b>",
        words=("some words",),
        warnings=("look out",),
        table=(("error", "3 px"),),
        files=(("a b.glb", "a scene"),),
        pictures=(Picture("sheet.png", 'a "sheet"'), Picture("film.mp4", "a film")),
    )
    page = Elements(html_page("shot <1>", "lead", [section]))
    assert {"shot <1>", "lead", "Title & <b>", "some words", "look out", "error", "3 px", "a scene"} <= set(page.words)
    assert page.all("img") == [{"src": "sheet.png", "alt": 'a "sheet"'}]
    assert page.all("video")[0]["src"] == "film.mp4"
    assert page.all("a") == [{"href": "a b.glb"}]
    assert page.all("b") == []


def test_a_page_asks_for_nothing_outside():
    text = html_page("t", "w", [Section("s", pictures=(Picture(data_address(b"123", ".gif"), "c"),))])
    assert "http" not in text
    assert "<script" not in text
    (image,) = Elements(text).all("img")
    assert base64.b64decode(image["src"].removeprefix("data:image/gif;base64,")) == b"123"


def test_a_video_in_the_page_gets_a_player():
    assert Picture(data_address(b"1", ".mp4"), "").is_video
    assert not Picture(data_address(b"1", ".png"), "").is_video


def test_what_a_page_lacks_offline_is_found(tmp_path):
    section = Section("s", files=(("b c.txt", "f"),), pictures=(Picture("a.png", "p"), Picture("http://x/y.png", "q")))
    page = tmp_path / "page.html"
    page.write_text(html_page("t", "w", [section]) + "<style>p{background:url(z.png)}</style><script></script>")
    assert complaints(page) == [
        "a script",
        "no such file: b c.txt",
        "no such file: a.png",
        "asks for http://x/y.png",
        "no such file: z.png",
    ]
    for name in ("a.png", "b c.txt", "z.png"):
        (tmp_path / name).touch()
    assert complaints(page) == ["a script", "asks for http://x/y.png"]
