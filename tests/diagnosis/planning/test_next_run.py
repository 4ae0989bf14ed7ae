"""The planned input: within its limit, repeatable, judged as a plain least-squares fit judges it."""

import dataclasses

import jax
import numpy as np
import pytest

from jaxident.array_types import AT_REST
from jaxident.diagnosis.fit.nominal import first_starts
from jaxident.diagnosis.fit.refit import Data, refit
from jaxident.diagnosis.motion.linear import follow
from jaxident.diagnosis.motion.windows import cut, uncut
from jaxident.diagnosis.noise.law import Law, whitener_of
from jaxident.diagnosis.planning import next_run, question
from jaxident.diagnosis.planning.next_run import plan, separations
from jaxident.diagnosis.planning.trial_inputs import KINDS, make, vary
from jaxident.effects.apply import with_effects
from jaxident.effects.coordinates import neutral_vector, nominal_vector
from jaxident.effects.simulate import simulate
from jaxident.errors import InputError
from jaxident.files.models import load_model
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.noise import Noise

SAMPLES = 300
PAIR = ("lateral_slip", "marker_offset")


@pytest.fixture(scope="module")
def robot():
    return load_model("published")


def asked(model, pair, noise=question.CAMERA, limit=1.0):
    sizes = {name: question.expected_size(model, name, limit, SAMPLES) for name in pair}
    return question.ask(model, pair, sizes, noise, SAMPLES, limit)


def trials(kind, count=next_run.TOGETHER):
    rng = np.random.default_rng(3)
    return np.stack([make(rng, kind, SAMPLES, 12) for _ in range(count)])


@pytest.mark.slow
def test_a_plan_keeps_the_limit_and_its_seed(robot):
    found = plan(robot, PAIR, samples=SAMPLES, limit=0.7, batches=2)
    again = plan(robot, PAIR, samples=SAMPLES, limit=0.7, batches=2)
    other = plan(robot, PAIR, samples=SAMPLES, limit=0.7, batches=1, seed=1)
    command = np.stack(found.log.command)
    assert command.shape == (2, SAMPLES)
    assert 0.35 < np.abs(command).max() <= 0.7
    assert np.isnan(np.stack(found.log.pose)).all()
    np.testing.assert_allclose(np.diff(found.log.t), robot.sample_period)
    np.testing.assert_array_equal(command, np.stack(again.log.command))
    assert (found.before, found.after) == (again.before, again.after)
    assert not np.array_equal(command, np.stack(other.log.command))
    assert found.after > 1.2 * found.before > 0.0
    assert found.assumed


def test_a_separation_is_what_a_plain_fit_leaves(robot):
    commands = trials("multilevel")
    asks = asked(robot, PAIR)
    found = separations(asks, commands)
    # within two in a hundred when written; start states answer in closed form here and by differences there, which is
    # not shown to be the cause
    np.testing.assert_allclose(found[0], plain_separation(asks, commands)[0], rtol=0.03)


def plain_separation(asks, commands):
    """One least-squares problem over all windows of each input, start states by central differences."""
    states = next_run._paths(asks, uncut(commands, asks.period))
    count, samples, _ = commands.shape
    run = np.repeat(np.arange(count), samples)
    flat = [column.T.ravel() for column in (*commands.transpose(2, 1, 0), *states[:3])]
    log = make_log(np.tile(asks.period * np.arange(samples), count), *flat, run=run)
    windows = cut(log, asks.rows)._replace(session=np.zeros(count))
    starts = states[:, windows.first, windows.run]
    scale = np.tile([1e3, 1e3, 1e2], asks.rows)

    def change(vectors, shifts):
        count = max(len(vectors[0]), len(vectors[1]))
        wide = [np.broadcast_to(v, (count, v.shape[1])) for v in vectors]
        begins = [np.broadcast_to(starts + s[:, :, None], (count, *starts.shape)) for s in shifts]
        high, low = (follow(*given, windows) for given in zip(wide, begins, strict=True))
        return (low - high) * scale

    still = np.zeros((1, 5))
    many = [np.tile(asks.base, (5, 1))] * 2
    by_start = change(many, [1e-5 * np.eye(5), -1e-5 * np.eye(5)])
    step = np.zeros((10, len(asks.base)))
    step[:, :10] = 1e-6 * np.eye(10)
    by_nominal = change([asks.base + step, asks.base - step], [still, still])
    moved = change([asks.vectors, asks.base[None]], [still, still])
    values = []
    for number in range(count):
        own = np.flatnonzero(windows.run == number)
        blocks = np.zeros((len(own), len(scale), 5 * len(own)))
        for place, window in enumerate(own):
            blocks[place, :, 5 * place : 5 * place + 5] = by_start[:, window].T
        fixed = np.column_stack([blocks.reshape(-1, 5 * len(own)), by_nominal[:, own].reshape(10, -1).T])
        columns = moved[:, own].reshape(len(moved), -1)
        left = []
        for expected, rays in zip(asks.expected, asks.rays[::-1], strict=True):
            for ray in rays:
                table = np.column_stack([fixed, columns[ray].T])
                table /= np.linalg.norm(table, axis=0) + 1e-300
                fit = table @ np.linalg.lstsq(table, columns[expected], rcond=1e-11)[0]
                left.append(0.5 * np.sum((columns[expected] - fit) ** 2))
        values.append(min(left))
    return np.array(values)


