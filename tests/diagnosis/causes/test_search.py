"""The whole search on a small robot whose effects are known: what it names, exchanges, lets go and tells of others."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.small_robot import LAW, VECTOR, likeliest_end, nominal_fit, robot_with, windows_of

from jaxident.diagnosis.causes.columns import tabulate
from jaxident.diagnosis.causes.discrepancy import Rest
from jaxident.diagnosis.causes.discrepancy_basis import Term
from jaxident.diagnosis.causes.evidence import evidence_of, log_evidence
from jaxident.diagnosis.causes.finding import finding_of, let_go
from jaxident.diagnosis.causes.moves import ARRIVED, better, fit_options, look_alikes, stands, united
from jaxident.diagnosis.causes.search_rounds import Found, defended, settle
from jaxident.diagnosis.causes.settled import Settled
from jaxident.diagnosis.fit.refit import refit
from jaxident.diagnosis.motion.linear import linearise
from jaxident.diagnosis.noise.law import first_law
from jaxident.effects.coordinates import COORDINATES, NOMINAL, PLACES

DELAY, LAG, LOSS = ("transport_delay", "delay"), ("motor_lag", "time_constant"), ("turn_loss", "loss")
SAG, AHEAD = ("supply_sag", "resistance"), ("marker_offset", "ahead")
SLOPE = {("slope", "x"): 0.2, ("slope", "y"): -0.1}


def found_on(windows, nominal, without=()):
    """The finding of a search on windows that need no log behind them."""
    return finding_of(SimpleNamespace(nominal=nominal), likeliest_end(windows, nominal, without), without)


def found_of(sizes, without=(), seed=0):
    """The finding of a robot with some effects."""
    windows = windows_of(robot_with(sizes), seed)
    return found_on(windows, nominal_fit(windows)[1], without)


def fitted(windows, effects, begin):
    """Data and fit of a robot with effects that begin somewhere."""
    data, nominal = nominal_fit(windows)
    vector = nominal.vector.copy()
    for pair, value in begin.items():
        vector[PLACES[pair]] = value
    return data, refit(data, vector, nominal.starts, effects)


@pytest.fixture(scope="module")
def pair():
    """The finding of a robot with a delay and a loss in turns."""
    return found_of({DELAY: 0.08, LOSS: 0.3})


@pytest.fixture(scope="module")
def lagging():
    """Windows of a robot with a lag."""
    return windows_of(robot_with({LAG: 0.1}))


def is_sized(finding, sizes):
    """Whether coordinates are within five of their standard deviations of what was put in."""
    for pair, value in sizes.items():
        own = finding.fit.places.index(PLACES[pair])
        deviation = finding.fit.covariance[own, own] ** 0.5
        assert finding.fit.vector[PLACES[pair]] == pytest.approx(value, abs=5.0 * deviation), pair


def test_two_effects_are_named_and_nothing_else(pair):
    assert set(pair.selected) == {"transport_delay", "turn_loss"}
    is_sized(pair, {DELAY: 0.08, LOSS: 0.3})
    assert pair.rest.terms == []


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [
    {LAG: 0.06, **SLOPE},
    {DELAY: 0.08, LOSS: 0.3},
    {SAG: 0.2, AHEAD: 0.03},
    {("backlash", "right"): 0.06, ("backlash", "left"): 0.06, ("lateral_slip", "slip"): 0.05},
    {("input_saturation", "level"): 0.7, ("quadratic_drag", "along"): 1.0, ("quadratic_drag", "heading"): 0.2},
    {("stiction", "right"): 0.15, ("stiction", "left"): 0.15, **SLOPE},
], ids=lambda sizes: " and ".join(dict.fromkeys(name for name, _ in sizes)))  # fmt: skip
@pytest.mark.parametrize("seed", range(1, 3))
def test_pairs_of_many_kinds_are_named_and_nothing_else(sizes, seed):
    finding = found_of(sizes, seed=seed)
    assert set(finding.selected) == {name for name, _ in sizes}
    is_sized(finding, sizes)


def test_of_a_robot_without_effects_none_is_named():
    finding = found_of({})
    assert finding.selected == ()
    assert finding.values[frozenset()] == 0.0
    assert max(value for effects, value in finding.values.items() if effects) < 0.0
    assert finding.gain < 1e-9  # of two fits that end at one place by other ways
    np.testing.assert_array_equal(finding.fit.vector[len(NOMINAL) :], VECTOR[len(NOMINAL) :])


@pytest.mark.slow
def test_of_ten_robots_without_effects_hardly_one_has_an_effect_named():
    """By their prior odds alone less than one in twenty would; none or one of ten is 91 % likely even then."""
    assert sum(bool(found_of({}, seed=seed).selected) for seed in range(1, 11)) <= 1


def test_values_are_held_against_the_selected_set(pair):
    whole = frozenset(pair.selected)
    assert pair.values[whole] == 0.0
    assert all(value <= 0.0 for value in pair.values.values())
    assert pair.values[frozenset()] < -1000.0
    for name in pair.selected:
        assert pair.values[whole - {name}] < -100.0
    assert all(len(effects ^ whole) <= 2 for effects in pair.values if effects)
    assert len({effects for effects in pair.values if effects > whole}) > 15, "every other effect beside it"


def test_entrants_are_the_selected_effects_then_what_is_next(pair):
    found = pair.entrants(("motor_lag",))
    own = {each.effect: each for each in found if not each.instead}
    assert set(pair.selected) < set(own)
    assert min(own[name].evidence for name in pair.selected) > 100.0
    assert max(each.evidence for name, each in own.items() if name not in pair.selected) < 0.0
    assert {(each.effect, each.instead) for each in found if each.instead} == {
        ("motor_lag", name) for name in pair.selected
    }


@pytest.mark.slow
def test_an_effect_that_the_catalogue_lacks_is_in_no_set(lagging):
    finding = found_on(lagging, nominal_fit(lagging)[1], ("motor_lag",))
    assert "motor_lag" not in finding.selected
    assert not any("motor_lag" in effects for effects in finding.values)
    assert finding.unexplained > 0.0 or finding.selected, "something stands in"


def test_a_look_alike_is_exchanged_for_what_it_looks_like(lagging):
    data, fit = fitted(lagging, ("transport_delay",), {DELAY: 0.1})
    now, tried = stands(fit, ("transport_delay",)), {frozenset({"transport_delay"}): 0.0}
    table = tabulate(data, fit, now.effects)
    found = better(data, table, now, tried)
    assert "motor_lag" in look_alikes("transport_delay")
    assert found.effects == ("motor_lag",)
    assert found.evidence > now.evidence + ARRIVED
    assert tried[frozenset({"motor_lag"})] == pytest.approx(found.evidence - now.evidence)
    assert found.fit.vector[PLACES[LAG]] == pytest.approx(0.1, abs=1e-3)
    assert found.fit.vector[PLACES[DELAY]] == 0.0


GRIP, PLAY = "traction_limit", "backlash"
LIMITED = {(GRIP, "inverse_square"): 3.0}
DRY = {**LIMITED, (GRIP, "dry"): 1.0}
LOOSE = {(PLAY, "right"): 0.03, (PLAY, "left"): 0.04}
COASTING = {**LOOSE, (PLAY, "coasting"): 1.0}
LEVEL = "input_saturation"
CUT = {(LEVEL, "level"): 0.6}
SOFT = {**CUT, (LEVEL, "soft"): 1.0}
STEPS = "input_quantisation"
NEAREST = {(STEPS, "step"): 0.15}
TO_ZERO = {**NEAREST, (STEPS, "towards_zero"): 1.0}


@pytest.mark.parametrize(
    ("true", "begun"),
    [(LIMITED, DRY), (DRY, LIMITED), (LOOSE, COASTING), (COASTING, LOOSE), (NEAREST, TO_ZERO), (TO_ZERO, NEAREST),
     (CUT, SOFT), (SOFT, CUT)],
    ids=["tyre", "dry", "resting", "coasting", "nearest", "zero", "cut", "soft"],
)  # fmt: skip
def test_an_effect_in_the_wrong_form_takes_the_other(true, begun):
    (name,) = {name for name, _ in true}
    data, fit = fitted(windows_of(robot_with(true)), (name,), begun)
    moves, only = [stands(fit, (name,))], set(COORDINATES) - {name}
    while (found := better(data, tabulate(data, moves[-1].fit, (name,)), moves[-1], {}, without=only)) is not None:
        assert found.evidence > moves[-1].evidence + ARRIVED
        moves.append(found)
    assert moves[-1].effects == (name,)
    for pair in begun:
        assert moves[-1].fit.vector[PLACES[pair]] == pytest.approx(true.get(pair, 0.0), rel=0.1)
    assert len(moves) == 2 or name == STEPS, "which goes to the best step of the wrong form first"


@pytest.mark.parametrize(
    "true",
    [{("input_rate_limit", "inverse_rate"): 0.3, ("input_rate_limit", "falling_time"): 0.5},
     {LAG: 0.15, ("motor_lag", "second_order"): 0.8},
     {("lens_distortion", "strength"): 1.5, ("lens_distortion", "edge"): 3.0}],
    ids=["ramps", "poles", "edge"],
)  # fmt: skip
def test_a_form_that_is_a_number_is_fitted(true):
    (size, shape), (name, *_) = true.items(), next(iter(true))
    _, fit = fitted(windows_of(robot_with(true)), (name,), {size[0]: size[1]})
    for pair, value in (size, shape):
        own = fit.places.index(PLACES[pair])
        deviation = np.sqrt(fit.covariance[own, own])
        assert deviation < 0.2 * value
        assert abs(fit.vector[PLACES[pair]] - value) < 4.0 * deviation


def test_a_set_that_was_refitted_is_not_tried_again_nor_one_that_the_catalogue_lacks(lagging):
    data, fit = fitted(lagging, ("transport_delay",), {DELAY: 0.1})
    now = stands(fit, ("transport_delay",))
    table = tabulate(data, fit, now.effects)
    for known, without in (({frozenset({"motor_lag"}): -1.0}, ()), ({}, ("motor_lag",))):
        tried = {frozenset({"transport_delay"}): 0.0, **known}
        found = better(data, table, now, tried, without)
        assert found is None or "motor_lag" not in found.effects
        assert {key for key in tried if "motor_lag" in key} == set(known)


@pytest.mark.parametrize("begin", [{DELAY: 0.1}, SLOPE, {**SLOPE, SAG: 0.1}])
def test_a_search_that_begins_with_wrong_effects_ends_with_the_right_one(lagging, begin):
    effects = tuple(dict.fromkeys(name for name, _ in begin))
    _, fit = fitted(lagging, effects, begin)
    state = settle(lagging, stands(fit, effects), first_law(lagging), None)
    assert state.now.effects == ("motor_lag",)
    assert state.tried[frozenset({"motor_lag"})] == 0.0
    assert state.table.here.keys() == {"motor_lag"}


def test_a_search_from_the_effects_of_two_ends_ends_with_the_right_ones():
    """Each of the two has one effect of the robot's two, and one that it has not."""
    windows = windows_of(robot_with({DELAY: 0.08, LOSS: 0.3}))
    begins = {DELAY: 0.08, SAG: 0.1}, {SAG: 0.2, LOSS: 0.3, **SLOPE}
    names = [tuple(dict.fromkeys(name for name, _ in begin)) for begin in begins]
    one, other = (stands(fitted(windows, own, begin)[1], own) for own, begin in zip(names, begins, strict=True))
    both = united(one, other)
    assert both.effects == ("transport_delay", "supply_sag", "turn_loss", "slope")
    for pair, owner in ((DELAY, one), (SAG, one), (LOSS, other)):
        assert both.fit.vector[PLACES[pair]] == owner.fit.vector[PLACES[pair]]
    assert one.fit.vector[PLACES[LOSS]] == 0.0, "the fit itself stays"
    state = settle(windows, both, first_law(windows), None)
    assert set(state.now.effects) == {"transport_delay", "turn_loss"}


