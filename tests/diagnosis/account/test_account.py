"""Who causes how much: Shapley values by hand, shares that add up, and a floor that is what robots really miss by."""

import dataclasses
import itertools
from types import SimpleNamespace
from typing import Any, NamedTuple

import jax
import numpy as np
import pytest

from jaxident.diagnosis.account.account import PLACES, account_of
from jaxident.diagnosis.account.floor import Floor, floor_of
from jaxident.diagnosis.account.luck import luck, luck_of_chance
from jaxident.diagnosis.account.shapley import shapley
from jaxident.diagnosis.account.slip_check import slip_seen
from jaxident.diagnosis.motion.windows import whole_runs
from jaxident.diagnosis.noise.law import Law, deviations, less_slip, variances_of
from jaxident.diagnosis.noise.variance_uncertainty import Draws
from jaxident.diagnosis.preparation.judging import judge_model
from jaxident.diagnosis.preparation.prepare import judging_starts
from jaxident.diagnosis.preparation.translate import noise_of
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.simulate import simulate
from jaxident.log import join, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model
from jaxident.study.synthetic import excite

PERIOD, ROWS = 0.03, 30
LONG = make_log(PERIOD * np.arange(3001), *np.ones((5, 3001)))
ROBOT = Model(PERIOD, Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.45], [9.0, -8.5]])), np.array([0.1, 0.12]))


def test_shapley_values_are_the_mean_over_all_orders():
    rng = np.random.default_rng(0)
    worth = {frozenset(s): rng.normal() for n in range(4) for s in itertools.combinations("abc", n)}
    found = shapley(("a", "b", "c"), lambda joined: worth[joined])
    for player in "abc":
        gains = []
        for order in itertools.permutations("abc"):
            before = frozenset(order[: order.index(player)])
            gains.append(worth[before] - worth[before | {player}])
        assert found[player] == pytest.approx(np.mean(gains))
    assert sum(found.values()) == pytest.approx(worth[frozenset()] - worth[frozenset("abc")])


def test_who_does_nothing_has_nothing_and_equals_have_equal_parts():
    found = shapley(("a", "b", "c"), lambda joined: -(len(joined & {"a", "b"}) ** 2))
    assert found["a"] == found["b"] == pytest.approx(2.0)
    assert found["c"] == 0.0


def test_shares_add_up_and_intervals_hold_them():
    rng, unit = np.random.default_rng(1), np.array([1e-3, 1e-3, 5e-3]) ** 2
    sizes = {(): 20.0, ("a",): 8.0, ("b",): 14.0, ("a", "b"): 1.5}
    errors = {frozenset(k): np.sqrt(v * unit) * rng.normal(size=(80, 3)) for k, v in sizes.items()}
    parts = [np.full((80, 3), part) * unit for part in (1.0, 0.2, 0.1)]
    chance, lucky = {"outliers": 0.05 * np.ones((80, 3)) * unit}, {"outliers": rng.gamma(2.0, 0.025, 400)}
    floor = Floor(*parts, chance, np.full(400, 1.35), np.full(400, 1.2), lucky, np.full(400, 1.35))
    found = account_of(1.0, errors, ("a", "b"), floor, unit)
    assert [row.part for row in found.rows] == ["camera", "start", "slip", "a", "b", "outliers", "discovered", "rest"]
    assert sum(row.share for row in found.rows) == pytest.approx(1.0, abs=1e-9)
    assert all(row.interval[0] <= row.share <= row.interval[1] for row in found.rows)
    assert found.share("a") > found.share("b") > found.share("camera") > 0.0
    assert found.named == ("a", "b", "outliers")
    for row in found.rows:
        assert sum(row.channels.values()) == pytest.approx(1.0 if row.share else 0.0)


def test_starts_that_some_model_fails_from_count_in_nothing_and_are_told():
    unit = np.ones(3)
    errors = {frozenset(): np.full((10, 3), 3.0), frozenset("a"): np.ones((10, 3))}
    errors[frozenset("a")][4] = np.nan
    floor = Floor(*[np.full((10, 3), 0.3)] * 3, {}, *[np.full(400, 0.9)] * 2, {}, np.full(400, 0.9))
    found = account_of(1.0, errors, ("a",), floor, unit)
    assert (found.windows, found.failed) == (9, 1)
    assert found.share("a") == pytest.approx(8.0 / 9.0)


class Rows(NamedTuple):
    """What of `Prepared` judging needs."""

    log: Any
    judging: Any
    naming: Any
    fitted: Any
    rows: int
    frames: Any


