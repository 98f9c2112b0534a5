import base64
from html.parser import HTMLParser

from pegbar.report.page import Figure, Picture, Section, data_address, html_page
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
        if tag not in ("meta", "link", "img", "input"):
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
        table=(Figure("error", "3 px", "good: up to 4 px"), Figure("slide", "9 mm", "look at it: <8", good=False)),
        legend=(("rgb(1, 2, 3)", "her left"),),
        commands=("pegbar a  # 1", "pegbar b"),
        files=(("a b.glb", "a scene"),),
        pictures=(Picture("sheet.png", 'a "sheet"'), Picture("film.mp4", "a film")),
    )
    page = Elements(html_page("shot <1>", "lead", [section]))
    assert {"shot <1>", "lead", "Title & <b>", "some words", "look out", "error", "3 px", "a scene"} <= set(page.words)
    assert page.all("img") == [{"src": "sheet.png", "alt": 'a "sheet"'}]
    assert page.all("video")[0]["src"] == "film.mp4"
    assert {"good: up to 4 px", "slide", "9 mm", "look at it: <8", "her left", "pegbar a  # 1\npegbar b"} <= set(
        page.words
    )
    # A picture leads to its file.
    assert page.all("a") == [{"href": "a b.glb"}, {"href": "sheet.png"}]
    assert page.all("b") == []
    kinds = [attributes.get("class") for attributes in page.all("td")]
    assert kinds == [None, None, "good", None, None, "warning"]
    assert page.all("span") == [{"style": "background: rgb(1, 2, 3)"}]


def test_a_page_asks_for_nothing_outside():
    text = html_page("t", "w", [Section("s", pictures=(Picture(data_address(b"123", ".gif"), "c"),))])
    assert "http" not in text
    assert "<script" not in text
    (image,) = Elements(text).all("img")
    assert base64.b64decode(image["src"].removeprefix("data:image/gif;base64,")) == b"123"


def test_pictures_that_the_page_holds_are_enlarged_in_their_place():
    held = Picture(data_address(b"123", ".png"), "c")
    page = Elements(html_page("t", "w", [Section("s", pictures=(held, held)), Section("r", pictures=(held,))]))
    switches, labels = page.all("input"), page.all("label")
    assert [label["for"] for label in labels] == [switch["id"] for switch in switches]
    assert len({switch["id"] for switch in switches}) == 3
    # A browser opens no data address as a page.
    assert page.all("a") == []


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
        # Each picture leads to its file.
        *["no such file: a.png"] * 2,
        *["asks for http://x/y.png"] * 2,
        "no such file: z.png",
    ]
    for name in ("a.png", "b c.txt", "z.png"):
        (tmp_path / name).touch()
    assert complaints(page) == ["a script", *["asks for http://x/y.png"] * 2]