def test_the_evidence_of_a_refit_is_what_the_table_promises():
    """Of small effects, about which everything is linear: within a fifth of a unit of some tens."""
    for sizes in ({LOSS: 0.1}, {("slope", "x"): 0.006, ("slope", "y"): -0.004}):
        windows = windows_of(robot_with(sizes))
        data, nominal = nominal_fit(windows)
        table, now = tabulate(data, nominal, ()), stands(nominal, ())
        (name,) = {name for name, _ in sizes}
        option = next(k for k, one in enumerate(table.options) if one.effect == name)
        found = fit_options(data, table, now, [option])
        promised = log_evidence(table, [option])
        assert promised > 10.0
        assert found.evidence - now.evidence == pytest.approx(promised, abs=0.2)


def test_a_fit_without_effects_has_the_evidence_of_its_squares_alone(lagging):
    _, nominal = nominal_fit(lagging)
    assert evidence_of(nominal, 0) == -nominal.cost


def test_a_refit_that_is_far_behind_is_given_up(lagging):
    data, nominal = nominal_fit(lagging)
    table, now = tabulate(data, nominal, ()), stands(nominal, ())
    option = next(k for k, one in enumerate(table.options) if one.effect == "motor_lag")
    assert fit_options(data, table, now, [option], behind=-nominal.cost) is None
    assert fit_options(data, table, now, [option], behind=0.0) is not None


