"""The page and the table of a study, from invented trials."""

import csv
import dataclasses

import pytest
from support.studies import SMALL, UNDER_EFFECTS
from support.trials import invented

from jaxident.files.summary import write_summary
from jaxident.report.sweep import SINGLE, what_next, write_study
from jaxident.study.sight import Choice
from jaxident.study.statistics import summarise


@pytest.mark.parametrize(("study", "maps"), [(SMALL, 0), (UNDER_EFFECTS, 1)])
def test_the_axis_of_effects_is_there_where_the_study_has_it(tmp_path, study, maps):
    trials = invented(study)
    summary = summarise(trials)
    write_study(study, trials, summary, tmp_path / "index.html")
    page = (tmp_path / "index.html").read_text()
    assert ("3 sets of effects" in page) == bool(maps)
    lead = page.split('<p class="lead">')[1].split("</p>")[0]
    assert lead.startswith("key-term ")
    assert "camera noise" in lead
    assert '{"jaxident"' not in page
    assert page.count('alt="key-term: error [%] by effect, at 0.1 mm of camera noise"') == maps
    write_summary(summary, tmp_path / "summary.csv")
    with open(tmp_path / "summary.csv") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 2 * 12 * (3 if maps else 1)
    assert {row.get("effect") for row in rows} == ({"none", "payload", "late"} if maps else {None})


def next_step(*, bound=None, broken=0):
    """What a study's page says to do next."""
    trials = invented(SMALL)
    trials["reason"][{"seed": slice(0, broken)}] = 1
    summary = summarise(trials)
    if bound is not None:
        summary["rmse_over_bound"] = 0.0 * summary["rmse"] + bound
    return what_next(SMALL, summary)


def test_what_to_do_next():
    assert next_step() == next_step(bound=1.5) == SINGLE
    assert next_step(bound=210.0).startswith("These errors are 210 times the least that the logs allow")
    assert '`method = "maximum-likelihood"`' in next_step(bound=210.0)
    assert next_step(broken=1).startswith("Find out why")


def test_coupling_is_asked_for_where_a_robot_has_it():
    """The published robot has; maximum likelihood that does not look for it is far from the bound."""
    assert "with `settings = { coupling = true }`" in next_step(bound=210.0)
    trials = invented(SMALL)
    summary = summarise(trials)
    summary["rmse_over_bound"] = 0.0 * summary["rmse"] + 30.0
    (name,) = map(str, summary["estimator"].values)
    plain = Choice(name, "maximum-likelihood")
    assert "coupling = true" in what_next(SMALL._replace(estimators=(plain,)), summary)
    looking = plain._replace(settings=(("coupling", True),))
    assert what_next(SMALL._replace(estimators=(looking,)), summary) == SINGLE
    still = dataclasses.replace(SMALL.robots[0].model, dynamics=SMALL.robots[0].model.physical._replace(coupling=None))
    alone = SMALL._replace(estimators=(plain,), robots=(SMALL.robots[0]._replace(model=still),))
    assert what_next(alone, summary) == SINGLE


def test_the_first_screen_shows_what_breaks(tmp_path):
    trials = invented(SMALL)
    write_study(SMALL, trials, summarise(trials), tmp_path / "index.html")
    header = (tmp_path / "index.html").read_text().split("</header>")[0]
    assert 'alt="Error of each estimator against camera noise"' in header
    assert "Look at single trials: <code>jaxident sweep STUDY.toml --trial 0" in header


def test_a_study_of_which_nothing_is_left_has_a_page(tmp_path):
    """All estimates failed, at one level without noise."""
    study = SMALL._replace(noise=(0.0,))
    trials = invented(study)
    trials["reason"][:] = 1
    for name in ("estimate", "deviation"):
        trials[name][:] = float("nan")
    write_study(study, trials, summarise(trials), tmp_path / "index.html")
    assert "Find out why" in (tmp_path / "index.html").read_text()
