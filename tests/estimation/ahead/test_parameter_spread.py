"""Robots as likely as a covariance says: their directions add up to it, and predictions spread as the robots do."""

import dataclasses

import numpy as np
import pytest

import jaxident as ji
from jaxident.effects.law_kinds import value_name
from jaxident.estimation.ahead.parameter_spread import MIXED, directions, opposite, parameter_values, with_values
from jaxident.estimation.ahead.run_ahead import _slope, run_ahead
from jaxident.estimation.ahead.stretches import every
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Effect, Model
from jaxident.robot.noise import Noise

STEP, ROWS = 1.0 / 30.0, 300
SPEEDS = np.linspace(-0.5, 0.5, 5)
LAW = Discovered("acceleration along", "1", "v", SPEEDS, -0.4 * SPEEDS * np.abs(SPEEDS))
DRIVE = Physical(np.array([3.0, 5.0]), np.array([[0.8, 0.78], [9.0, -9.2]]), np.zeros(2))


def uncertain() -> Model:
    """A robot with an effect and a discovered law: rates, the effect's size and the law's values are known together."""
    order = ("rate_1", "motor_lag.time_constant", *(value_name(0, knot) for knot in range(5)))
    root = np.random.default_rng(0).normal(size=(len(order), len(order)))
    size = np.array([0.05, 0.002, *[0.05] * 5])
    covariance = root @ root.T / len(order) * size * size[:, None]
    return Model(STEP, DRIVE, np.array([0.08, 0.1]), Noise(3e-4, 2e-3), (Effect("motor_lag", {"time_constant": 0.05}),),
                 covariance=covariance, parameter_order=order, discovered=(LAW,))  # fmt: skip


def numbers(model: Model) -> np.ndarray:
    values = parameter_values(model)
    return np.array([values[name] for name in uncertain().parameter_order])


def test_directions_add_up_to_the_covariance():
    model = uncertain()
    own = [(other, size) for other, size in directions(model) if len(other.discovered[0].at) == len(SPEEDS)]
    moved = np.array([(numbers(other) - numbers(model)) / size for other, size in own])
    scale = np.sqrt(np.diagonal(model.covariance))
    np.testing.assert_allclose(moved.T @ moved / scale / scale[:, None], model.covariance / scale / scale[:, None],
                               atol=1e-6)  # fmt: skip


def test_many_directions_are_mixed_into_a_few_that_spread_as_much():
    """A surface has 64 values. A sum of squares over MIXED mixtures is off by a share of sqrt(2 / MIXED), one standard
    deviation; so is that of what any linear prediction makes of them."""
    knots, rng = np.linspace(-1.0, 1.0, 8), np.random.default_rng(5)
    surface = Discovered("acceleration along", "v", "x", knots, rng.normal(size=(8, 8)), None, "y", knots)
    order = tuple(value_name(0, knot) for knot in range(64))
    root = rng.normal(size=(64, 64)) * rng.uniform(0.1, 1.0, 64)
    model = dataclasses.replace(uncertain(), discovered=(surface,), effects=(), covariance=root @ root.T,
                                parameter_order=order)  # fmt: skip
    here = np.ravel(surface.value)
    own = [(other.discovered[0], size) for other, size in directions(model) if other.discovered[0].value.size == 64]
    moved = np.array([(np.ravel(law.value) - here) / size for law, size in own])
    assert len(moved) == MIXED
    looks = rng.normal(size=(64, 200))
    ratio = np.sum((moved @ looks) ** 2, axis=0) / np.sum(looks * (model.covariance @ looks), axis=0)
    assert abs(ratio.mean() - 1.0) < 0.1
    assert ratio.std() < np.sqrt(2.0 / MIXED)


def test_a_law_may_go_on_beyond_its_knots_as_steep_as_it_is_inside():
    """Robots that are moved so differ from the law's beyond the knots alone."""
    model = dataclasses.replace(uncertain(), covariance=np.eye(1), parameter_order=("rate_1",))
    beyond = [(other.discovered[0], size) for other, size in directions(model)[1:]]
    assert len(beyond) == 2
    steep = np.sqrt(np.mean(np.diff(LAW.value) ** 2)) / np.diff(SPEEDS)[0]
    places = np.linspace(-1.5, 1.5, 31)
    inside = np.abs(places) <= 0.5
    moved = [np.interp(places, law.at, law.value) - np.interp(places, SPEEDS, LAW.value) for law, _ in beyond]
    sizes = np.array([change / size for change, (_, size) in zip(moved, beyond, strict=True)])
    np.testing.assert_array_equal(sizes[:, inside], 0.0)
    expected = steep * np.clip(np.abs(places) - 0.5, 0.0, 0.5)
    np.testing.assert_allclose(sizes.max(axis=0), expected, atol=1e-9)


def test_a_surface_may_go_on_beyond_each_of_its_sides():
    knots = np.linspace(-1.0, 1.0, 4)
    surface = Discovered("acceleration along", "v", "x", knots, np.outer(knots, np.ones(4)), None, "y", knots)
    model = dataclasses.replace(uncertain(), covariance=np.eye(1), parameter_order=("rate_1",), discovered=(surface,))
    shapes = [other.discovered[0].value.shape for other, _ in directions(model)[1:]]
    assert shapes == [(5, 4)] * 2 + [(4, 5)] * 2
    rises = [np.ptp(other.discovered[0].value) - 2.0 for other, _ in directions(model)[1:]]
    np.testing.assert_allclose(rises[:2], [1e-4, 0.0], atol=1e-9)  # a slope of 1 over half of 2 m; below it is less