@pytest.mark.parametrize(("gain", "kept"), [(5.0, True), (1e6, False)])
def test_an_effect_leaves_for_a_term_that_does_the_same_only_if_terms_bring_much_beside_it(lagging, gain, kept):
    """Beside the lag, a term that answers as the lag does brings less than a fifth of it, or far more."""
    data, fit = fitted(lagging, ("motor_lag",), {LAG: 0.1})
    now = stands(fit, ("motor_lag",))
    answers = linearise(fit.vector, fit.starts, data.windows, [PLACES[LAG]]).slopes
    rest = Rest([(Term("actuation", "as the lag does"), gain)], answers, LAW, 0.0)
    settled = Settled(now, data, tabulate(data, fit, now.effects), {})
    found = defended(Found(settled, LAW, LAW, rest, None, nominal_fit(lagging)[1]))
    assert ("motor_lag" in found.settled.now.effects) == kept


@pytest.mark.parametrize(("evidence", "worse"), [(-1.0, True), (1.0, False)])
def test_a_search_is_held_against_no_effect_at_all(lagging, evidence, worse):
    data, nominal = nominal_fit(lagging)
    now = stands(nominal, ())._replace(effects=("motor_lag",), evidence=evidence - nominal.cost)
    settled = Settled(now, data, tabulate(data, nominal, ()), {})
    assert Found(settled, LAW, LAW, Rest([], np.zeros(0), LAW, 0.0), None, nominal).worse_than_none == worse