def test_spins_cannot_show_slip_to_the_side(robot):
    even = Physical(np.array([2.0, 8.0]), np.array([[0.5, 0.5], [20.0, -20.0]]))
    model = dataclasses.replace(robot, dynamics=even, dead_zone=np.zeros(2))
    asks = asked(model, PAIR)
    assert separations(asks, trials("spins")).max() < 1e-6
    assert separations(asks, trials("multilevel")).min() > 1.0


def test_noise_twice_as_high_quarters_the_separation(robot):
    commands = trials("multilevel")
    low, high = (separations(asked(robot, PAIR, Noise(k * 1e-3, k * 1e-2)), commands) for k in (1, 2))
    np.testing.assert_allclose(low, 4.0 * high, rtol=1e-6)


@pytest.mark.slow
def test_slip_lowers_the_separation(robot):
    commands = trials("multilevel")
    white = separations(asked(robot, PAIR), commands)
    slipping = separations(asked(robot, PAIR, Noise(1e-3, 1e-2, None, 0.02, 0.5)), commands)
    assert np.all(slipping < 0.9 * white)


def test_a_camera_with_a_memory_has_its_law():
    law = question.law_of(Noise(1e-3, 1e-2, 0.3, 0.0, 0.0), 0.05)
    assert law == Law(0.0, 0.0, None, None, (1e-3, 1e-2), 0.3)


@pytest.mark.parametrize(
    ("pair", "settings", "words"),
    [
        (("transport_delay", "elves"), {}, "unknown effect 'elves'"),
        (("frozen_frames", "motor_lag"), {}, "frozen_frames is random"),
        (("motor_lag", "motor_lag"), {}, "two different effects"),
        (("motor_lag",), {}, "two different effects"),
        (PAIR, {"limit": 0.2}, "dead zone"),
        (PAIR, {"samples": 60}, "at least 100"),
    ],
)
def test_what_cannot_be_planned_is_refused(robot, pair, settings, words):
    with pytest.raises(InputError, match=words):
        plan(robot, pair, **settings)


def test_free_numerators_are_refused(robot):
    with pytest.raises(InputError, match="physical"):
        plan(dataclasses.replace(robot, dynamics=robot.difference), PAIR)


def test_sizes_are_the_model_s_or_typical_ones_of_the_limit(robot):
    given = with_effects(robot, [("asymmetric_dead_zone", {"right": 7.0, "left": 5.0})])
    assert question.expected_size(given, "asymmetric_dead_zone", 100.0, 300) == {"right": 7.0, "left": 5.0}
    typical = question.expected_size(robot, "asymmetric_dead_zone", 1.0, 300)
    assert question.expected_size(robot, "asymmetric_dead_zone", 100.0, 300) == {k: 100 * v for k, v in typical.items()}
    assert question.expected_size(robot, "transport_delay", 100.0, 300) == {"delay": 0.05}


@pytest.mark.parametrize("kind", KINDS)
def test_inputs_that_are_tried_stay_within_full_drive(kind):
    rng = np.random.default_rng(0)
    command = make(rng, kind, 101, 7)
    assert command.shape == (101, 2)
    assert 0.0 < np.abs(command).max() <= 1.0
    changed = vary(rng, command, -command, 1.0 / 30.0)
    assert changed.shape == (101, 2)
    assert np.abs(changed).max() <= 1.0


@pytest.mark.slow
def test_the_planned_input_tells_a_delay_from_a_lag_in_simulation(robot):
    found = plan(robot, ("transport_delay", "motor_lag"), samples=SAMPLES, batches=12)
    ordinary = make(np.random.default_rng(1), "multilevel", SAMPLES, 20)
    delayed = with_effects(robot, [("transport_delay", {"delay": 0.05})])
    planned = [lead_of_delay(delayed, np.stack(found.log.command, axis=1), seed) for seed in range(4)]
    usual = [lead_of_delay(delayed, ordinary, seed) for seed in range(4)]
    assert min(planned) > max(usual)
    assert min(planned) > found.after  # to first order, and the less of both directions: a cautious prediction


def lead_of_delay(delayed, command, seed):
    """By how much a refitted delay explains noisy data of the full simulator better than a refitted lag."""
    noisy = dataclasses.replace(delayed, noise=question.CAMERA)
    log = make_log(delayed.sample_period * np.arange(SAMPLES), *command.T)
    log = simulate(noisy, log, start=AT_REST, key=jax.random.key(seed))
    windows = cut(log._replace(**{name: np.asarray(getattr(log, name)) for name in ("x", "y", "theta")}), 50)
    law = Law(question.CAMERA.position, question.CAMERA.heading)
    data = Data(windows, whitener_of(law, windows, None))
    base = neutral_vector(nominal_vector(delayed.physical, np.asarray(delayed.dead_zone)))
    first = refit(data, base, first_starts(windows), ())
    fits = [refit(data, first.vector, first.starts, (name,)) for name in ("transport_delay", "motor_lag")]
    return fits[1].cost - fits[0].cost