def test_values_that_are_set_are_there():
    changed = with_values(uncertain(), {value_name(0, 3): 0.7, "rate_1": 2.0})
    assert changed.discovered[0].value[3] == 0.7
    assert changed.physical.rate[0] == 2.0
    np.testing.assert_array_equal(np.delete(changed.discovered[0].value, 3), np.delete(LAW.value, 3))


@pytest.mark.slow
def test_predictions_spread_as_robots_do():
    """Against 300 robots drawn from the covariance: a standard deviation has a standard error of 4 %."""
    model, rng = uncertain(), np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1.0, 1.0, (ROWS // 15, 2)), 15, axis=0)
    log = ji.simulate(model, ji.make_log(STEP * np.arange(ROWS), *u.T))
    log = type(log)(*map(np.asarray, log))
    starts = every(log, 20, 60)
    starts = type(starts)(*(column[starts.row + 30 < ROWS] for column in starts))

    def ends(robot: Model) -> np.ndarray:
        return run_ahead(robot, log, starts, 30, burn_in=20, session_time=0.0).pose[:, -1]

    bare = dataclasses.replace(model, covariance=None, parameter_order=())
    draws = rng.multivariate_normal(numbers(model), model.covariance, 300)
    found = np.array([ends(with_values(bare, dict(zip(model.parameter_order, each, strict=True)))) for each in draws])
    told = run_ahead(model, log, starts, 30, burn_in=20, session_time=0.0).parameters[:, :, -1]
    np.testing.assert_allclose(np.sqrt(np.sum(told**2, axis=0)), found.std(axis=0), rtol=0.2)
    bare = dataclasses.replace(model, covariance=model.covariance[:2, :2], parameter_order=model.parameter_order[:2])
    without = run_ahead(bare, log, starts, 30, burn_in=20, session_time=0.0).parameters[:, :, -1]
    assert np.sum(without[..., :2] ** 2) < 0.5 * np.sum(told[..., :2] ** 2)  # else the law's values would not be seen


def test_a_parameter_at_its_bound_is_moved_by_a_fair_step():
    """One of 0 has no size of its own: the step is that of a clear case, far above what differences are good to."""
    law = Effect("quadratic_drag", {"along": 0.0, "heading": 0.5})
    model = dataclasses.replace(uncertain(), discovered=(), effects=(law,), covariance=np.diag([0.05, 0.3]) ** 2,
                                parameter_order=("rate_1", "quadratic_drag.along"))  # fmt: skip
    assert min(size for _, size in directions(model)) > 1e-5
    log = ji.simulate(dataclasses.replace(model, noise=None), ji.make_log(STEP * np.arange(90), *np.ones((2, 90))))
    log = type(log)(*map(np.asarray, log))
    starts = type(every(log, 20, 60))(np.zeros(1, int), np.array([20]))
    told = run_ahead(model, log, starts, 30, burn_in=20, session_time=0.0).parameters[:, 0, -1]
    values = {"rate_1": 0.05, "quadratic_drag.along": 0.3}
    bare = dataclasses.replace(model, covariance=None, parameter_order=())
    here = run_ahead(bare, log, starts, 30, burn_in=20, session_time=0.0).pose[0, -1]
    for name, deviation in values.items():
        other = with_values(bare, {name: parameter_values(model)[name] + 0.1 * deviation})
        moved = 10.0 * (run_ahead(other, log, starts, 30, burn_in=20, session_time=0.0).pose[0, -1] - here)
        assert np.min(np.linalg.norm(np.abs(told) - np.abs(moved), axis=1)) < 0.15 * np.linalg.norm(moved)


def test_a_shape_that_hardly_shapes_is_moved_by_a_fair_step():
    """The growth of a drift is 0 in a clear case: its step is that of the largest on real robots."""
    law = Effect("gain_drift", {"rate": 0.001, "growth": 2e-6})
    model = dataclasses.replace(uncertain(), discovered=(), effects=(law,), covariance=np.diag([0.05, 5e-4]) ** 2,
                                parameter_order=("rate_1", "gain_drift.growth"))  # fmt: skip
    np.testing.assert_allclose([size for _, size in directions(model)], 1e-4)


def test_a_jump_of_a_start_is_no_slope():
    """Beyond the model's rate the poses of one start are another path's; on the near side they go on as all others."""
    model, size = dataclasses.replace(uncertain(), discovered=()), 1e-4
    other = with_values(model, {"rate_1": 3.0 + 0.05 * size})
    slope = np.random.default_rng(0).uniform(0.5, 1.5, (20, 4, 3))

    def there(robot):
        moved = float(robot.dynamics.rate[0]) - 3.0
        jump = np.zeros(slope.shape)
        jump[7] = 0.1 * (moved > 0.0)
        return moved / 0.05 * slope + jump

    np.testing.assert_allclose(_slope(there, there(model), model, other, size), slope, rtol=1e-6)
    beyond = directions(dataclasses.replace(uncertain(), covariance=np.eye(7)))[-1][0]
    assert opposite(uncertain(), beyond) is None


def test_parameters_of_nothing_are_moved_by_a_part_of_their_deviation():
    """Steps of 1e-10 in dead zones of 0 drowned in rounding: predicted deviations were 7e7 m."""
    order, deviation = ("rate_1", "dead_zone_r", "dead_zone_l"), np.array([0.3, 0.5, 0.4])
    model = dataclasses.replace(uncertain(), dead_zone=np.zeros(2), effects=(), discovered=(), parameter_order=order,
                                covariance=np.diag(deviation**2))  # fmt: skip
    moved = [max(other.dead_zone) for other, _ in directions(model) if np.any(other.dead_zone != 0.0)]
    np.testing.assert_allclose(sorted(moved), 1e-4 * np.sort(deviation[1:]))
