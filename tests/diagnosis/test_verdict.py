"""Probabilities from evidence that is made up."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.diagnoses import made_up

from jaxident.diagnosis.causes.candidates import Candidate
from jaxident.diagnosis.causes.corrector import Term
from jaxident.diagnosis.diagnose import decide
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.simulator import Simulator
from jaxident.diagnosis.verdict import alike, judge, slip_of_drive, unexplained_probability

NONE: dict[str, float] = {}
GAP = made_up("effects").gap
OPEN = GAP._replace(after=GAP.refitted)

DRIVE = np.array([1.0, 1.5, 0.5, 0.5, 5.0, -5.0])


def finding(gains, selected, terms=()):
    """A search with candidates of some gains, which drive alike."""
    found, fit = made_up("effects").finding, SimpleNamespace(vector=DRIVE)
    candidates = {effects: Candidate(effects, fit, gain) for effects, gain in {(): 0.0, **gains}.items()}
    return found._replace(candidates=candidates, selected=selected, terms=list(terms))


def whole(judgement):
    return sum(p for _, p in judgement.sets)


def test_a_large_gain_names_its_effect():
    found = judge(finding({("slope",): 500.0, ("turn_loss",): 30.0}, ("slope",)), GAP, NONE)
    assert abs(whole(found) - 1.0) < 1e-9
    assert found.causes[0].effect == "slope"
    assert found.causes[0].probability > 0.99
    assert found.sites["contact"] > 0.99


def test_gains_by_chance_are_no_effect():
    found = judge(finding({("slope",): 4.0, ("turn_loss",): 5.0}, ()), GAP, NONE)
    assert found.none > 0.95
    assert abs(whole(found) - 1.0) < 1e-9


def test_effects_nearly_as_good_are_named_together():
    found = finding({("transport_delay",): 503.0, ("motor_lag",): 500.0, ("slope",): 400.0}, ("transport_delay",))
    assert alike(found, "transport_delay") == ("motor_lag",)
    assert (
        alike(finding({("transport_delay",): 503.0, ("motor_lag",): 450.0}, ("transport_delay",)), "transport_delay")
        == ()
    )


def test_half_a_per_cent_of_all_that_is_explained_is_no_proof():
    """A robot's own friction is neither form of the catalogue: what decides between them may be only that."""
    pair = ("coulomb_friction",), ("stiction",)

    def of(gain, apart):
        found = finding(dict(zip(pair, (gain, gain + apart), strict=True)), ("stiction",))
        return alike(found, "stiction"), judge(found, GAP, NONE).causes[0].probability

    assert of(5000.0, 25.0) == (("coulomb_friction",), pytest.approx(0.8, abs=0.15))
    others, probability = of(5000.0, 250.0)
    assert others == ()
    assert probability > 0.99


def test_a_further_effect_must_bring_a_part_of_all_that_is_explained():
    def evidence(gain):
        return Candidate(("gain_drift", "dead_zone_drift"), None, gain).evidence

    first = Candidate(("gain_drift",), None, 10000.0).evidence
    assert evidence(10060.0) < first
    assert evidence(10150.0) > first


def test_what_the_corrector_explains_beside_a_poor_effect_is_unknown():
    term = (Term("drive", "v^3 in the acceleration along"), 400.0)
    found = finding({("slope",): 300.0}, ("slope",), [term])
    assert unexplained_probability(found, GAP) > 0.95
    assert judge(found, GAP, NONE).sites["drive"] > 0.9
    assert unexplained_probability(finding({("slope",): 9000.0}, ("slope",), [term]), GAP) < 0.05
    assert unexplained_probability(finding({}, (), [(term[0], 10.0)]), GAP) < 0.2


def test_what_the_corrector_explains_as_well_makes_a_further_effect_doubtful():
    """The second brings 125; the largest term left could take up twice 10 or twice 80 of it."""
    pair, term = ("supply_sag", "transport_delay"), Term("drive", "v^3 in the acceleration along")
    for left, likely in ((10.0, pair), (80.0, pair[:1])):
        found = judge(finding({pair[:1]: 5000.0, pair: 5125.0}, likely, [(term, left)]), GAP, NONE)
        assert found.sets[0][0] == likely
        assert found.sets[0][1] > 0.8


def test_a_set_that_stays_in_spite_of_what_is_left_keeps_its_names():
    """A term of 400 is left, which could take up what the second effect brings; no smaller set would leave less, so
    that both are in the corrected model: then both are told, and the rest apart."""
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
    bent = finding({("turn_loss",): 900.0}, ("turn_loss",))._replace(law=Law(1e-3, 5e-3, (0.01, 0.1), 0.2))
    bent = bent._replace(candidates=bent.candidates | {(): Candidate((), SimpleNamespace(vector=0.1 * DRIVE), 0.0)})
    assert slip_of_drive(bent) == pytest.approx(0.01)
    assert slip_of_drive(bent._replace(selected=())) == pytest.approx(0.1)


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
