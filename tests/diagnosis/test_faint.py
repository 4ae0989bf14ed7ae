"""Searches that no derivative serves, and replays: each against what was put in."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.small_robot import LAW, ROWS, RUNS, VECTOR, nominal_fit, robot_with, windows_of

from jaxident.diagnosis.causes.columns import tabulate
from jaxident.diagnosis.causes.discrepancy import unexplained
from jaxident.diagnosis.causes.discrepancy_basis import library
from jaxident.diagnosis.causes.moves import fit_options, stands
from jaxident.diagnosis.causes.points import at_best, points_of
from jaxident.diagnosis.causes.search import best_set
from jaxident.diagnosis.causes.search_rounds import search
from jaxident.diagnosis.detectability import Answers, answers, replay, visible
from jaxident.diagnosis.fit.refit import best_starts, bounds, refit
from jaxident.diagnosis.laws.candidates import Turning, cosine_of, path_of
from jaxident.diagnosis.laws.kinds import Kind
from jaxident.diagnosis.motion.linear import follow
from jaxident.diagnosis.motion.responses import modelled_path, modelled_speeds, respond
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.dropped_commands import (
    BY_RULE,
    LATEST,
    _Changes,
    _dependence,
    _taken_at,
    find_lost,
    gain_beyond,
)
from jaxident.diagnosis.preparation.pose_screening import find_more_outliers, find_outliers, has_outliers
from jaxident.diagnosis.preparation.steps import likely_steps
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import (
    COORDINATES,
    PLACES,
    by_effect,
    from_catalogue,
    to_catalogue,
)
from jaxident.effects.effect import EDGE
from jaxident.effects.law_kinds import ANGLE, PUSHES


@pytest.fixture(scope="module")
def plain():
    return nominal_fit(windows_of(VECTOR))


def test_a_window_whose_start_would_jump_does_not_stop_the_others(plain):
    data, nominal = plain
    asked = np.full_like(nominal.starts, 0.05)
    asked[:, 0] = 3.0
    asked[:, 1] *= 4.0
    asked[4, 2] = 1e200
    found, _cost = best_starts(data, nominal.vector, nominal.starts - 0.05, asked)
    np.testing.assert_allclose(found[:, [0, 2]], nominal.starts[:, [0, 2]] - 0.05)
    np.testing.assert_allclose(np.delete(found, [0, 2], axis=1), np.delete(nominal.starts, [0, 2], axis=1))


@pytest.mark.parametrize("towards_zero", [0.0, 1.0])
@pytest.mark.parametrize("step", [0.05359, 0.17])
def test_the_step_of_a_quantised_command_is_found_among_many(step, towards_zero):
    vector = robot_with({("input_quantisation", "step"): step, ("input_quantisation", "towards_zero"): towards_zero})
    found, form = likely_steps(*nominal_fit(windows_of(vector)))[0]
    assert abs(found / step - 1.0) < 0.01
    assert form == towards_zero


def test_a_payload_is_placed_where_it_came():
    vector = VECTOR.copy()
    place = PLACES["payload_change", "instant"]
    vector[PLACES["payload_change", "loss"]], vector[place] = 0.4, 13.3
    data, nominal = nominal_fit(windows_of(vector))
    begin = nominal.vector.copy()
    begin[PLACES["payload_change", "loss"]], begin[place] = 0.1, 18.0
    held = (("payload_change", "instant"),)
    first = refit(data, begin, nominal.starts, ("payload_change",), held, most=4)
    assert abs(at_best(data, first, ("payload_change", "instant"))[place] - 13.3) < 0.3


def test_no_payload_is_placed_near_an_end_of_the_session():
    """It came 2 s before the end of 29 s. What so few windows tell would foretell all that follows."""
    vector, session = VECTOR.copy(), RUNS * ROWS * 0.03
    place = PLACES["payload_change", "instant"]
    vector[PLACES["payload_change", "loss"]], vector[place] = 0.4, session - 2.0
    data, nominal = nominal_fit(windows_of(vector))
    latest = bounds(data.windows)[1][place]
    assert latest == pytest.approx((1.0 - EDGE) * session, rel=0.01)
    assert all(point["instant"] <= latest for point in points_of("payload_change", data, nominal))
    begin = nominal.vector.copy()
    begin[PLACES["payload_change", "loss"]], begin[place] = 0.4, session - 2.5
    fit = refit(data, begin, nominal.starts, ("payload_change",))
    assert fit.vector[place] <= latest
    assert at_best(data, fit, ("payload_change", "instant"))[place] <= latest


def test_a_step_is_settled_to_where_commands_round_alike():
    """From 0.15 % off to within the step's own jumps: every command that is told rounds to the tooth it did."""
    vector = VECTOR.copy()
    vector[PLACES[("input_quantisation", "step")]] = true = 0.2159
    data, nominal = nominal_fit(windows_of(vector))
    begin = nominal.vector.copy()
    begin[PLACES[("input_quantisation", "step")]] = 1.0015 * true
    first = refit(data, begin, nominal.starts, ("input_quantisation",), most=4)
    found = at_best(data, first, ("input_quantisation", "step"))[PLACES[("input_quantisation", "step")]]
    teeth = [np.round(data.windows.command / step) for step in (true, 1.0015 * true, found)]
    assert np.any(teeth[0] != teeth[1])
    np.testing.assert_array_equal(teeth[0], teeth[2])


