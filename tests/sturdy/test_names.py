"""Names that strangers choose, through every page: markup, quotes, formulas, paths. They stay text."""

import csv
import dataclasses
import re
from html.parser import HTMLParser

import jax
import pytest
from support.diagnoses import made_up
from support.studies import SMALL, UNDER_EFFECTS
from support.trials import invented

from jaxident.errors import InputError
from jaxident.estimation.identify import identify
from jaxident.estimation.uncertainty.verdict import verdicts
from jaxident.files.models import load_model
from jaxident.files.summary import write_summary
from jaxident.plot.names import plain
from jaxident.report.diagnosis import diagnosis_page
from jaxident.report.identification import write_identification
from jaxident.report.page import render
from jaxident.report.sweep import write_study
from jaxident.report.trial import draw_trial
from jaxident.study.design import check_study
from jaxident.study.engine import run_one
from jaxident.study.statistics import summarise
from jaxident.study.synthetic import excite, simulate_runs

EVIL = "<script>alert('1')</script> \"q\" ../../x $\\frac{$ _y & &amp; é"
"""Markup, both quotes, a way out of the folder, half a formula, an entity."""
ALLOWED = {"html", "head", "meta", "title", "style", "body", "main", "header", "h1", "h2", "p", "section", "figure",
           "div", "img", "figcaption", "table", "thead", "tbody", "tr", "th", "td", "pre", "code",
           "footer", "details", "summary", "strong"}  # fmt: skip


class Tags(HTMLParser):
    """The kinds of tags of a page, and the names of all their attributes."""

    def __init__(self, text):
        super().__init__()
        self.kinds, self.attributes = set(), set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.kinds.add(tag)
        self.attributes |= {name for name, _ in attrs}


def harmless(text: str) -> None:
    """The page holds the tags of this program alone, no handler of an event, and shows the name as it is."""
    tags = Tags(text)
    assert tags.kinds <= ALLOWED
    assert not any(name.startswith("on") or name == "href" for name in tags.attributes)
    assert "&lt;script&gt;" in text
    assert not re.search(r"<script|javascript:", text)


@pytest.fixture
def study():
    """The smallest study, all that can have a name called by an evil one."""
    small = SMALL._replace(name=EVIL, robots=tuple(one._replace(name=EVIL) for one in SMALL.robots))
    small = small._replace(estimators=tuple(one._replace(name=f"_{EVIL}") for one in SMALL.estimators))
    sets = tuple(one._replace(name=f"{EVIL}{k}") for k, one in enumerate(UNDER_EFFECTS.effects))
    small = small._replace(effects=sets)
    check_study(small)
    return small


def test_a_study(study, tmp_path):
    trials = invented(study)
    summary = summarise(trials)
    folder = tmp_path / "here"
    folder.mkdir()
    write_study(study, trials, summary, folder / "index.html")
    harmless((folder / "index.html").read_text(encoding="utf-8"))
    write_summary(summary, folder / "summary.csv")
    with open(folder / "summary.csv", encoding="utf-8", newline="") as stream:
        assert {row["estimator"] for row in csv.DictReader(stream)} == {f"_{EVIL}"}
    assert [path.name for path in tmp_path.iterdir()] == ["here"]
    assert len(list(folder.iterdir())) == 2


@pytest.mark.slow
def test_the_picture_of_a_trial(study):
    draw_trial(study, 0, *run_one(study, 0)).canvas.draw()


def test_a_diagnosis_of_logs_of_evil_names():
    found = made_up("effects")
    harmless(render(diagnosis_page(found._replace(next=f"Record {EVIL}."), EVIL)))


@pytest.mark.slow
def test_an_identification(tmp_path):
    plain_log = excite(jax.random.key(0), "multilevel", 120, 1.0 / 30.0, hold=3)
    log = simulate_runs(load_model("published"), plain_log, noise=(1e-5, 1e-4), key=jax.random.key(1))
    found = identify(log, noise_law="white")
    origin = found.model.provenance._replace(version=EVIL, logs=(EVIL,))
    found = found._replace(model=dataclasses.replace(found.model, provenance=origin), suspicions=(EVIL,))
    write_identification(found, [log], verdicts(found.model, 1.0), tmp_path / "page.html")
    harmless((tmp_path / "page.html").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["", "  ", "a\x1b[2J", "a\nb", "\0", "a" * 301])
def test_what_is_no_name_is_refused(name):
    for study in (SMALL._replace(name=name), SMALL._replace(robots=(SMALL.robots[0]._replace(name=name),))):
        with pytest.raises(InputError, match="is no name: it should have 1 to 300 letters"):
            check_study(study)


def test_a_plain_name_is_no_formula_and_is_not_hidden():
    assert plain("_a $x$") == r" _a \$x\$"
