"""The page of `jaxident identify`: parameters and how sure they are, what the log says against it, what is left."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jaxident import plot
from jaxident.errors import InputError
from jaxident.estimation.bootstrap import Bootstrap, describe
from jaxident.estimation.identify import Identification
from jaxident.estimation.poses.residual_tests import CHANNELS, DRAWN_LAGS, correlations, fit_percent, residual_tests
from jaxident.estimation.poses.runs import stack_runs
from jaxident.estimation.uncertainty.verdict import BORROWED, Verdict
from jaxident.files.atomic import Target
from jaxident.log import Log, join
from jaxident.report.glossary import glossary
from jaxident.report.origin import origin_section
from jaxident.report.page import PHONE, Figure, Page, Section, Table, write_page
from jaxident.report.parameters import interval, told
from jaxident.report.words import MINUS, SPACE

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def write_identification(
    found: Identification,
    logs: Sequence[Log],
    verdicts: Sequence[Verdict],
    path: Target,
    again: Bootstrap | None = None,
) -> list[str]:
    """Write the page of a maximum-likelihood fit to some logs, a bootstrap's intervals beside its own where there is
    one; returns its path. InputError for another method."""
    if found.fit is None:
        raise InputError("report: a page is written for maximum likelihood; other methods have none")
    write_page(_page(found, join(logs), verdicts, again), path)
    return [os.fspath(path)]


def _page(found: Identification, log: Log, verdicts: Sequence[Verdict], again: Bootstrap | None) -> Page:
    runs = stack_runs(log)
    normalised = np.asarray(found.fit.innovations.normalised) if found.fit is not None else np.zeros(0)
    percent = fit_percent(log, found.residuals)
    sections = [
        Section("Parameters", [_parameters(verdicts, again), _dead_zones(found)]),
        Section("What speaks against it", _doubts(found)),
        Section("What it explains", [_percent_table(percent)]),
        Section("What is left", [ABOUT_TESTS, _tests(normalised, runs), *_pictures(found, log, normalised, runs.seen)]),
    ]
    made = found.model.provenance
    sections.append(glossary(*WORDS))
    sections += origin_section(made.origin)
    lead, follows = _lead(found, verdicts, percent), _next(found, verdicts)
    return Page("The robot behind the log", lead, sections, f"jaxident {made.version}", follows, _path(found, log))


def _lead(found: Identification, verdicts: Sequence[Verdict], percent: np.ndarray) -> str:
    sure = sum(row.verdict == "determined" for row in verdicts)
    borrowed = sum(row.verdict == BORROWED for row in verdicts)
    lent = f", {borrowed} come from the prior" if borrowed else ""
    worst = CHANNELS[int(np.argmin(percent))]
    ending = "" if bool(found.ok) else " The fit did not converge: do not trust these numbers."
    count = len(found.suspicions)
    speak = "One thing speaks" if count == 1 else f"{count} things speak" if count else "Nothing speaks"
    return (
        f"The log determines {sure} of {len(verdicts)} numbers{lent}. The model explains {percent.min():.4g}{SPACE}% "
        f"of the motion in {worst}, where it is worst. {speak} against it.{ending}"
    )


def _next(found: Identification, verdicts: Sequence[Verdict]) -> str:
    """What to do with this model: mend what speaks against it, learn what is loose, or predict."""
    if not bool(found.ok):
        return "Read what speaks against the fit, below; a longer log, or one that moves more, helps most often."
    if found.suspicions:
        more = len(found.suspicions) - 1
        return f"{_doubts(found)[0]}{f' {more} more below.' if more else ''}"
    loose = [row.parameter for row in verdicts if row.verdict != "determined"]
    if loose:
        return f"If you need {', '.join(loose)} more exactly, drive a run whose path depends more on them. {PREDICT}"
    return PREDICT


def _parameters(verdicts: Sequence[Verdict], again: Bootstrap | None) -> Table:
    rows = [with_words(row) for row in verdicts]
    if again is None:
        return Table(COLUMNS, rows, ABOUT_INTERVALS)
    own = (interval(name, *ends) for name, ends in zip(again.order, again.interval, strict=True))
    beside = [(*row[:4], _typeset(text), *row[4:]) for row, text in zip(rows, own, strict=True)]
    return Table((*COLUMNS[:4], "bootstrap 95 %", *COLUMNS[4:]), beside, f"{ABOUT_INTERVALS} {describe(again)}")


def with_words(row: Verdict) -> tuple[str, ...]:
    """A parameter as a row of a page's table, in the order of COLUMNS."""
    one = told(row)
    meaning = f"{one.meaning} [{one.unit}]" if one.unit else one.meaning
    return one.name, meaning, _typeset(one.estimate), _typeset(one.interval), one.verdict


