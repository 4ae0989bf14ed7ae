"""Reports as single HTML pages."""

import base64
import re
import struct
from html.parser import HTMLParser

import numpy as np
import pytest

from jaxident.errors import InputError
from jaxident.report import Code, Figure, Page, Section, Table, render, write_page

PNG = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + struct.pack(">II", 1000, 500) + b"the rest"
VOID = {"meta", "img"}


class Outline(HTMLParser):
    """Every tag with its attributes; complains of tags that close in the wrong order."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.open = [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def page(**changes) -> Page:
    blocks = [
        "A paragraph with <b>bold</b> & more.",
        Table(["name", "value"], [["<script>alert(1)</script>", 1.0], ["b", None]], "a < b"),
        Figure(PNG, 'a "quoted" picture', "a caption"),
        Code("if a < b:\n    print(b)", "a listing"),
    ]
    whole = Page("Title <script>", "The verdict.", [Section("Heading & co", blocks)], "jaxident, seed 0")
    return whole._replace(**changes)


def test_all_text_is_escaped_and_every_tag_closes():
    text = render(page(lead="<script>alert(1)</script>"))
    outline = Outline(text)
    assert outline.all("script") == outline.all("b") == []
    assert text.count("&lt;script&gt;") == 4
    assert outline.all("img")[0]["alt"] == 'a "quoted" picture'


def test_the_page_needs_no_network():
    text = render(page())
    assert re.findall(r"https?://|url\(|@import|<link|<script", text) == []
    outline = Outline(text)
    assert all(attributes["src"].startswith("data:image/png;base64,") for attributes in outline.all("img"))
    policy = next(meta["content"] for meta in outline.all("meta") if "http-equiv" in meta)
    assert policy.startswith("default-src 'none'")


def test_equal_pages_are_rendered_alike():
    assert render(page()) == render(page())


def test_a_figure_is_embedded_whole_and_in_proportion():
    (image,) = Outline(render(page())).all("img")
    assert base64.b64decode(image["src"].partition(",")[2]) == PNG
    assert (image["width"], image["height"]) == ("720", "360")


def test_numbers_stand_to_the_right_with_five_digits():
    rows = [["a", 1234567, 0.000123456, np.float64(-2.5)], ["b", np.int64(-3), np.nan, None], ["c", 2, np.inf, 1e-12]]
    text = render(page(sections=[Section("s", [Table(["name", "count", "x", "y"], rows)])]))
    cells = re.findall(r'<td class="number">([^<]*)</td>', text)
    assert cells == ["1234567", "0.00012346", "−2.5", "−3", "–", "–", "2", "inf", "1e−12"]
    assert len(re.findall(r"<td>[abc]</td>", text)) == 3


def test_a_column_with_a_word_in_it_is_text_and_so_are_answers():
    rows = [[1.0, True], ["none", False]]
    text = render(page(sections=[Section("s", [Table(["p", "ok"], rows)])]))
    assert re.findall(r"<td>([^<]*)</td>", text) == ["1", "True", "none", "False"]


def test_wide_things_scroll_in_a_box_of_their_own():
    text = render(page())
    assert len(re.findall(r'<div class="wide[^"]*" tabindex="0"><(?:table|img)', text)) == 2
    assert ".wide { overflow-x: auto; }" in text


def test_a_folded_section_shows_its_heading_alone_and_what_to_do_next_stands_in_the_head():
    text = render(page(sections=[Section("All & more", ["Long."], folded=True)], next="Record <more>."))
    assert Outline(text).all("details") == [{}]
    assert "<summary><h2>All &amp; more</h2></summary>\n<p>Long.</p>" in text
    assert "Record &lt;more&gt;.</p>\n</header>" in text


def test_empty_parts_leave_no_trace():
    text = render(page(sections=[Section("s", [Table(["a", "b"], [])])], footer=""))
    Outline(text)
    assert "<footer" not in text
    assert "<figcaption" not in text


def test_a_row_too_short_is_an_error():
    with pytest.raises(ValueError, match="zip"):
        render(page(sections=[Section("s", [Table(["a", "b"], [["x"]])])]))


def test_the_page_is_written_whole_or_refused(tmp_path):
    write_page(page(), tmp_path / "index.html")
    assert (tmp_path / "index.html").read_text(encoding="utf-8") == render(page())
    with pytest.raises(InputError, match="does not exist"):
        write_page(page(), tmp_path / "missing" / "index.html")