def test_a_lens_off_the_middle_of_the_field_is_found():
    lens = {"strength": 0.3, "centre_x": 0.15, "centre_y": -0.2}
    vector = VECTOR.copy()
    for key, value in from_catalogue("lens_distortion", lens).items():
        vector[PLACES["lens_distortion", key]] = value
    data, nominal = nominal_fit(windows_of(vector))
    table = tabulate(data, nominal, ())
    (best,) = best_set(table._replace(options=[o for o in table.options if o.effect == "lens_distortion"]), [])
    lenses = [k for k, option in enumerate(table.options) if option.effect == "lens_distortion"]
    found = fit_options(data, table, stands(nominal, ()), [lenses[best]]).fit
    told = to_catalogue("lens_distortion", by_effect(found.vector)["lens_distortion"])
    for key, value in lens.items():
        assert told[key] == pytest.approx(value, abs=0.05), key


def test_commands_that_came_late_are_found_one_by_one(plain):
    data, nominal = nominal_fit(windows_of(VECTOR, late=2))
    found = find_lost(data, nominal)
    assert found.gain > 100.0
    assert 0.02 < found.share < 0.4
    moved = np.any(found.arrived != data.windows.command, axis=2)
    true = np.zeros_like(moved)
    for row in range(50, ROWS, 50):
        true[row : row + 2] = True
    assert np.mean(moved[true]) > 0.5  # small changes cannot be told
    assert np.mean(moved[~true]) < 0.05  # a fit bent by late changes takes some others for late
    assert find_lost(*plain).gain < 4.0


RULES = pytest.mark.parametrize(("rule", "by_chance"), [({}, True), ({"faster": 0.12}, False)])
COARSE = Law(2e-3, 2e-2)


def late_by(rule):
    """Windows of a robot whose commands came late in every fifth place, or wherever it was fast [m/s]."""
    return windows_of(VECTOR, seed=1, late=1, law=COARSE, runs=15, **rule)


def test_losses_are_asked_whether_they_go_by_the_speed():
    """Made-up changes whose lateness is known: by chance the chi-square of four numbers is about four; where only the
    faster half is late, far more. Changes too small to be seen make it no larger."""
    rng, share, seen = np.random.default_rng(0), 0.2, []
    for faster in (False, True):
        for _ in range(20):
            sizes = np.abs(rng.normal(size=(800, 4)))
            columns = sizes[:, 3, None, None] * np.cumsum(rng.normal(size=(800, LATEST, 12)), axis=1)
            late = rng.random(800) < (2.0 * share * (sizes[:, 0] > np.median(sizes[:, 0])) if faster else share)
            residual = rng.normal(size=(400, 12))
            window = np.arange(800) // 2
            np.add.at(residual, window[late], columns[late, 0])
            own = [np.array([2 * k, 2 * k + 1]) for k in range(400)]
            may = np.ones((800, LATEST), bool)
            changes = _Changes(window, window, may, sizes, sizes, columns, own, residual)
            seen.append(_dependence(share, changes, np.concatenate(_taken_at(share, changes)[1])))
    chance, rule = seen[:20], seen[20:]
    assert 2.0 < np.mean(chance) < 8.0
    assert max(chance) < BY_RULE < min(rule)


