"""Names that discovered laws make needless."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.diagnoses import made_up
from support.small_robot import LAW, nominal_fit, robot_with, windows_of

from jaxident.diagnosis.account.needless import _owners, _without_laws, needless
from jaxident.diagnosis.diagnose import worse
from jaxident.diagnosis.discovery.fit import Bending, Curve, refit_with
from jaxident.diagnosis.fit.refit import refit
from jaxident.diagnosis.laws.kinds import Kind

AT = np.linspace(-1.0, 1.0, 10)
LAW_OF_PUSH = Curve(Kind("push of each wheel", "1", "own push"), (AT,), np.zeros(10), np.zeros(10), 1e-2, np.ones(10))


@pytest.fixture(scope="module")
def turning():
    """Windows of a robot that loses speed in turns, and whose wheels turn faster forward than backward."""
    sizes = {("turn_loss", "loss"): 0.3, ("direction_gain", "right"): 0.1, ("direction_gain", "left"): 0.1}
    return windows_of(robot_with(sizes))


def found(windows, names):
    """A finding of some effects."""
    data, nominal = nominal_fit(windows)
    fit = refit(data, nominal.vector, nominal.starts, names)
    return SimpleNamespace(data=data, selected=names, fit=fit)


def without_need(windows, names):
    """Of some effects, beside a law of each wheel's own push, those that nothing speaks for."""
    finding = found(windows, names)
    fit, curves, covariance = refit_with(finding.data, finding.fit, (LAW_OF_PUSH,))
    return needless(finding, Bending(fit, curves, covariance, LAW))


@pytest.mark.slow
def test_a_true_effect_stays_and_a_false_one_goes(turning):
    assert without_need(turning, ("turn_loss", "quadratic_drag")) == ("quadratic_drag",)


@pytest.mark.slow
def test_an_effect_in_whose_place_the_law_acts_stays(turning):
    assert without_need(turning, ("direction_gain",)) == ()


@pytest.mark.slow
def test_an_effect_that_the_law_explains_far_better_goes(turning):
    assert "input_saturation" in LAW_OF_PUSH.kind.effects
    assert without_need(turning, ("turn_loss", "input_saturation")) == ("input_saturation",)


@pytest.mark.slow
def test_an_effect_owns_what_it_explains_unless_laws_bring_a_fifth_as_much(turning):
    finding = found(turning, ("turn_loss", "direction_gain"))
    costs = _without_laws(finding.data, finding)
    for brought, owners in ((1.0, {"turn_loss", "direction_gain"}), (1e6, set())):
        assert _owners(costs, costs.together - brought) == owners


def test_where_wheels_are_measured_all_effects_stay():
    windows = SimpleNamespace(wheels=np.zeros(3))
    finding = SimpleNamespace(data=SimpleNamespace(windows=windows), selected=("quadratic_drag",))
    assert needless(finding, None) == ()


def test_a_gap_that_is_larger_by_more_than_chance_is_worse():
    gap = made_up("effects").gap
    rng = np.random.default_rng(0)
    errors = 4.0 + rng.uniform(size=gap.errors.shape)
    near, far = (gap._replace(errors=factor * errors) for factor in (1.0, 2.0))
    assert worse(far, near, 0)
    assert not worse(near, far, 0)
    assert not worse(near, near, 0)
