"""The page of an identification holds what the program printed, and its pictures."""

import numpy as np
import pytest

from jaxident.array_types import Pose
from jaxident.errors import InputError
from jaxident.estimation.bootstrap import Bootstrap
from jaxident.estimation.identify import Identification
from jaxident.estimation.poses.likelihood import Innovations
from jaxident.estimation.poses.maximum_likelihood import Fit
from jaxident.estimation.uncertainty.verdict import Verdict
from jaxident.log import make_log
from jaxident.report.identification import write_identification
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model

VERDICTS = [
    Verdict("rate_1", 0.5, 0.49, 0.51, "determined"),
    Verdict("dead_zone_r", 0.2, 0.0, 0.9, "not determined", "this input moves too little by it"),
]


def made():
    """Two runs of different lengths, and residuals of white noise."""
    rng = np.random.default_rng(0)
    logs = [make_log(0.1 * np.arange(n), *rng.normal(size=(2, n)), *rng.normal(size=(3, n))) for n in (60, 80)]
    normalised = rng.normal(size=(2, 3, 80))
    normalised[0, :, 60:] = 0.0
    residuals = Pose(*(0.01 * np.concatenate([normalised[0, k, :60], normalised[1, k]]) for k in range(3)))
    fit = Fit(None, None, None, None, Innovations(normalised, 0.0 * normalised), True, 5)
    model = Model(0.1, Physical(np.ones(2), np.ones((2, 2))), np.array([0.2, 0.1]))
    return Identification(model, None, residuals, True, fit=fit, suspicions=("the heading is odd",)), logs


def test_page_holds_parameters_doubts_tests_and_pictures(tmp_path):
    found, logs = made()
    (path,) = write_identification(found, logs, VERDICTS, tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert path == str(tmp_path / "page.html")
    assert "from the prior: this log" not in text
    for words in (
        "The log determines 1 of 2 numbers.",
        "not determined: this input moves",
        "The heading is odd.",
        "white",
    ):
        assert words in text
    assert text.count("<img") == 4
    write_identification(found._replace(suspicions=(), ok=False), logs, VERDICTS, tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Nothing speaks against it. The fit did not converge" in text
    assert "What to do next.</strong> Read what speaks against the fit" in text


def test_the_first_screen_says_what_to_do_next_and_shows_the_path(tmp_path):
    found, logs = made()
    for suspicions, rows, words in (
        (("the heading is odd", "so is x"), VERDICTS, "The heading is odd. 1 more below."),
        ((), VERDICTS, "If you need dead_zone_r more exactly, drive a run whose path depends"),
        ((), VERDICTS[:1], "Predict a run that this fit has not seen (<code>jaxident predict</code>)"),
    ):
        write_identification(found._replace(suspicions=suspicions), logs, rows, tmp_path / "page.html")
        header = (tmp_path / "page.html").read_text(encoding="utf-8").split("</header>")[0]
        assert f"What to do next.</strong> {words}" in header
        assert 'alt="Path"' in header


def test_page_shows_a_bootstraps_intervals_beside_the_likelihoods(tmp_path):
    found, logs = made()
    ends = np.array([[0.4321, 0.5678], [0.1234, 0.3456]])
    again = Bootstrap(("rate_1", "dead_zone_r"), np.zeros((40, 2)), np.arange(40) > 0, np.eye(2), ends, "blocks", 17)
    write_identification(found, logs, VERDICTS, tmp_path / "page.html", again)
    text = (tmp_path / "page.html").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    for words in ("[0.490, 0.510]", "[0.432, 0.568]", "[0.12, 0.35]", "39 of 40 refits", "blocks of 17 residuals"):
        assert words in text


def test_the_papers_method_has_no_page(tmp_path):
    found, logs = made()
    with pytest.raises(InputError, match="maximum likelihood"):
        write_identification(found._replace(fit=None), logs, VERDICTS, tmp_path / "page.html")


def test_page_names_what_comes_from_the_prior(tmp_path):
    found, logs = made()
    lent = [VERDICTS[0]._replace(verdict="from the prior", reason="this log hardly tells it"), VERDICTS[1]]
    write_identification(found, logs, lent, tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "The log determines 0 of 2 numbers, 1 come from the prior." in text
    assert "from the prior: this log hardly tells it" in text
