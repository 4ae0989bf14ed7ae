"""Robots, cameras and units at random and beyond all reason: numbers that are finite or a line that says why not.

And no number is called known that is another one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.stressed import ROWS, Stress, random_robot, random_stress, stressed

import jaxident as ji
from jaxident.errors import InputError, WorkError
from jaxident.estimation.identify import identify
from jaxident.estimation.increments import recursive
from jaxident.estimation.online import joint_filter
from jaxident.estimation.predict import predict
from jaxident.estimation.uncertainty.more_noise import camera_error, moves
from jaxident.estimation.uncertainty.verdict import verdicts
from jaxident.numerics import float64_switch

QUICK = ("key-term-least-squares", "paper", "instrumental-variables")
MANY, FEW = 100, 6
FALSE_SHARE = 0.02
"""Share of numbers called determined that may be more than SIX of their deviations and a hundredth off."""
SIX = 6.0


def cases(count: int):
    """Robots, their stress and their logs."""
    for seed in range(count):
        random = np.random.default_rng(seed)
        stress = random_stress(random)
        robot = random_robot(random, stress.period)
        yield robot, stress, stressed(robot, stress, seed)


def truth(robot, stress: Stress, physical: bool) -> dict[str, float]:
    """The numbers behind a log in the log's own units."""
    u, p = stress.command_scale, stress.pose_scale
    zones = {"dead_zone_r": robot.dead_zone[0] * u, "dead_zone_l": robot.dead_zone[1] * u}
    if not physical:
        return zones | {f"alpha_{k + 1}": float(robot.difference.alpha[k]) for k in range(2)}
    rate, gain = robot.physical.rate, robot.physical.gain
    gains = {f"gain_{k + 1}{j + 1}": gain[k, j] * (p if k == 0 else 1.0) / u for k in range(2) for j in range(2)}
    return zones | gains | {f"rate_{k + 1}": rate[k] for k in range(2)}


def false_words(found, robot, stress: Stress, largest: float) -> tuple[int, int]:
    """How many numbers are called determined, and how many of these are far from the truth."""
    true = truth(robot, stress, found.model.physical is not None)
    known = [row for row in verdicts(found.model, largest) if row.verdict == "determined" and row.parameter in true]
    far = 0
    for row in known:
        size = largest if row.parameter.startswith("dead_zone") else abs(true[row.parameter])
        room = SIX * (row.high - row.low) / 3.92 + 1e-2 * size
        far += abs(row.estimate - true[row.parameter]) > room
    return len(known), far


def finite(*trees) -> bool:
    return all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(trees))


def judged(method: str, count: int) -> tuple[int, int, int]:
    """Fits that ended well, numbers called determined, and those that are wrong; every fit is finite or refused."""
    settings = {"noise_law": "white"} if method == "maximum-likelihood" else {}
    good = known = wrong = 0
    for robot, stress, log in cases(count):
        try:
            found = identify(log, method, **settings)
        except (InputError, WorkError):
            continue
        assert finite(found.model.dynamics, found.model.dead_zone, found.covariance), stress
        assert np.all(np.diagonal(found.covariance) >= 0.0), stress
        told = any("coloured" in line for line in found.suspicions)
        if not bool(found.ok) or told:
            continue
        counts = false_words(found, robot, stress, float(np.nanmax(np.abs(np.stack(log.command)))))
        good, known, wrong = good + 1, known + counts[0], wrong + counts[1]
    return good, known, wrong


@pytest.mark.slow
@pytest.mark.parametrize("method", [*QUICK, "maximum-likelihood"])
def test_identify_under_stress(method):
    good, known, wrong = judged(method, MANY if method in QUICK else 60)
    assert good >= 0.2 * MANY
    assert known >= 2 * good
    assert wrong <= FALSE_SHARE * known + 1


def test_identify_under_some_stress():
    good, known, wrong = judged(QUICK[0], FEW)
    assert good >= 2
    assert known >= 2 * good
    assert wrong == 0


def recursed(stress: Stress, log) -> None:
    """From a sound start through a stressed log: the state stays finite."""
    step = jax.jit(recursive.step)
    largest = float(np.nanmax(np.abs(np.stack(log.command))))
    state = recursive.init(log[:80], d_max=0.9 * largest)
    if not finite(state):
        return  # a setup log that determines nothing: told by numbers that are none
    for row in range(80, ROWS):
        state, info = step(state, recursive.Sample(log.u_r[row], log.u_l[row], log.x[row], log.y[row], log.theta[row]))
        assert finite(state, info.error, info.scale), (stress, row)


def test_a_recursion_from_a_setup_that_tells_little():
    """Noise of 12 m leaves the first covariance so ill-conditioned that a general inverse of it has negative variances:
    the recursion ran away to infinity within 60 rows."""
    *_, (_, stress, log) = cases(8)
    recursed(stress, log)


@pytest.mark.slow
def test_a_recursion_under_stress():
    for _, stress, log in cases(40):
        recursed(stress, log)