def test_a_robot_coasts_only_if_it_does_so_with_its_effects_too(lagging):
    """Slow fits whose gains have no clear sign, in place of that without effects and of that with them."""
    data, fit = nominal_fit(lagging)
    slow = fit._replace(vector=np.concatenate([np.log([0.2, 0.2]), fit.vector[2:]]), covariance=1e6 * fit.covariance)
    for nominal, now, coasting in ((slow, slow, True), (slow, fit, False), (fit, slow, False)):
        settled = Settled(stands(now, ()), data, tabulate(data, fit, ()), {})
        found = Found(settled, LAW, LAW, Rest([], np.zeros(0), LAW, 0.0), None, nominal)
        assert found.coasting.tolist() == [coasting, coasting]


def test_held_rates_are_let_go_once_an_effect_is_found(lagging):
    """A search ended with both rates held at half of what they are."""
    data, free = nominal_fit(lagging)
    held = data._replace(windows=lagging._replace(held=np.array([np.log(1.5), np.log(2.5), 0.0, 0.0])))
    fit = refit(held, free.vector, free.starts, ("motor_lag",))
    assert np.exp(fit.vector[:2]) == pytest.approx([1.5, 2.5])
    prepared = SimpleNamespace(windows=lagging, nominal=free)
    for effects, found in ((("motor_lag",), True), ((), False)):
        settled = Settled(stands(fit, effects), held, tabulate(held, fit, effects), {})
        gone = let_go(prepared, Found(settled, LAW, LAW, Rest([], np.zeros(0), LAW, 0.0), None, fit))
        assert (gone is not None) == found
        if found:
            assert gone.settled.now.effects == ("motor_lag",)
            assert np.exp(gone.settled.now.fit.vector[:2]) == pytest.approx([3.0, 5.0], rel=0.05)


def test_a_refit_that_begins_at_a_robot_that_runs_away_begins_without_coupling():
    """Couplings of 2,000 make speeds grow by e every half a millisecond: within a window they leave every number."""
    data, nominal = nominal_fit(windows_of(VECTOR))
    wild = nominal.vector.copy()
    wild[[NOMINAL.index("coupling_1"), NOMINAL.index("coupling_2")]] = 2000.0
    found = refit(data, wild, nominal.starts, ())
    assert found.cost == pytest.approx(nominal.cost, abs=0.1)
    assert np.all(np.isfinite(found.covariance))