@pytest.mark.slow
@RULES
def test_commands_late_by_a_rule_are_not_lost_by_chance(rule, by_chance):
    """A name for chance would hide a rule; no search takes them for lost."""
    windows = late_by(rule)
    data, nominal = nominal_fit(windows, COARSE)
    found = find_lost(data, nominal)
    assert found.gain > 100.0
    assert found.by_chance == by_chance
    (end,) = search(windows, nominal, law=COARSE)
    assert (end.lost is not None) == by_chance


def test_the_corrector_has_commands_that_come_later_at_speed(plain):
    """Against a loop over windows and rows."""
    data, nominal = plain
    windows, residual = data.windows, nominal.linear.residual
    responses = respond(np.exp(nominal.vector[:2]), residual, windows)
    found = library(residual, windows, responses)
    v, _ = modelled_speeds(modelled_path(residual, windows), windows)
    force = np.zeros_like(v)
    for window, (run, first) in enumerate(zip(windows.run, windows.first, strict=True)):
        for row in range(v.shape[1]):
            place = min(first + row, len(windows.command) - 1)
            before = windows.command[place - 1, run, 1] if place > 0 else 0.0
            force[window, row] = abs(v[window, row]) * (before - windows.command[place, run, 1])
    place = [term.name for term in found.terms].index("|v| (u 1 rows ago) left in the acceleration along")
    np.testing.assert_allclose(found.columns[..., place], (responses.along @ force[..., None])[..., 0], atol=1e-12)


def test_a_fit_begun_where_the_robot_runs_away_begins_without_effects(plain):
    """Sizes found on another robot's logs may be a motor here: poses overflow, and nothing can be told from there."""
    data, nominal = plain
    vector = nominal.vector.copy()
    vector[PLACES["turn_loss", "loss"]] = -1e5
    found = refit(data, vector, nominal.starts, ("turn_loss",))
    assert found.cost <= nominal.cost
    assert np.all(np.isfinite(found.covariance))
    assert abs(found.vector[PLACES["turn_loss", "loss"]]) < 0.1


def test_a_share_of_late_commands_is_held_against_another_one():
    """A smaller share pays more for every change that came late and less for every one that did not; what was late
    beyond doubt is explained by either."""
    data, nominal = nominal_fit(windows_of(VECTOR, late=2))
    found = find_lost(data, nominal)
    assert gain_beyond(data, nominal, found.share) == pytest.approx(0.0, abs=1e-9)
    near, far = (gain_beyond(data, nominal, found.share / part) for part in (3.0, 30.0))
    assert 0.0 < near < far < found.gain


def test_what_turns_with_a_wheel_is_told_as_unexplained(plain):
    data, nominal = plain
    windows, responses = data.windows, respond(np.exp(nominal.vector[:2]), nominal.linear.residual, data.windows)

    def told(solution):
        return [term.name for term, _ in unexplained(data, solution, responses, LAW, sized=False).terms]

    assert not [name for name in told(nominal) if "once every" in name]
    phase = np.linspace(0.0, 5.0, windows.run.max() + 1)[windows.run]
    turning = Turning(0.2, 0.1, phase, 0.0, 0.0)
    column = cosine_of(Kind(PUSHES[0], "1", ANGLE), turning, path_of(nominal, windows), responses)
    residual = nominal.linear.residual + 0.1 * column
    loud = nominal._replace(linear=nominal.linear._replace(residual=residual))
    (period,) = [name.split()[-2] for name in told(loud) if name.startswith("push of the right wheel, once every ")]
    assert float(period) == pytest.approx(0.2, rel=0.01)


def test_answers_are_what_least_squares_leaves_of_them(plain):
    data, nominal = plain
    found = answers(data, nominal, 1.0)
    vector = nominal.vector.copy()
    vector[PLACES["turn_loss", "loss"]] = from_catalogue("turn_loss", CATALOGUE["turn_loss"].typical(), vector[:2])[
        "loss"
    ]
    change = nominal.linear.residual - follow(vector[None], nominal.starts[None], data.windows)[0]
    count, numbers = change.shape
    white = [data.whitener[k] for k in range(count)]
    base = np.zeros((count * numbers, 5 * count + 10))
    for k in range(count):
        own = slice(k * numbers, (k + 1) * numbers)
        base[own, 5 * k : 5 * k + 5] = white[k] @ nominal.linear.starts[k]
        base[own, -10:] = white[k] @ nominal.linear.slopes[k]
    base /= np.linalg.norm(base, axis=0)
    target = np.concatenate([w @ c for w, c in zip(white, change, strict=True)])
    rest = target - base @ np.linalg.lstsq(base, target, rcond=None)[0]
    assert visible(found)["turn_loss"] == pytest.approx(0.5 * float(rest @ rest), rel=1e-4)


