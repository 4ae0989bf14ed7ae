"""The likelihood that decides under which noise terms count, against dense linear algebra; what is left of a fit."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.arcs import along_arcs
from support.small_robot import LAW, VECTOR, nominal_fit, windows_of

from jaxident.diagnosis.causes import unexplained
from jaxident.diagnosis.causes.corrector import Term, library
from jaxident.diagnosis.causes.refit import Data
from jaxident.diagnosis.motion.linear import Linear
from jaxident.diagnosis.motion.responses import answer_to_start, respond
from jaxident.diagnosis.noise.law import Law, covariance, first_law, whitener_of

ROWS, COUNT = 12, 5
RATES = np.array([4.0, 5.0])
LAWS = Law(5e-4, 4e-3), Law(4e-4, 3e-3, slip=(0.05, 0.4), slip_time=0.2)


@pytest.fixture(scope="module")
def made():
    """A solution with two coordinates on made-up windows, one column of a term that explains nothing, and responses."""
    rng, windows = np.random.default_rng(3), along_arcs(ROWS, COUNT)
    residual, slopes, idle = (1e-3 * rng.normal(size=(COUNT, 3 * ROWS, k)) for k in (1, 2, 1))
    linear = Linear(residual[..., 0], slopes, answer_to_start(RATES, residual[..., 0], windows))
    responses = respond(RATES, residual[..., 0], windows)
    return SimpleNamespace(linear=linear, places=[0, 1]), Data(windows, None), 1e-6 * idle, responses


def dense(law, solution, data, responses):
    """Restricted log-likelihood up to a constant: start states free in every window, coordinates in all."""
    linear, total = solution.linear, covariance(law, data.windows, responses)
    volume, squares = 0.0, np.zeros((3, 3))
    for k in range(COUNT):
        inverse, starts = np.linalg.inv(total[k]), linear.starts[k]
        information = starts.T @ inverse @ starts
        inverse = inverse - inverse @ starts @ np.linalg.solve(information, starts.T @ inverse)
        columns = np.column_stack([linear.slopes[k], linear.residual[k]])
        squares += columns.T @ inverse @ columns
        volume += np.linalg.slogdet(total[k])[1] + np.linalg.slogdet(information)[1]
    rest = squares[2, 2] - squares[2, :2] @ np.linalg.solve(squares[:2, :2], squares[:2, 2])
    return -0.5 * (volume + rest)


def test_laws_are_compared_by_their_restricted_likelihood(made):
    solution, data, idle, responses = made

    def likelihood(law):
        choice = unexplained._choose(
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
    quiet = unexplained.unexplained(data, fit, responses, law, True)
    assert quiet.terms == []
    assert (quiet.gain, quiet.largest) == (0.0, 0.0)
    assert quiet.answers.shape[2] == 0
    corrector = library(fit.linear.residual, data.windows, responses)
    place = next(k for k, term in enumerate(corrector.terms) if term.name.endswith("in the speed sideways"))
    column = corrector.columns[..., place]
    size = 30.0 * LAW.position / np.std(column[:, 0::3])
    bent = fit._replace(linear=fit.linear._replace(residual=fit.linear.residual + size * column))
    found = unexplained.unexplained(data, bent, responses, law, True)
    names = [term.name for term, _ in found.terms]
    assert corrector.terms[place].name in names
    assert found.gain == sum(gain for _, gain in found.terms)
    assert found.largest == max(gain for _, gain in found.terms) > 100.0
    assert found.answers.shape == (*bent.linear.residual.shape, len(names))
    assert found.law.position < 2.0 * LAW.position, "the law takes none of it for noise"
