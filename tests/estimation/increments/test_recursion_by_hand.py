"""The recursion against three samples worked by hand, and against the textbook loop in NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.recursion import DEAD_ZONE, record, started

from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.least_squares import LOWER, Equation, full_covariance, update


def test_three_samples_by_hand():
    """Two unknowns from 0 with unit covariance; rows (1, 2), (0, 1), (1, 0); targets 3, 1, 1.

    1: P row = (1, 2), 1 + row' P row = 6, error 3: unknowns (1/2, 1), P = [[5/6, -1/3], [-1/3, 1/3]].
    2: P row = (-1/3, 1/3), 4/3, error 0: unknowns stay, P = [[3/4, -1/4], [-1/4, 1/4]].
    3: P row = (3/4, -1/4), 7/4, error 1/2: unknowns (5/7, 13/14), P = [[3/7, -1/7], [-1/7, 3/14]].
    """
    rest = (0.0,) * 5
    equation = Equation((0.0, 0.0, *rest), tuple(float(i == j) for i, j in LOWER), (np.inf,) * 7)
    scales, errors = [], []
    for row, target in (((1.0, 2.0), 3.0), ((0.0, 1.0), 1.0), ((1.0, 0.0), 1.0)):
        equation, error, scale = update(equation, (*row, *rest), target, 1.0)
        scales.append(float(scale))
        errors.append(float(error))
    np.testing.assert_allclose(scales, [6.0, 4 / 3, 7 / 4])
    np.testing.assert_allclose(errors, [3.0, 0.0, 0.5], atol=1e-15)
    np.testing.assert_allclose(equation.unknowns[:2], [5 / 7, 13 / 14])
    np.testing.assert_allclose(full_covariance(equation)[:2, :2], [[3 / 7, -1 / 7], [-1 / 7, 3 / 14]])


def regressor(last, u, before, width):
    """(15)-(18) for both wheels, plainly."""
    row = [last]
    for k in range(2):
        outside = abs(u[k]) > width[k]
        passed = np.sign(before[k]) * max(abs(before[k]) - width[k], 0.0)
        row += [u[k] if outside else 0.0, -np.sign(u[k]) if outside else 0.0, passed]
    return np.array(row)


@pytest.mark.parametrize("forgetting", [1.0, 0.995])
def test_scan_is_the_textbook_loop(forgetting):
    estimate, late = started(record(400, noise=1e-5), 150, forgetting=forgetting)
    last, _ = jax.jit(recursive.run)(estimate, late)
    equations = [estimate.length, estimate.turn]
    unknowns = [np.array(e.unknowns) for e in equations]
    covariance = [np.array(full_covariance(e)) for e in equations]
    width, past = np.array(DEAD_ZONE), [float(p) for p in estimate.memory.past]
    for k in range(len(late.seen)):
        u, before = ([float(w[k]) for w in pair] for pair in (late.command, late.command_before))
        measured = [float(c[k]) for c in late.increment]
        for e in range(2):
            row = regressor(past[e], u, before, width)
            gain = covariance[e] @ row / (forgetting + row @ covariance[e] @ row)
            unknowns[e] = unknowns[e] + gain * (measured[e] - row @ unknowns[e])
            covariance[e] = (covariance[e] - np.outer(gain, row @ covariance[e])) / forgetting
        past = measured
        for wheel, slope in ((0, 1), (1, 4)):
            width[wheel] = np.mean([np.clip(theta[slope + 1] / theta[slope], 0.0, 0.9) for theta in unknowns])
    for found, theta, matrix in zip((last.length, last.turn), unknowns, covariance, strict=True):
        np.testing.assert_allclose(jnp.stack(found.unknowns), theta, rtol=1e-6)
        np.testing.assert_allclose(full_covariance(found), matrix, rtol=1e-5, atol=1e-8 * np.max(np.abs(matrix)))
    np.testing.assert_allclose(np.array(last.dead_zone), width, rtol=1e-7)
