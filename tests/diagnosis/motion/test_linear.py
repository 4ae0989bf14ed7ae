"""Gram matrices, greedy terms and answers in closed form against plain least squares and differences."""

import numpy as np
import pytest
from support.small_robot import VECTOR, windows_of

from jaxident.diagnosis.causes.discrepancy_basis import pursue
from jaxident.diagnosis.motion.linear import follow, gram, left_over, linearise
from jaxident.diagnosis.motion.responses import answer_to_start
from jaxident.effects.coordinates import PLACES


def squares(columns, target):
    """Half the squares that least squares leaves."""
    rest = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return 0.5 * float(rest @ rest)


def test_what_is_left_over_is_that_of_least_squares_with_starts_free():
    rng = np.random.default_rng(0)
    windows, numbers = 4, 30
    columns, starts = rng.normal(size=(windows, numbers, 5)), rng.normal(size=(windows, numbers, 5))
    white = rng.normal(size=(windows, numbers, numbers)) + 5.0 * np.eye(numbers)
    products = gram(white, columns, starts).products.sum(axis=0)
    own = np.zeros((windows * numbers, windows * 5))
    for k in range(windows):
        own[k * numbers : (k + 1) * numbers, 5 * k : 5 * k + 5] = white[k] @ starts[k]
    flat = (white @ columns).reshape(-1, 5)
    with_one = squares(np.hstack([own, flat[:, [0]]]), flat[:, 4])
    with_three = squares(np.hstack([own, flat[:, [0, 1, 2]]]), flat[:, 4])
    assert left_over(products, [0]) - left_over(products, [0, 1, 2]) == pytest.approx(with_one - with_three, rel=1e-6)


def test_pursuit_finds_what_was_put_in_and_stops():
    rng = np.random.default_rng(1)
    table = rng.normal(size=(2000, 42))
    target = 0.5 * table[:, 0] + 0.4 * table[:, 7] - 0.2 * table[:, 20] + rng.normal(size=2000)
    whole = np.column_stack([table, target])
    chosen = pursue(whole.T @ whole, [0, 1], list(range(2, 42)), np.zeros(40))
    assert [place for place, _ in chosen] == [7, 20]
    rest = squares(table[:, [0, 1]], target) - squares(table[:, [0, 1, 7]], target)
    assert chosen[0][1] == pytest.approx(rest, rel=1e-6)
    dear = np.where(np.arange(2, 42) == 20, 1e3, 0.0)
    assert [place for place, _ in pursue(whole.T @ whole, [0, 1], list(range(2, 42)), dear)] == [7]


STARTS = np.tile([[0.3], [-0.2], [0.5], [0.2], [1.0]], 24)


@pytest.fixture
def windows():
    """Windows of the small robot's commands, no pose of which is anywhere but at the origin."""
    found = windows_of(VECTOR)
    return found._replace(pose=np.zeros_like(found.pose))


def by_starts(vector, windows):
    """Residuals, and derivatives by the start states as plain differences."""
    lanes = STARTS + 1e-6 * np.concatenate([np.zeros((1, 5)), np.eye(5)])[:, :, None]
    found = follow(np.tile(vector, (6, 1)), lanes, windows)
    return found[0], np.moveaxis((found[:1] - found[1:]) / 1e-6, 0, -1)


def test_start_speeds_answer_as_a_robot_does_that_loses_speed_in_turns(windows):
    vector = VECTOR.copy()
    vector[PLACES["turn_loss", "loss"]] = 8.0
    residual, wanted = by_starts(vector, windows)
    own = linearise(vector, STARTS, windows, [0]).starts
    nominal = answer_to_start(np.exp(vector[:2]), residual, windows)
    size = np.abs(wanted[..., 3:]).max()
    np.testing.assert_allclose(own[..., 3:], wanted[..., 3:], atol=1e-3 * size)
    assert np.abs(nominal - wanted).max() > 0.2 * size


def test_start_states_answer_as_differences_do(windows):
    residual, wanted = by_starts(VECTOR, windows)
    own = answer_to_start(np.exp(VECTOR[:2]), residual, windows)
    # headings between rows are taken as straight: a few parts in a thousand
    np.testing.assert_allclose(own, wanted, atol=5e-3 * np.abs(wanted).max())