def test_replays_keep_false_claims_rare_and_name_what_is_hidden(plain):
    data, nominal = plain
    result = replay(answers(data, nominal, 1.0), 3)
    np.testing.assert_allclose(result.named.sum(axis=1), 1.0)
    assert result.named[0, 0] > 0.97
    assert np.mean(np.diagonal(result.named)[1:]) > 0.7


def test_replays_of_effects_that_answer_apart_are_all_named():
    names = list(COORDINATES)[:4]
    count = sum(len(COORDINATES[name]) for name in names) + len(names)
    own, products, place = {}, np.eye(count), 0
    for name in names:
        own[name] = list(range(place, place + len(COORDINATES[name])))
        place += len(COORDINATES[name])
    typical = {name: place + k for k, name in enumerate(names)}
    for name in names:  # the typical size is the first coordinate's
        products[typical[name], :] = products[own[name][0], :]
        products[:, typical[name]] = products[:, own[name][0]]
    parts = {name: [1.0] + [0.0] * (len(own[name]) - 1) for name in names}
    scale = {name: np.full(len(own[name]), 10.0) for name in names}
    found = replay(Answers(products, own, scale, parts, typical), 1)
    assert found.effects == tuple(names)
    assert np.all(np.diagonal(found.named)[1:] > 0.95)


def test_outliers_are_found_large_ones_first(plain):
    data, nominal = plain
    log = SimpleNamespace(t=np.zeros(RUNS * ROWS), run=np.repeat(np.arange(RUNS), ROWS))
    assert not find_outliers(log, data.windows, nominal).any()
    residual = nominal.linear.residual.copy().reshape(len(data.windows.run), -1, 3)
    for window, row in ((2, 20), (5, 11)):
        residual[window, row, 0] += 20.0 * LAW.position
    for window, row in ((3, 0), (6, 30), (6, 31)):  # at an end, and two in a row
        residual[window, row, 1] += 15.0 * LAW.position
    residual[7, 9, 2] += 6.5 * LAW.heading
    fit = nominal._replace(linear=nominal.linear._replace(residual=residual.reshape(len(residual), -1)))
    rows = data.windows.run * ROWS + data.windows.first
    assert set(np.flatnonzero(find_outliers(log, data.windows, fit))) == {rows[2] + 20, rows[5] + 11}
    more = set(np.flatnonzero(find_more_outliers(log, data.windows, fit)))
    assert {rows[3], rows[6] + 30, rows[6] + 31, rows[7] + 9} <= more
    assert len(more) < 12


def test_where_misses_are_smooth_hardly_a_row_is_an_outlier(plain):
    """Sums of random walks, with a hundredth of their steps in noise: most rows are the median of the five around them,
    so that a spread by the median of what is left is next to nothing, and twice as many rows lie beyond it (0.012 to
    0.018 of all, 0.005 to 0.007 by its tail; means of twenty such logs). On a real robot 747 of 8,838 did."""
    data, nominal = plain
    log = SimpleNamespace(t=np.zeros(RUNS * ROWS), run=np.repeat(np.arange(RUNS), ROWS))
    rng, shape = np.random.default_rng(2), (len(data.windows.run), len(nominal.linear.residual[0]) // 3, 3)

    def share():
        walks = np.cumsum(np.cumsum(rng.normal(size=shape), axis=1), axis=1) + 0.01 * rng.normal(size=shape)
        fit = nominal._replace(linear=nominal.linear._replace(residual=walks.reshape(shape[0], -1)))
        return find_more_outliers(log, data.windows, fit).mean()

    assert np.mean([share() for _ in range(20)]) < 0.009


def test_one_outlier_in_two_thousand_rows_makes_no_log_with_outliers():
    rows = np.zeros(6000, bool)
    rows[:3] = True
    assert has_outliers(rows, 2000)
    assert not has_outliers(rows, 6000)


def test_a_misfit_is_no_outlier():
    vector = VECTOR.copy()
    vector[PLACES["transport_delay", "delay"]] = 0.08
    windows = windows_of(vector)
    data, nominal = nominal_fit(windows)
    log = SimpleNamespace(t=np.zeros(RUNS * ROWS), run=np.repeat(np.arange(RUNS), ROWS))
    assert find_outliers(log, data.windows, nominal).sum() < 3
