"""Probabilities from evidence that is made up."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from support.diagnoses import discovered_law, finding_of, made_up

from jaxident.diagnosis.causes.discrepancy_basis import Term
from jaxident.diagnosis.decide import decide
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.posterior import alike, judge, lawful_probability, slip_of_drive, unexplained_probability
from jaxident.diagnosis.simulator import Simulator
from jaxident.effects.coordinates import COORDINATES, nominal_vector
from jaxident.robot.drive import Physical

NONE: dict[str, float] = {}
GAP = made_up("effects").gap
OPEN = GAP._replace(after=GAP.refitted)

DRIVE = nominal_vector(Physical(np.exp([1.0, 1.5]), np.array([[0.5, 0.5], [5.0, -5.0]])), np.zeros(2))[:6]


def drives(finding, drive):
    """The finding of a robot with a drive."""
    vector = finding.fit.vector.copy()
    vector[: len(drive)] = drive
    return finding._replace(fit=finding.fit._replace(vector=vector))


def finding(worth, selected, terms=()):
    """A search that ended at a set, by the log evidence of sets beyond that of none; they drive alike."""
    return drives(finding_of(worth, selected, terms), DRIVE)


def whole(judgement):
    return sum(p for _, p in judgement.sets)


def test_a_large_gain_names_its_effect():
    found = judge(finding({("slope",): 500.0, ("turn_loss",): 30.0}, ("slope",)), GAP, NONE)
    assert abs(whole(found) - 1.0) < 1e-9
    assert found.causes[0].effect == "slope"
    assert found.causes[0].probability > 0.99
    assert found.sites["contact"] > 0.99


def test_a_confirmed_law_is_something_that_no_name_covers_unless_an_effect_acts_in_its_place():
    law = discovered_law()
    for names, told in (((), 0.95), (("slope",), 0.95), (("turn_loss",), 0.0)):
        found = [judge(finding({names: 500.0}, names), GAP, NONE, None, laws) for laws in ((), (law,))]
        assert found[1].unexplained > told
        assert (found[1].unexplained > found[0].unexplained + 0.5) == bool(told)
    assert 0.99 < lawful_probability([law._replace(p_value=0.0)], ()) < 1.0
    assert lawful_probability([law._replace(share=0.01)], ()) == 0.0


def test_probabilities_are_those_of_the_log_evidence():
    found = judge(finding({("slope",): -4.0, ("turn_loss",): -3.0, ("slope", "turn_loss"): -6.0}, ()), GAP, NONE)
    odds = np.exp([0.0, -3.0, -4.0, -6.0])
    np.testing.assert_allclose([p for _, p in found.sets], odds / odds.sum(), rtol=1e-9)
    assert found.none == pytest.approx(1.0 / odds.sum())
    causes = {cause.effect: cause.probability for cause in found.causes}
    assert causes == pytest.approx({"turn_loss": odds[[1, 3]].sum() / odds.sum(), "slope": odds[2:].sum() / odds.sum()})


def test_effects_nearly_as_good_are_named_together():
    """What the input cannot tell apart: sets of as many effects whose log evidence is within 3."""
    delay = ("transport_delay",)

    def rivals(lag):
        found = finding({delay: 503.0, ("motor_lag",): lag, ("slope",): 400.0}, delay)
        return alike(found, "transport_delay"), judge(found, GAP, NONE).causes

    others, causes = rivals(502.0)
    assert others == ("motor_lag",)
    assert causes[0].indistinguishable_from == ("motor_lag",)
    assert [c.effect for c in causes] == ["transport_delay", "motor_lag"]
    odds = np.exp(1.0)
    np.testing.assert_allclose([c.probability for c in causes], [odds / (1.0 + odds), 1.0 / (1.0 + odds)], rtol=1e-6)
    others, causes = rivals(450.0)
    assert others == ()
    assert causes[0].probability > 0.999


def test_a_look_alike_stands_in_for_one_effect_beside_the_same_others():
    pair = ("turn_loss", "transport_delay")
    found = finding({pair: 900.0, ("turn_loss", "motor_lag"): 899.0, ("motor_lag",): 899.0}, pair)
    assert alike(found, "transport_delay") == ("motor_lag",)
    assert alike(found, "turn_loss") == ()
    assert alike(found, "motor_lag") == (), "it is not in the set"


def test_sets_add_up_to_one_whatever_is_left_out_of_the_list():
    """Hundreds of neighbours with next to no evidence each are not listed; the listed ones add up all the same."""
    others = [(a, b) for a, b in itertools.combinations(COORDINATES, 2) if "slope" not in (a, b)]
    found = judge(finding({("slope",): 500.0} | dict.fromkeys(others, 489.0), ("slope",)), GAP, NONE)
    assert len(found.sets) == 1
    assert whole(found) == pytest.approx(1.0, abs=1e-9)


def test_what_the_corrector_explains_beside_a_poor_effect_is_unknown():
    term = (Term("drive", "v^3 in the acceleration along"), 400.0)
    found = finding({("slope",): 300.0}, ("slope",), [term])
    assert unexplained_probability(found, GAP) > 0.95
    assert judge(found, GAP, NONE).sites["drive"] > 0.9
    assert unexplained_probability(finding({("slope",): 20000.0}, ("slope",), [term]), GAP) < 0.05
    assert unexplained_probability(finding({}, (), [(term[0], 10.0)]), GAP) < 0.2


def test_a_set_that_stays_in_spite_of_what_is_left_keeps_its_names():
    """A term of 400 is left, more than the second effect brings: both are told, and the rest apart."""
    pair, term = ("turn_loss", "transport_delay"), Term("contact", "v w in the speed sideways")
    found = judge(finding({pair[:1]: 900.0, pair: 1200.0}, pair, [(term, 400.0)]), GAP, NONE)
    assert {cause.effect for cause in found.causes} == set(pair)
    assert min(cause.probability for cause in found.causes) > 0.99
    assert found.unexplained > 0.5


def test_frames_that_lie_are_an_effect_by_themselves():
    found = judge(finding({}, ()), GAP, {"frozen_frames": 300.0})
    assert found.none < 0.01
    assert found.causes[0].effect == "frozen_frames"


def test_what_the_simulator_has_too_is_no_gap():
    found = judge(finding({("slope",): 500.0}, ("slope",)), GAP, NONE, Simulator(np.zeros(3), ("slope",)))
    assert found.none > 0.99


def test_errors_beyond_the_floor_on_runs_kept_for_judging_are_unknown():
    found = finding({("slope",): 500.0}, ("slope",))
    assert unexplained_probability(found, GAP) < 0.05
    assert unexplained_probability(found, GAP._replace(errors=10.0 * GAP.errors)) > 0.95


def test_more_slip_than_wheels_have_is_unknown():
    def slipping(part):
        law = Law(1e-3, 5e-3, (part * 1.0, part * 10.0), 0.2)
        return finding({}, ())._replace(law=law)

    assert slip_of_drive(slipping(0.01)) == pytest.approx(0.01)
    assert unexplained_probability(slipping(0.01), OPEN) < 0.05
    found = judge(slipping(0.1), OPEN, NONE)
    assert found.unexplained > 0.95
    assert found.sites["drive"] + found.sites["contact"] > 0.7


def test_slip_that_is_a_small_part_of_what_an_effect_explains_is_not():
    sliding = finding({("traction_limit",): 3000.0}, ("traction_limit",))
    sliding = sliding._replace(law=Law(1e-3, 5e-3, (0.1, 1.0), 0.2))
    assert unexplained_probability(sliding, GAP._replace(refitted=1120.0, after=100.0)) < 0.1
    assert unexplained_probability(sliding, GAP._replace(refitted=1120.0, after=400.0)) > 0.95


def test_slip_is_held_against_the_drive_of_the_robot_and_not_of_a_nominal_model_that_bends():
    law = Law(1e-3, 5e-3, (0.01, 0.1), 0.2)
    robot = finding({("turn_loss",): 900.0}, ("turn_loss",))._replace(law=law)
    bent = drives(robot, [*DRIVE[:2], *(0.1 * DRIVE[2:])])
    assert slip_of_drive(robot._replace(nominal=bent.fit)) == pytest.approx(0.01)
    assert slip_of_drive(bent) == pytest.approx(0.1)


def test_what_the_simulator_leaves_unexplained_too_is_no_difference():
    """The same rest and slip in as many windows of both: nothing unknown lies between them; alone it does."""
    term = (Term("drive", "v^3 in the acceleration along"), 400.0)

    def both(part, rest):
        law = Law(1e-3, 5e-3, (part, part * 10.0), 0.2)
        data = SimpleNamespace(windows=SimpleNamespace(run=np.zeros(10)))
        return finding({("slope",): 300.0}, ("slope",), [(term[0], rest)])._replace(law=law, data=data)

    robot = both(0.1, 400.0)
    assert unexplained_probability(robot, OPEN) > 0.95
    assert unexplained_probability(robot, OPEN, Simulator(np.zeros(3), (), both(0.1, 400.0))) < 0.05
    assert unexplained_probability(robot, OPEN, Simulator(np.zeros(3), (), both(0.1, 40.0))) > 0.95, "terms"
    assert unexplained_probability(robot, OPEN, Simulator(np.zeros(3), (), both(0.01, 400.0))) > 0.95, "slip"


def test_one_stretch_kept_for_judging_decides_nothing():
    found = made_up("effects")

    def verdict(names, judges):
        windows, judging = SimpleNamespace(run=np.zeros(names)), SimpleNamespace(row=np.zeros(judges))
        prepared = found.prepared._replace(windows=windows, judging=judging)
        return decide(prepared, found.judgement, found.selected, found.parameters)

    assert verdict(9, 6) == "effects"
    assert verdict(14, 1) == "undecided"
    assert verdict(5, 6) == "undecided"


def test_a_rest_lowers_no_name():
    """Twice the same evidence for a name, once beside a large rest: two statements."""
    term, judged = Term("drive", "v^3 in the acceleration along"), []
    for terms in ([], [(term, 400.0)]):
        judged.append(judge(finding({("slope",): 900.0}, ("slope",), terms), GAP, NONE))
    alone, beside = judged
    assert beside.causes[0].probability == pytest.approx(alone.causes[0].probability, abs=1e-6)
    assert alone.unexplained < 0.1
    assert beside.unexplained > 0.9
    assert beside.gap > alone.none
    full = made_up("effects")
    prepared = full.prepared._replace(
        windows=SimpleNamespace(run=np.zeros(9)), judging=SimpleNamespace(row=np.zeros(9))
    )
    assert [decide(prepared, one, ("slope",), []) for one in judged] == ["effects", "partly"]
    assert [decide(prepared, one, (), []) for one in judged] == ["no_gap", "unknown"]
