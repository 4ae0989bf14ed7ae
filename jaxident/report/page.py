"""From a title, a verdict and sections to one HTML page. All text is escaped. Back ticks around what a
reader types are the only markup."""

import base64
import math
import re
import struct
from collections.abc import Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np

from jaxident.files.atomic import Target, write_text
from jaxident.report.look import CSS
from jaxident.report.terms import HEADS

NOTHING = "–"
"""What a table shows for a number that is missing."""

SCALE = 0.72
"""Size on the page [px] of a dot of a picture: one of 6.3 inches at 150 dots an inch fills the column."""

NARROW = 520
"""Width on the page [px] up to which a picture's text stays readable where it is shrunk to a phone's 340."""

PHONE = 4.8
"""Width of a picture [inch] of which a phone shows all: at 150 dots an inch it is 518 px on the page, just NARROW."""

# Even a page that went wrong loads nothing: the browser allows its own pictures and its own style alone.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


class Table(NamedTuple):
    """Column names and rows of text or numbers; numbers stand to the right, with four digits. None and NaN are
    missing numbers."""

    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    caption: str = ""


class Figure(NamedTuple):
    """A picture as the content of a PNG file, what it shows in words (for those who cannot see it), a caption."""

    png: bytes
    alt: str
    caption: str = ""


class Code(NamedTuple):
    """Text that stands as it is, in a box: a command, a file, numbers in columns."""

    text: str
    caption: str = ""


class Section(NamedTuple):
    """A heading and what follows it: paragraphs (str), tables, figures and code in any order. folded: it shows its
    heading alone until a reader opens it; for what few look up."""

    heading: str
    blocks: Sequence["str | Table | Figure | Code"]
    folded: bool = False


class Page(NamedTuple):
    """A title, the verdict in a sentence, the sections and a closing line such as version and seed. next: what to do
    now, in a sentence that stands below the verdict; picture: what shows the verdict; it stands below that."""

    title: str
    lead: str
    sections: Sequence[Section]
    footer: str = ""
    next: str = ""
    picture: Figure | None = None


def render(page: Page) -> str:
    """The page as HTML; equal pages give equal text."""
    footer = f"<footer>{escape(page.footer)}</footer>\n" if page.footer else ""
    follows = f"<p><strong>What to do next.</strong> {_text(page.next)}</p>\n" if page.next else ""
    picture = "" if page.picture is None else _block(page.picture)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(page.title)}</title>\n<style>{CSS}</style>\n</head>\n<body>\n<main>\n"
        f'<header>\n<h1>{escape(page.title)}</h1>\n<p class="lead">{_text(page.lead)}</p>\n'
        f"{follows}{picture}</header>\n"
        f"{''.join(_section(section) for section in page.sections)}{footer}</main>\n</body>\n</html>\n"
    )


def write_page(page: Page, path: Target) -> None:
    """Write the page to a file, whole or not at all; InputError where it cannot be written."""
    write_text(path, render(page))


def fragment(blocks: Sequence["str | Table | Figure | Code"]) -> str:
    """Paragraphs, tables and figures as HTML to stand in another page, such as a notebook's."""
    return f"<div>{''.join(_block(block) for block in blocks)}</div>"


def _section(section: Section) -> str:
    blocks = "".join(_block(block) for block in section.blocks)
    if section.folded:
        head = f"<summary><h2>{escape(section.heading)}</h2></summary>"
        return f"<section>\n<details>\n{head}\n{blocks}</details>\n</section>\n"
    return f"<section>\n<h2>{escape(section.heading)}</h2>\n{blocks}</section>\n"


def _block(block: "str | Table | Figure | Code") -> str:
    match block:
        case Table():
            return _figure(_caption(block.caption) + _table(block))
        case Figure():
            return _figure(f'<div class="wide white" tabindex="0">{_image(block)}</div>\n{_caption(block.caption)}')
        case Code():
            return _figure(f'<pre tabindex="0"><code>{escape(block.text)}</code></pre>\n{_caption(block.caption)}')
        case _:
            return f"<p>{_text(block)}</p>\n"


def _figure(content: str) -> str:
    return f"<figure>\n{content}</figure>\n"


def _image(figure: Figure) -> str:
    """The picture in proportion to its size in dots, so that the text of all pictures is equally large."""
    width, height = (round(SCALE * size) for size in struct.unpack(">II", figure.png[16:24]))  # of the PNG header
    source = base64.b64encode(figure.png).decode("ascii")
    fits = ' class="fits"' if width <= NARROW else ""
    return (
        f'<img{fits} width="{width}" height="{height}" alt="{escape(figure.alt)}" src="data:image/png;base64,{source}">'
    )


def _table(table: Table) -> str:
    """A table in a box of its own that scrolls; a column is numeric if all that it holds is."""
    numeric = [all(_is_number(cell) for cell in column) for column in zip(*table.rows, strict=True)]
    numeric = numeric or [False] * len(table.columns)
    head = "".join(_cell("th", name, right) for name, right in zip(table.columns, numeric, strict=True))
    rows = (
        "".join(_cell("td", _written(cell), right) for cell, right in zip(row, numeric, strict=True))
        for row in table.rows
    )
    body = "".join(f"<tr>{row}</tr>\n" for row in rows)
    inner = f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>"
    return f'<div class="wide" tabindex="0">{inner}</div>\n'


def _cell(tag: str, text: str, right: bool) -> str:
    scope = ' scope="col"' if tag == "th" else ""
    meaning = HEADS.get(text.replace("\N{NO-BREAK SPACE}", " ")) if tag == "th" else None
    hover = f' title="{escape(meaning)}"' if meaning else ""
    side = ' class="number"' if right else ""
    return f"<{tag}{scope}{side}{hover}>{escape(text)}</{tag}>"


def _caption(text: str) -> str:
    return f"<figcaption>{_text(text)}</figcaption>\n" if text else ""


def _text(text: str) -> str:
    """Escaped text; what stands between back ticks is what a reader types."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def _is_number(cell: Any) -> bool:
    return cell is None or np.asarray(cell).dtype.kind in "iuf"


def _written(cell: Any) -> str:
    """A cell as text: whole numbers in full, others with five digits and a proper minus."""
    if not _is_number(cell):
        return str(cell)
    if cell is None or math.isnan(cell):
        return NOTHING
    whole = np.asarray(cell).dtype.kind in "iu"
    return (str(int(cell)) if whole else f"{float(cell):.5g}").replace("-", "\N{MINUS SIGN}")