def driven(law, effects=(), runs=24, seed=0):
    """Runs of a robot under a law of noise; the model that knows all of it, and what judging it needs."""
    apart = any(effect.name == "coloured_noise" for effect in effects)
    model = dataclasses.replace(ROBOT, noise=noise_of(law, apart), effects=effects)
    plain = [excite(jax.random.key(k), "multilevel", 291, PERIOD, hold=12) for k in range(runs)]
    keys = jax.random.split(jax.random.key(100 + seed), runs)
    logs = [simulate(model, log, key=key) for log, key in zip(plain, keys, strict=True)]
    log = join([type(one)(*map(np.asarray, one)) for one in logs])
    starts, frames = judging_starts(log, whole_runs(log), ROWS), SimpleNamespace(poses=len(log.t))
    return model, Rows(log, starts, starts, log, ROWS, frames)


def sure(law, draws=400):
    """Draws of a law that is known exactly."""
    sizes = np.sqrt(variances_of(law))[:, None] * np.ones(draws)
    return Draws(sizes, None if law.slip is None else np.full(draws, law.slip_time), law.coloured_time)


LAWS = {
    "white": (Law(1e-3, 5e-3), ()),
    "slipping": (Law(5e-4, 4e-3, (0.03, 0.4), 0.2), ()),
    "remembering": (Law(5e-4, 4e-3, coloured=(1e-3, 5e-3), coloured_time=0.3), ()),
    "losing": (Law(5e-4, 4e-3), (Effect("lost_commands", {"probability": 0.2}),)),
    "freezing": (Law(5e-4, 4e-3), (Effect("frozen_frames", {"probability": 0.1}),)),
    "outlying": (Law(5e-4, 4e-3), (Effect("outliers", {"probability": 0.05, "position": 0.01, "heading": 0.1}),)),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", LAWS)
def test_the_floor_is_what_a_true_model_misses_by(kind):
    """216 starts of 24 runs, three channels: a mean square of white errors has a standard error of 6 %, of rare
    ones one of 15 %; the bound is three of them, and the second order that a filter leaves out."""
    law, effects = LAWS[kind]
    model, prepared = driven(law, effects)
    judged = judge_model(model, prepared)
    floor = floor_of(model, judged, prepared, law, sure(law))
    unit = deviations(law) ** 2
    missed, told = np.mean(judged.error**2 / unit), np.mean(floor.total / unit)
    assert told == pytest.approx(missed, rel=0.45 if effects else 0.2)
    assert np.mean(floor.draws) == pytest.approx(told, rel=0.1)
    assert np.quantile(floor.likely, 0.001) < missed < np.quantile(floor.likely, 0.999)
    assert set(floor.chance) == {effect.name for effect in effects}


@pytest.mark.slow
def test_a_memory_of_the_camera_is_told_with_what_it_does_to_starts():
    """The same robots with and without it: its part is the difference, within the error of both mean squares."""
    law = Law(5e-4, 4e-3, coloured=(1e-3, 5e-3), coloured_time=0.3)
    effect = Effect("coloured_noise", {"position": 1e-3, "heading": 5e-3, "correlation_time": 0.3})
    model, prepared = driven(law, (effect,))
    judged, unit = judge_model(model, prepared), deviations(law) ** 2
    floor = floor_of(model, judged, prepared, law, sure(law))
    calm = judge_model(*driven(Law(5e-4, 4e-3)))
    missed = [np.mean(one.error**2 / unit) for one in (judged, calm)]
    assert np.mean(floor.chance["coloured_noise"] / unit) == pytest.approx(missed[0] - missed[1], rel=0.2)
    assert np.mean(floor.start / unit) == pytest.approx(np.mean(calm.squares[0] / unit), rel=0.1)
    assert np.mean(judged.squares[0]) > 1.5 * np.mean(calm.squares[0])  # else the test would see no difference


@pytest.mark.slow
def test_what_noise_happens_to_leave_spreads_as_over_seeds():
    """The spread of mean squares over twelve seeds of two runs, 18 starts each, has a standard error of 20 %."""
    law, _ = LAWS["slipping"]
    unit, found, told = deviations(law) ** 2, [], []
    for seed in range(12):
        model, prepared = driven(law, runs=2, seed=seed)
        judged = judge_model(model, prepared)
        camera = np.broadcast_to(unit, judged.error.shape)
        expected = np.mean(sum(judged.squares) / unit) + 1.0
        found.append(np.mean(judged.error**2 / unit) / expected)
        told.append(np.std(luck(judged, camera, unit, 400)))
    assert np.mean(found) == pytest.approx(1.0, abs=4.0 * np.std(found) / 12**0.5)
    assert np.mean(told) == pytest.approx(np.std(found), rel=0.7)


@pytest.mark.parametrize(("name", "parameters", "rate"), [
    ("outliers", {"probability": 0.05, "position": 0.01, "heading": 0.1}, 0.05),
    ("frozen_frames", {"probability": 0.2}, 0.2),
])  # fmt: skip
def test_rare_chance_spreads_as_rare_squares_do(name, parameters, rate):
    """A square of a normal number that is there at a rate has the mean rate s^2 and the variance (3 rate - rate^2)."""
    starts = judging_starts(LONG, whole_runs(LONG), ROWS)
    prepared = Rows(LONG, starts, starts, LONG, ROWS, SimpleNamespace(poses=10**9))
    part = np.ones((len(starts.row), 1)) * np.array([[1.0, 0.0, 0.0]])
    drawn = luck_of_chance(name, parameters, part, prepared, 4000)
    expected = np.sqrt((3.0 / rate - 1.0) / len(part))
    assert np.mean(drawn) == pytest.approx(1.0, abs=4.0 * expected / 4000**0.5)
    assert np.std(drawn) == pytest.approx(expected, rel=0.2)
    few = luck_of_chance(name, parameters, part, prepared._replace(frames=SimpleNamespace(poses=40)), 4000)
    assert np.std(few) > 1.1 * np.std(drawn)


def test_slip_that_foretells_more_than_there_is_is_taken_back():
    law, _ = LAWS["slipping"]
    model, prepared = driven(law)
    assert slip_seen(model, prepared, law) == 1.0
    tripled = less_slip(law, 9.0)
    factor = slip_seen(dataclasses.replace(model, noise=noise_of(tripled)), prepared, tripled)
    assert factor == pytest.approx(1.0 / 9.0, rel=0.4)
    assert slip_seen(model, prepared, LAWS["white"][0]) == 1.0


def test_a_start_from_a_run_up_does_not_foretell_for_all():
    """Poses before one start jump about. A robot that hardly settles has no speed that its commands alone would tell:
    one such start in 54 made the mean expected squares 97 to 821 times as large."""
    law, _ = LAWS["white"]
    model, prepared = driven(law, runs=6)
    slow = dataclasses.replace(model, dynamics=model.dynamics._replace(rate=np.array([0.01, 0.01])))
    calm = judge_model(slow, prepared)
    row = prepared.judging.row[20] + prepared.judging.run[20] * 291
    x = prepared.log.x.copy()
    x[row - 18 : row] += 0.5 * (-1.0) ** np.arange(18)
    judged = judge_model(slow, prepared._replace(log=prepared.log._replace(x=x)))
    assert np.flatnonzero(judged.run_up).tolist() == [20]
    others = np.arange(54) != 20
    for own, before in zip(judged.squares, calm.squares, strict=True):
        np.testing.assert_allclose(own[20], own[others].mean(axis=0))
        np.testing.assert_allclose(own[others], before[others], rtol=1e-6)


def test_a_law_that_is_hardly_known_widens_the_floor():
    law, _ = LAWS["slipping"]
    model, prepared = driven(law, runs=6)
    judged = judge_model(model, prepared)
    known, rng = sure(law), np.random.default_rng(3)
    loose = known._replace(deviations=known.deviations * np.exp(0.3 * rng.normal(size=known.deviations.shape)))
    spread = [np.std(floor_of(model, judged, prepared, law, draws).draws) for draws in (known, loose)]
    assert spread[0] < 1e-9
    assert spread[1] > 0.1


def test_slip_of_longer_memory_leaves_more_at_the_horizon():
    law, _ = LAWS["slipping"]
    model, prepared = driven(law, runs=6)
    judged = judge_model(model, prepared)
    either = sure(law)._replace(slip_time=np.repeat([0.2, 0.4], 200))
    found = floor_of(model, judged, prepared, law, either).draws
    assert np.mean(found[200:]) > 1.2 * np.mean(found[:200])


def test_without_slip_the_steady_floor_is_all_of_it():
    law, _ = LAWS["white"]
    model, prepared = driven(law, runs=4)
    floor = floor_of(model, judge_model(model, prepared), prepared, law, sure(law))
    np.testing.assert_allclose(floor.steady, floor.draws, rtol=0.02)
    assert np.all(floor.slip == 0.0)


def test_an_empty_log_to_judge_by_is_no_start():
    log = make_log(PERIOD * np.arange(60), np.ones(60), np.ones(60))
    assert not len(judging_starts(log, whole_runs(log), ROWS).row)


def test_every_site_of_the_catalogue_lies_before_the_wheel_or_after_it_or_in_the_camera():
    assert {record.site for record in CATALOGUE.values()} <= PLACES.keys()
