"""The likelihood that decides under which noise terms count, against dense linear algebra; what is left of a fit."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.arcs import along_arcs
from support.small_robot import LAW, VECTOR, nominal_fit, windows_of

from jaxident.diagnosis.causes import discrepancy
from jaxident.diagnosis.causes.discrepancy_basis import Term, library, pursue
from jaxident.diagnosis.fit.prior import departures
from jaxident.diagnosis.fit.refit import Data
from jaxident.diagnosis.motion.linear import Linear
from jaxident.diagnosis.motion.responses import answer_to_start, respond
from jaxident.diagnosis.noise.law import Law, covariance, first_law, whitener_of
from jaxident.effects.coordinates import NOMINAL

ROWS, COUNT = 12, 5
NOMINAL_COUNT = len(NOMINAL)
RATES = np.array([4.0, 5.0])
LAWS = Law(5e-4, 4e-3), Law(4e-4, 3e-3, slip=(0.05, 0.4), slip_time=0.2)


@pytest.fixture(scope="module")
def made():
    """A solution with ten coordinates on made-up windows, one column of a term that explains nothing, and responses."""
    rng, windows = np.random.default_rng(3), along_arcs(ROWS, COUNT)
    residual, slopes, idle = (1e-3 * rng.normal(size=(COUNT, 3 * ROWS, k)) for k in (1, NOMINAL_COUNT, 1))
    linear = Linear(residual[..., 0], slopes, answer_to_start(RATES, residual[..., 0], windows))
    responses = respond(RATES, residual[..., 0], windows)
    return (
        SimpleNamespace(linear=linear, places=list(range(NOMINAL_COUNT)), vector=VECTOR),
        Data(windows, None),
        1e-6 * idle,
        responses,
    )


def dense(law, solution, data, responses):
    """Restricted log-likelihood up to a constant: start states free in every window, coordinates under their prior."""
    linear, total = solution.linear, covariance(law, data.windows, responses)
    away, slopes = departures(VECTOR, data.windows)
    prior = np.column_stack([slopes, -away])
    volume, squares = 0.0, prior.T @ prior
    for k in range(COUNT):
        inverse, starts = np.linalg.inv(total[k]), linear.starts[k]
        information = starts.T @ inverse @ starts
        inverse = inverse - inverse @ starts @ np.linalg.solve(information, starts.T @ inverse)
        columns = np.column_stack([linear.slopes[k], linear.residual[k]])
        squares += columns.T @ inverse @ columns
        volume += np.linalg.slogdet(total[k])[1] + np.linalg.slogdet(information)[1]
    rest = squares[-1, -1] - squares[-1, :-1] @ np.linalg.solve(squares[:-1, :-1], squares[:-1, -1])
    return -0.5 * (volume + rest)


def test_laws_are_compared_by_their_restricted_likelihood(made):
    solution, data, idle, responses = made

    def likelihood(law):
        choice = discrepancy._choose(
            data, whitener_of(law, data.windows, responses), solution, [Term("drive", "idle", 1e9)], idle
        )
        assert choice.found == []
        return choice.log_likelihood

    wanted = [dense(law, solution, data, responses) for law in LAWS]
    found = [likelihood(law) for law in LAWS]
    assert abs(wanted[0] - wanted[1]) > 1.0
    assert found[0] - found[1] == pytest.approx(wanted[0] - wanted[1], abs=1e-3)


def test_what_is_left_is_told_with_its_answers_and_the_law_beside_it():
    """A term of the library hidden in the residuals of a fit: that is what is found, with all that it brings."""
    data, fit = nominal_fit(windows_of(VECTOR))
    responses = respond(np.exp(fit.vector[:2]), fit.linear.residual, data.windows)
    law = first_law(data.windows)
    quiet = discrepancy.unexplained(data, fit, responses, law, True)
    assert quiet.terms == []
    assert (quiet.gain, quiet.largest) == (0.0, 0.0)
    assert quiet.answers.shape[2] == 0
    corrector = library(fit.linear.residual, data.windows, responses)
    place = next(k for k, term in enumerate(corrector.terms) if term.name.endswith("in the speed sideways"))
    column = corrector.columns[..., place]
    size = 30.0 * LAW.position / np.std(column[:, 0::3])
    bent = fit._replace(linear=fit.linear._replace(residual=fit.linear.residual + size * column))
    found = discrepancy.unexplained(data, bent, responses, law, True)
    names = [term.name for term, _ in found.terms]
    assert corrector.terms[place].name in names
    assert found.gain == sum(gain for _, gain in found.terms)
    assert found.largest == max(gain for _, gain in found.terms) > 100.0
    assert found.answers.shape == (*bent.linear.residual.shape, len(names))
    assert found.law.position < 2.0 * LAW.position, "the law takes none of it for noise"


def by_window(columns, residual):
    """Products of columns (windows, numbers, n) and a residual, per window and with the prior's, which is none."""
    whole = np.concatenate([columns, residual[..., None]], axis=2)
    products = np.einsum("wki,wkj->wij", whole, whole)
    return products, products.sum(axis=0)


@pytest.mark.parametrize("everywhere", [True, False])
def test_a_term_that_one_window_alone_pays_for_is_not_told(everywhere):
    """Twelve deviations of a term in all windows, or all of it in one: the model taken for true both bring about 70."""
    rng = np.random.default_rng(5)
    columns = rng.normal(size=(60, 15, 12)) / 30.0  # ten nominal coordinates and two terms, each of length 1
    residual = rng.normal(size=(60, 15))
    if everywhere:
        residual += 12.0 * columns[..., 11]
    else:
        residual[7] += 12.0 * columns[7, :, 11] / np.sum(columns[7, :, 11] ** 2)
    columns[..., 3] = 0.0  # a dead zone that no command is near
    windows, products = by_window(columns, residual)
    found = pursue(products, list(range(10)), [10, 11], np.zeros(2))
    assert [place for place, _ in found] == [11]
    assert found[0][1] > 40.0
    kept = discrepancy.agreed(windows, products, list(range(10)), found)
    assert [place for place, _ in kept] == ([11] if everywhere else [])
    assert all(0.6 * found[0][1] < gain <= found[0][1] for _, gain in kept)