def _typeset(numbers: str) -> str:
    """Numbers as a page shows them: a proper minus, and all on one line."""
    return numbers.replace("-", MINUS).replace(" ", SPACE)


def _doubts(found: Identification) -> list[str]:
    return [f"{line[0].upper()}{line[1:]}." for line in found.suspicions] or ["No suspicion was raised."]


def _percent_table(percent: np.ndarray) -> Table:
    return Table(("channel", "fit [%]"), list(zip(CHANNELS, map(float, percent), strict=True)), ABOUT_PERCENT)


def _tests(normalised: np.ndarray, runs) -> Table:
    rows = [
        (one.channel, one.question, one.value, one.limit, "yes" if one.passed else "no")
        for one in residual_tests(normalised, runs.seen, runs.command)
    ]
    return Table(("channel", "are the residuals", "number", "limit", "passed"), rows)


def _dead_zones(found: Identification) -> Figure:
    figure, ax = plot.figure(size=(4.5, 3.2))
    plot.dead_zone(np.asarray(found.model.dead_zone), ax=ax, label=["right wheel", "left wheel"])
    return Figure(plot.image(figure), "Dead zones", "What passes the dead zone of each wheel.")


def _path(found: Identification, log: Log) -> Figure:
    figure, ax = plot.figure(size=(PHONE, 4.2))
    draw_fit(found, log, ax)
    return Figure(plot.image(figure), "Path", "Measured poses and the model's, run by run from one start state each.")


def draw_fit(found: Identification, log: Log, ax: "Axes | None" = None) -> "Axes":
    """Measured poses and the model's, on some axes or on new ones: measured minus residual."""
    ax = plot.path(log, ax=ax)
    for run in np.unique(np.asarray(log.run)):
        own = np.asarray(log.run) == run
        x, y = (np.asarray(c)[own] - r[own] for c, r in zip(log.pose[:2], found.residuals[:2], strict=True))
        ax.plot(x, y, color="#0072B2", linewidth=0.8, label="model" if run == np.ravel(log.run)[0] else None)
    plot.legend_above(ax)
    return ax


def _pictures(found: Identification, log: Log, normalised: np.ndarray, seen: np.ndarray) -> list[Figure]:
    lengths = [len(run.t) for run in log.runs()]
    rows = [np.where(s, n, np.nan)[:, :k] for n, s, k in zip(normalised, seen[:, None], lengths, strict=True)]
    times, begin = [], 0.0
    for run in log.runs():
        times.append(begin + np.asarray(run.t) - run.t[0])
        begin = float(times[-1][-1])
    figure, axes = plot.figure(3, 1, share_x=True, size=(6.3, 4.2))
    plot.residuals(np.concatenate(times), np.concatenate(rows, axis=1), axes=axes)
    values = correlations(normalised, seen, range(1, 1 + min(DRAWN_LAGS, max(lengths) - 1)))
    second, ax = plot.figure(size=(PHONE, 2.8))
    plot.correlation(values, int(np.sum(seen)), ax=ax)
    return [
        Figure(plot.image(figure), "Residuals against time", "Residuals over their standard deviations."),
        Figure(plot.image(second), "Correlation of the residuals", "A right model under a right noise law stays in "
               "the band; a wave or a slow fall is something that the model has not."),
    ]  # fmt: skip


PREDICT = (
    "Predict a run that this fit has not seen (`jaxident predict`); `jaxident diagnose` tells what the model lacks."
)
WORDS = ("dead zone", "determined", "interval", "prior", "residual", "root mean square", "slip", "white")
COLUMNS = ("parameter", "what it is", "estimate", "95 % interval", "this input")
ABOUT_INTERVALS = (
    "Intervals hold under the noise law whose numbers stand at the end. Determined: the half-width is below a tenth of "
    "the parameter (for a dead zone, of the largest command); weak: below a half. From the prior: more than half of "
    "the variance is that of robots in general; the log hardly tells the number, and the interval is not the log's."
)
ABOUT_PERCENT = (
    "100 (1 - residual / motion about the run's mean), both root mean square. Residuals are those of the whole run "
    "from one start state; under a noise law with slip or a memory, those of the next pose."
)
ABOUT_TESTS = (
    "Tests of the poses' own residuals. Increments of poses would not do: differencing makes neighbours of even white "
    "camera error correlate by -1/2. Each limit is passed by about one in a hundred right fits or fewer."
)
