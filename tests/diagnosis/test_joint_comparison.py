"""What robot and simulator have in common, from searches that are made up and from two small robots."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.diagnoses import fit_of
from support.small_robot import LAW, likeliest_end, nominal_fit, robot_with, windows_of

from jaxident.diagnosis.causes.columns import tabulate
from jaxident.diagnosis.causes.discrepancy import Rest
from jaxident.diagnosis.causes.discrepancy_basis import Term
from jaxident.diagnosis.causes.finding import CLAIMED, Finding, finding_of
from jaxident.diagnosis.causes.search_rounds import TERMS
from jaxident.diagnosis.fit.refit import refit
from jaxident.diagnosis.joint_comparison import (
    explain_together,
    lacks,
    reselected,
    same_names,
    searched,
    shows,
    with_effects,
)
from jaxident.effects.coordinates import PLACES

TERM = Term("drive", "v^3 in the acceleration along")
PRICE = 9.0
DELAY, LOSS, LAG = ("transport_delay", "delay"), ("turn_loss", "loss"), ("motor_lag", "time_constant")


def known(sizes, seed=0, likely=()) -> Finding:
    """The finding of a small robot whose effects are known, as a search would end there; `likely`: the log evidence of
    some other sets, less that of its own."""
    data, nominal = nominal_fit(windows_of(robot_with(sizes), seed))
    vector, effects = nominal.vector.copy(), tuple(dict.fromkeys(name for name, _ in sizes))
    for pair, value in sizes.items():
        vector[PLACES[pair]] = value
    fit = refit(data, vector, nominal.starts, effects)
    rest = Rest([], np.zeros((*fit.linear.residual.shape, 0)), LAW, 0.0)
    values = {frozenset(effects): 0.0, **{frozenset(names): value for names, value in likely}}
    return Finding(data, LAW, LAW, nominal, fit, effects, values, rest, tabulate(data, fit, effects))


def found_of(sizes, seed=0) -> Finding:
    """The finding of a search on a small robot with some effects."""
    windows = windows_of(robot_with(sizes), seed)
    nominal = nominal_fit(windows)[1]
    return finding_of(SimpleNamespace(nominal=nominal), likeliest_end(windows, nominal))


@pytest.fixture(scope="module")
def robot():
    """A robot with a delay and a loss in turns."""
    return known({DELAY: 0.08, LOSS: 0.3}, likely=[(("turn_loss",), -700.0)])


@pytest.fixture(scope="module")
def simulator():
    """One with the loss alone, other commands and other noise."""
    return known({LOSS: 0.3}, seed=1)


def test_what_the_robot_has_alone_is_missing(robot, simulator):
    found = explain_together(robot, simulator)
    assert set(found.robot.selected) == {"transport_delay", "turn_loss"}
    assert found.missing == ("transport_delay",)
    assert found.effects == ("turn_loss",)
    assert found.price == CLAIMED
    assert found.fit.vector[PLACES[LOSS]] == pytest.approx(0.3, rel=0.2)


def test_what_the_simulator_has_alone_is_not_missing(robot, simulator):
    found = explain_together(simulator, robot)
    assert found.missing == ()
    assert set(found.effects) == {"transport_delay", "turn_loss"}


def test_what_both_have_is_no_difference(robot):
    found = explain_together(robot, robot)
    assert found.missing == ()
    assert found.effects == robot.selected
    assert found.fit is robot.fit


@pytest.mark.parametrize(("delay", "missing"), [(0.008, ("transport_delay",)), (0.053, ()), (0.1, ())])
def test_hardly_any_of_an_effect_is_a_difference_and_less_of_it_a_parameter(robot, delay, missing):
    """The simulator's delay is a tenth of the robot's, two thirds of it, or more."""
    assert explain_together(robot, known({LOSS: 0.3, DELAY: delay}, seed=1)).missing == missing


def test_a_payload_that_comes_after_the_simulator_s_last_run_is_the_robot_s_alone():
    """It fits the simulator's logs as well as none: they do not ask for it."""
    robot = known({("payload_change", "loss"): 0.3, ("payload_change", "instant"): 12.0})
    late = robot.fit.vector.copy()
    late[PLACES["payload_change", "instant"]] = 1e3
    robot, theirs = robot._replace(fit=robot.fit._replace(vector=late)), known({}, seed=1)
    assert explain_together(robot, theirs).missing == ("payload_change",)
    assert not shows("payload_change", theirs, robot.fit, PRICE)


def test_logs_ask_for_an_effect_by_what_it_gains_beside_the_others(robot, simulator):
    fewer = reselected(robot, ("turn_loss",), simulator.fit)
    assert shows("transport_delay", fewer, robot.fit, PRICE)
    assert shows("transport_delay", fewer, robot.fit, 0.9 * (fewer.fit.cost - robot.fit.cost))
    assert not shows("transport_delay", fewer, robot.fit, 1.1 * (fewer.fit.cost - robot.fit.cost))
    assert not shows("transport_delay", simulator, robot.fit, PRICE)


def test_a_limit_that_the_commands_never_reach_is_not_asked_for(simulator):
    beyond = simulator.fit._replace(vector=np.array(simulator.fit.vector))
    beyond.vector[PLACES["input_saturation", "level"]] = 5.0
    assert not shows("input_saturation", simulator, beyond, PRICE)


