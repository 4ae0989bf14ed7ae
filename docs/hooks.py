"""Pages that a build makes: from README, experiments, notebooks, docstrings and the catalogue of effects.

`mkdocs build` calls `on_files`. Nothing that it makes is written into the repository.
"""

import functools
import pathlib
import re
import sys

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import jaxident  # noqa: E402 - both lie beside this folder
from experiments import effect_cards, notebook_pages, reference_page  # noqa: E402
from jaxident.report.glossary import TERMS  # noqa: E402

COPIED = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    **{
        f"experiments/{name}": name
        for name in (
            "validation.md",
            "real_robots.md",
            "robustness.md",
            "robustness.png",
            "efficiency.md",
            "discovered.md",
            "discovered.png",
            "export_gap.md",
            "speed.md",
            "gpu.md",
        )
    },
}
"""Files of the repository and the places in the site that they get."""

ALONE = ("index.md", "effects.md", "reference.md", "changelog.md")
"""Pages without neighbours: their text takes the room of the navigation."""


def on_files(files, config):
    """Add what is made to the files of docs/."""
    for place, content in made_pages().items():
        files.append(File.generated(config, place, content=content))
    return files


@functools.cache
def made_pages() -> dict[str, str | bytes]:
    """Content by place. Made once: `mkdocs serve` builds often."""
    jaxident.start_jax()
    words = "\n".join(f"* **{term}**: {meaning}" for term, meaning in TERMS.items())
    pages: dict[str, str | bytes] = {"reference.md": reference_page.page(), **effect_cards.pages()}
    pages["glossary.md"] = f"# Glossary\n\n{words}\n"
    for source, place in COPIED.items():
        path = ROOT / source
        pages[place] = with_links(path.read_text("utf-8")) if path.suffix == ".md" else path.read_bytes()
    for place in ALONE:
        pages[place] = f"---\nhide: [navigation]\n---\n\n{pages[place]}"
    return {**pages, **notebook_pages.pages(ROOT / "experiments" / "notebooks")}


def on_page_markdown(markdown, page, **_):
    """Names of pages in the text of docs/ become links, too."""
    return with_links(markdown, page.file.src_uri)


def with_links(text: str, here: str = "") -> str:
    """The text with pictures where the site has them, and with links where it names a page in backticks."""
    text = text.replace("](docs/", "](")
    up = "../" * here.count("/")
    places = {source: place for source, place in COPIED.items() if place.endswith(".md")}
    places |= {f"docs/{path.name}": path.name for path in (ROOT / "docs").glob("*.md")}

    def link(match: re.Match) -> str:
        place = places.get(match[1]) or places.get(f"experiments/{match[1]}")
        return f"[{place[:-3].replace('_', ' ')}]({up}{place})" if place else match[0]

    return re.sub(r"(?<!\[)`([\w./]+\.md)`", link, text)
