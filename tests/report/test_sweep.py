"""The page and the table of a study, from invented trials."""

import csv

import pytest
from support.studies import SMALL, UNDER_EFFECTS
from support.trials import invented

from jaxident.files.summary import write_summary
from jaxident.report.sweep import write_study
from jaxident.study.statistics import summarise


@pytest.mark.parametrize(("study", "maps"), [(SMALL, 0), (UNDER_EFFECTS, 1)])
def test_the_axis_of_effects_is_there_where_the_study_has_it(tmp_path, study, maps):
    trials = invented(study)
    summary = summarise(trials)
    write_study(study, trials, summary, tmp_path / "index.html")
    page = (tmp_path / "index.html").read_text()
    assert ("3 sets of effects" in page) == bool(maps)
    lead = page.split('<p class="lead">')[1].split("</p>")[0]
    assert lead.startswith("batch ")
    assert "camera noise" in lead
    assert '{"jaxident"' not in page
    assert page.count('alt="batch: error [%] by effect, at 0.1 mm of camera noise"') == maps
    write_summary(summary, tmp_path / "summary.csv")
    with open(tmp_path / "summary.csv") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 2 * 12 * (3 if maps else 1)
    assert {row.get("effect") for row in rows} == ({"none", "payload", "late"} if maps else {None})


def header_of(study, tmp_path, *, bound=None, broken=0):
    """The first screen of a study's page."""
    trials = invented(study)
    if broken:
        trials["reason"][{"seed": slice(0, broken)}] = 1
    summary = summarise(trials)
    if bound is not None:
        summary["rmse_over_bound"] = 0.0 * summary["rmse"] + bound
    write_study(study, trials, summary, tmp_path / "index.html")
    return (tmp_path / "index.html").read_text().split("</header>")[0]


def test_the_first_screen_says_what_to_do_next_and_shows_what_breaks(tmp_path):
    assert 'alt="Error of each estimator against camera noise"' in (header := header_of(SMALL, tmp_path))
    assert "Look at single trials: <code>jaxident sweep STUDY.toml --trial 7" in header
    header = header_of(SMALL, tmp_path, bound=210.0)
    assert "210 times the least that the logs allow" in header
    assert "<code>method = &quot;maximum-likelihood&quot;</code>" in header
    assert "Look at single trials" in header_of(SMALL, tmp_path, bound=1.5)
    assert "Find out why" in header_of(SMALL, tmp_path, broken=1)