@pytest.mark.slow
def test_two_searches_end_with_the_difference_that_was_put_in():
    """From the logs alone: a delay that the simulator has not, or hardly, whatever its search has called that."""
    robot = found_of({DELAY: 0.08, LOSS: 0.3})
    for theirs in ({LOSS: 0.3}, {LOSS: 0.3, DELAY: 0.008}):
        found = explain_together(robot, found_of(theirs, seed=1))
        assert set(found.robot.selected) == {"transport_delay", "turn_loss"}
        assert found.missing == ("transport_delay",)


@pytest.fixture(scope="module")
def apart():
    """A robot with a delay and one with a lag, as if neither log could tell them well: in the other's place each costs
    5 and 7 of log evidence."""
    delayed = known({DELAY: 0.08}, likely=[(("motor_lag",), -5.0), (("slope",), -1.0)])
    return delayed, known({LAG: 0.08}, seed=1, likely=[(("transport_delay",), -7.0)])


def test_the_same_gap_made_up_differently_is_no_difference(apart):
    """The cheaper exchange of the two is made: the robot's set is then the simulator's, refitted on the robot's logs,
    and values count from it."""
    delayed, lagging = apart
    robot, simulator = same_names(delayed, lagging, PRICE)
    assert robot.selected == simulator.selected == ("motor_lag",)
    assert simulator is lagging
    assert robot.values[frozenset({"motor_lag"})] == 0.0
    assert robot.values[frozenset({"transport_delay"})] == 5.0
    assert robot.fit.vector[PLACES[DELAY]] == 0.0
    assert robot.fit.vector[PLACES[LAG]] > 0.01
    assert robot.fit.cost > delayed.fit.cost
    assert explain_together(delayed, lagging).missing == ()


def test_the_cheaper_exchange_may_be_the_simulator_s(apart):
    delayed, lagging = apart
    dear = delayed._replace(values=delayed.values | {frozenset({"motor_lag"}): -8.0})
    robot, simulator = same_names(dear, lagging, PRICE)
    assert robot is dear
    assert simulator.selected == ("transport_delay",)


def test_an_exchange_that_costs_more_than_a_difference_is_not_made(apart):
    robot, simulator = same_names(*apart, price=4.0)
    assert [robot.selected, simulator.selected] == [("transport_delay",), ("motor_lag",)]


def test_names_that_agree_stay(robot):
    same = same_names(robot, robot, 1e9)
    assert same[0] is robot
    assert same[1] is robot


def test_a_difference_must_be_worth_twice_the_largest_term_that_both_leave(robot, simulator):
    def price(*gains):
        sides = [one._replace(rest=one.rest._replace(terms=[(TERM, gain), (TERM, 1.0)]))
                 for one, gain in zip((robot, simulator), gains, strict=True)]  # fmt: skip
        found = explain_together(*sides)
        return found.price, found.missing

    assert price(300.0, 2.0) == (CLAIMED, ("transport_delay",)), "the robot alone leaves something"
    assert price(300.0, 200.0) == (TERMS * 200.0, ("transport_delay",))
    assert price(1.0, 200.0)[0] == CLAIMED


def test_another_set_selected_has_its_own_fit(robot, simulator):
    fewer = reselected(robot, ("turn_loss",), simulator.fit)
    assert fewer.selected == ("turn_loss",)
    assert fewer.fit.vector[PLACES[DELAY]] == 0.0
    assert fewer.fit.cost > robot.fit.cost + 100.0
    assert fewer.values[frozenset({"turn_loss"})] == 0.0
    assert fewer.values[frozenset(robot.selected)] == 700.0
    again = with_effects(fewer, robot.selected, robot.fit)
    assert again.cost == pytest.approx(robot.fit.cost, abs=0.5)
    assert with_effects(robot, robot.selected, simulator.fit) is robot.fit


def test_a_coordinate_that_logs_say_nothing_about_hides_no_other():
    """The spin of a wheel that does not slide has an enormous variance beside a limit that is well known."""
    known = fit_of(("traction_limit",), 0.1)
    k = known.places.index(PLACES["traction_limit", "spin"])
    known.covariance[k, k] = 1e212
    assert lacks("traction_limit", fit_of(("traction_limit",), 0.0), known, PRICE)


def test_steps_of_a_command_that_both_have_are_no_difference():
    """Their size is looked for on a grid: a fit has no variance of it."""
    coarse = fit_of(("input_quantisation",), 0.1)
    coarse.places.remove(PLACES["input_quantisation", "step"])
    coarse = coarse._replace(covariance=coarse.covariance[:-1, :-1])
    assert not lacks("input_quantisation", coarse, coarse, PRICE)


def test_the_same_effect_of_another_size_is_a_parameter_and_hardly_any_of_it_a_difference():
    large, half, little = (fit_of(("transport_delay",), size) for size in (0.1, 0.06, 0.02))
    assert not lacks("transport_delay", large, large, PRICE)
    assert not lacks("transport_delay", half, large, PRICE)
    assert lacks("transport_delay", little, large, PRICE)
    assert not lacks("transport_delay", little, large, 2.0 * PRICE), "0.08 apart, each known to 0.01: 16 of -log p"
    assert not lacks("transport_delay", large, little, PRICE), "it has more of it, which is none of the robot's effects"
    unsure = fit_of(("transport_delay",), 0.02, deviation=0.05)
    assert not lacks("transport_delay", unsure, large, PRICE), "a common size costs hardly anything"


def test_what_a_fit_has_searched_is_counted_from_neutral():
    found = fit_of(("stiction",), 0.02, deviation=0.03)
    size, covariance = searched([("stiction", "fade"), ("stiction", "left")], found)
    np.testing.assert_allclose(size, [0.02, 0.02])
    np.testing.assert_allclose(covariance, 0.03**2 * np.eye(2))