@pytest.mark.slow
def test_a_joint_filter_under_stress():
    """Every estimate is finite, within its bounds, with a covariance that is one; what is lost is not ok."""
    step = jax.jit(joint_filter.step)
    for _, stress, log in cases(8):
        largest = 0.9 * float(np.nanmax(np.abs(np.stack(log.command))))
        state = joint_filter.init(log[:80], d_max=largest)
        for row in range(80, ROWS):
            state, info = step(state, joint_filter.Sample(*(float(column[row]) for column in tuple(log)[:6])))
            if not bool(info.ok):
                continue
            values, covariance = joint_filter.estimate(state)
            assert finite(values, covariance), (stress, row)
            assert np.all(np.diagonal(covariance) >= 0.0), (stress, row)
            assert 0.0 <= min(values[6:]) <= max(values[6:]) <= largest * (1.0 + 1e-12)


@pytest.mark.slow
def test_predictions_under_stress():
    """Of the true robot in the log's own units: each row is finite, or counted as failed."""
    for robot, stress, log in cases(8):
        gain = robot.physical.gain * np.array([[stress.pose_scale], [1.0]]) / stress.command_scale
        drive, zones = robot.physical._replace(gain=gain), robot.dead_zone * stress.command_scale
        model = ji.Model(stress.period, drive, zones)
        try:
            found = predict(model, log, 5)
        except InputError:
            continue
        rows = np.stack([found.x, found.y, found.theta, found.sd_x, found.sd_y, found.sd_theta])
        failed = ji.estimation.predict.prediction_error(found, log)["failed"] if not finite(rows) else 0
        assert finite(rows) or failed, stress


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_a_robot_in_slow_motion(factor):
    """Time stretched by a power of two, all else equal: the same difference equations to the last digits."""
    robot = random_robot(np.random.default_rng(3), 1.0 / 32.0)
    log = stressed(robot, Stress(period=1.0 / 32.0, noise=1e-6), 3)
    plain, other = (identify(one, QUICK[0]).model for one in (log, log._replace(t=factor * np.asarray(log.t))))
    assert other.sample_period == pytest.approx(factor * plain.sample_period, rel=1e-12)
    for one, two in zip(jax.tree.leaves(plain.difference), jax.tree.leaves(other.difference), strict=True):
        np.testing.assert_allclose(two, one, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_the_rates_of_a_robot_in_slow_motion(factor):
    """By maximum likelihood, whose priors are in seconds: rates fall by the factor, gains by its square."""
    robot = random_robot(np.random.default_rng(3), 1.0 / 32.0)
    log = stressed(robot, Stress(period=1.0 / 32.0, noise=1e-6), 3)
    plain = identify(log, noise_law="white").model
    other = identify(log._replace(t=factor * np.asarray(log.t)), noise_law="white").model
    np.testing.assert_allclose(factor * np.asarray(other.physical.rate), plain.physical.rate, rtol=2e-3)
    np.testing.assert_allclose(factor**2 * np.asarray(other.physical.gain), plain.physical.gain, rtol=2e-3)


def test_headings_at_random_are_refused():
    robot = random_robot(np.random.default_rng(0), 1.0 / 30.0)
    for method in (*QUICK, "maximum-likelihood"):
        with pytest.raises(InputError, match="headings at random"):
            identify(stressed(robot, Stress(noise=1.0), 0), method)


def test_as_much_noise_again_widens_what_it_moves():
    """Of two numbers, one the mean of the poses' squares, which noise moves, one their mean, which it does not."""
    log = stressed(random_robot(np.random.default_rng(0), 0.1), Stress(), 0)
    estimate = np.array([np.mean(log.x**2), np.mean(log.x)])
    moved = moves(lambda one: np.array([np.mean(one.x**2), np.mean(one.x)]), log, estimate, np.full(2, 0.5), (2.0, 0.1))
    assert moved[0] == pytest.approx(4.0, rel=0.3)
    assert moved[1] == 0.0


def test_the_camera_error_behind_residuals():
    random = np.random.default_rng(0)
    error, alpha = random.normal(size=(2, 20_000)) * [[1e-3], [1e-2]], np.array([0.9, 0.5])
    a = alpha[:, None]
    left = error[:, 2:] - (1.0 + a) * error[:, 1:-1] + a * error[:, :-2]
    np.testing.assert_allclose(camera_error(ji.array_types.Increment(*left), alpha), [1e-3, 1e-2], rtol=0.03)


def test_without_double_precision_everything_refuses():
    robot = random_robot(np.random.default_rng(0), 0.1)
    log = stressed(robot, Stress(), 0)
    with float64_switch(False):
        for call in (
            lambda: identify(log, "paper"),
            lambda: predict(robot, log, 5),
            lambda: recursive.init(log, d_max=0.9),
            lambda: joint_filter.init(log, d_max=0.9),
        ):
            with pytest.raises((InputError, RuntimeError), match="double precision"):
                call()
    assert jnp.zeros(1).dtype == jnp.float64
