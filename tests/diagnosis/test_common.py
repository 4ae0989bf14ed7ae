"""Which sets explain robot and simulator together, from candidates that are made up."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.diagnoses import made_up

from jaxident.diagnosis import common
from jaxident.diagnosis.causes.candidates import Candidate
from jaxident.diagnosis.causes.corrector import Term
from jaxident.diagnosis.causes.search import Solution
from jaxident.diagnosis.common import explain_together, lacks, shared_worth, shows
from jaxident.effects.coordinates import PLACES, free_places, neutral_vector

TERM = Term("drive", "v^3 in the acceleration along")
PRICE = 9.0


def fit(effects, size=0.0, deviation=0.01, gain=0.0):
    """A candidate with every coordinate of its effects `size` away from neutral."""
    vector, places = neutral_vector(np.ones(10)), free_places(effects)
    vector[places[10:]] += size
    covariance = deviation**2 * np.eye(len(places))
    return Candidate(effects, Solution(vector, None, places, None, 0.0, covariance, 1), gain)


NOTHING = {(): fit(())}


def search(gains, selected, term=0.0):
    """A search with candidates of some gains, all effects of size 0.1, and a term that it leaves unexplained."""
    candidates = {effects: fit(effects, 0.1, gain=gain) for effects, gain in {(): 0.0, **gains}.items()}
    use = SimpleNamespace(use=np.ones(10, bool), windows=None)
    found = made_up("effects").finding._replace(candidates=candidates, selected=selected, data=use)
    return found._replace(terms=[(TERM, term)] if term else [])


@pytest.fixture
def together(monkeypatch):
    """Robot and simulator explained by the sets that they have; nothing is refitted."""
    monkeypatch.setattr(common, "one_more", lambda finding, selected: finding)
    monkeypatch.setattr(common, "_with_set", lambda finding, effects, begin, other: finding)
    monkeypatch.setattr(common, "_reselected", lambda finding, selected: finding._replace(selected=selected))
    return explain_together


def test_what_the_robot_has_alone_is_missing(together):
    robot = search({("slope",): 400.0, ("turn_loss",): 100.0, ("turn_loss", "slope"): 600.0}, ("turn_loss", "slope"))
    found = together(robot, search({("turn_loss",): 200.0, ("slope",): 5.0}, ("turn_loss",)))
    assert found.robot.selected == ("turn_loss", "slope")
    assert found.simulator.selected == ("turn_loss",)
    assert found.missing == ("slope",)


def test_the_same_gap_made_up_differently_is_no_difference(together):
    """Each alone takes another set; with one effect for both the evidence falls less than two differences cost."""
    robot = search({("turn_loss",): 300.0, ("mass_offset",): 290.0}, ("turn_loss",))
    simulator = search({("mass_offset",): 200.0, ("turn_loss",): 190.0}, ("mass_offset",))
    found = together(robot, simulator)
    assert found.robot.selected == found.simulator.selected
    assert found.missing == ()


def test_an_effect_that_does_nothing_in_the_simulator_s_logs_is_the_robot_s_alone(together):
    """A payload that comes after the last run of the simulator fits its logs as well as none."""
    robot, simulator = search({("payload_change",): 400.0}, ("payload_change",)), search({("payload_change",): 0.0}, ())
    nothing = fit(("payload_change",), 0.1, deviation=1e100)
    found = together(robot, simulator._replace(candidates=simulator.candidates | {("payload_change",): nothing}))
    assert found.robot.selected == ("payload_change",)
    assert found.simulator.selected == ()
    assert found.missing == ("payload_change",)


def test_an_instant_that_seems_well_known_is_no_change():
    """Of two coordinates, loss and instant, the second says nothing where the first is within its error."""
    faint = fit(("payload_change",), 0.1, gain=50.0)
    k = faint.solution.places.index(PLACES["payload_change", "loss"])
    assert shows("payload_change", faint, NOTHING)
    faint.solution.covariance[k, k] = 0.1**2
    assert not shows("payload_change", faint, NOTHING)


def test_a_limit_at_the_largest_command_is_none():
    """Its size is far from neutral and well known, but it gains nothing beyond what stands beside it."""
    both = fit(("slope", "input_saturation"), -900.0, gain=500.0)
    assert shows("input_saturation", both, NOTHING | {("slope",): fit(("slope",), gain=300.0)})
    assert not shows("input_saturation", both, NOTHING | {("slope",): fit(("slope",), gain=499.0)})


def test_a_coordinate_that_logs_say_nothing_about_hides_no_other():
    """The spin of a wheel that does not slide has an enormous variance beside a limit that is well known."""
    known = fit(("traction_limit",), 0.1)
    k = known.solution.places.index(PLACES["traction_limit", "spin"])
    known.solution.covariance[k, k] = 1e212
    assert shows("traction_limit", known._replace(gain=50.0), NOTHING)
    assert lacks("traction_limit", fit(("traction_limit",), 0.0), known, PRICE)


def test_steps_of_a_command_that_both_have_are_no_difference(together):
    """Their size is looked for on a grid: the search has no variance of it."""
    found = together(*(search({("input_quantisation",): 100.0}, ("input_quantisation",)) for _ in range(2)))
    assert found.robot.selected == ("input_quantisation",)
    assert found.missing == ()


def test_a_difference_must_be_worth_more_than_what_both_leave_unexplained(together):
    def missing(term):
        robot = search({("turn_loss",): 300.0, ("turn_loss", "slope"): 360.0}, ("turn_loss", "slope"), term)
        return together(robot, search({("turn_loss",): 200.0}, ("turn_loss",), 100.0)).missing

    assert missing(term=0.0) == ("slope",), "the robot alone leaves nothing"
    assert missing(term=80.0) == ()


def test_an_effect_of_both_is_paid_for_once():
    assert shared_worth(("slope",), (), PRICE) == -PRICE
    assert shared_worth(("slope",), ("slope",), PRICE) == 4.0 * 2 - 9.0  # two coordinates, and to be claimed


def test_beside_others_an_effect_of_one_alone_pays_for_the_terms_left_in_its_own_logs():
    own, pair = 50.0, ("slope", "turn_loss")
    assert shared_worth(pair, (), PRICE, (own, PRICE)) == -PRICE - own
    assert shared_worth(pair, ("slope",), PRICE, (own, PRICE)) == 4.0 * 2 - 9.0 - own
    assert shared_worth(("slope",), ("turn_loss",), PRICE, (own, own)) == -2.0 * PRICE
    assert shared_worth((), pair, PRICE, (own, PRICE)) == -2.0 * PRICE


def test_the_same_effect_of_another_size_is_a_parameter_and_hardly_any_of_it_a_difference():
    large, half, little = (fit(("transport_delay",), size) for size in (0.1, 0.06, 0.02))
    assert not lacks("transport_delay", large, large, PRICE)
    assert not lacks("transport_delay", half, large, PRICE)
    assert lacks("transport_delay", little, large, PRICE)
    assert not lacks("transport_delay", large, little, PRICE), "it has more of it, which is none of the robot's effects"
    unsure = fit(("transport_delay",), 0.02, deviation=0.05)
    assert not lacks("transport_delay", unsure, large, PRICE), "a common size costs hardly anything"


def test_what_an_effect_takes_up_is_not_held_against_it(monkeypatch, together):
    """The robot leaves a term worth 400, and an effect found beside the pair takes all of it for 500: a price of twice
    the term, as it was before, would keep that effect out."""
    pair, searched = ("turn_loss", "slope"), []

    def one_more(finding, selected):
        searched.append((bool(finding.terms), selected))
        more = fit(pair, 0.1, gain=800.0)
        return finding._replace(candidates=finding.candidates | {pair: more}) if finding.terms else finding

    def reselected(finding, selected):
        return finding._replace(selected=selected, terms=[] if selected == pair else finding.terms)

    monkeypatch.setattr(common, "one_more", one_more)
    monkeypatch.setattr(common, "_reselected", reselected)
    robot, simulator = search({("turn_loss",): 300.0}, ("turn_loss",), 400.0), search({("turn_loss",): 200.0}, ())
    found = together(robot, simulator._replace(selected=("turn_loss",)))
    assert found.robot.selected == pair
    assert found.missing == ("slope",)
    assert len(set(searched)) == len(searched) == 3, "the robot beside both its sets, the simulator beside one"


def test_sets_that_grew_apart_are_tried_in_the_other_s_logs(monkeypatch):
    """A marker ahead and a slip sideways look alike: each search has taken another, and the robot a slope besides. The
    simulator's set with that slope, tried on the robot's logs as well, leaves the slope alone as the difference."""
    costs = {("marker_offset", "slope"): -590.0, ("marker_offset",): -400.0, ("lateral_slip", "slope"): -250.0}

    def refit(data, vector, starts, effects):
        return fit(effects, 0.1).solution._replace(cost=costs.get(effects, 0.0))

    monkeypatch.setattr(common, "one_more", lambda finding, selected: finding)
    monkeypatch.setattr(common, "_reselected", lambda finding, selected: finding._replace(selected=selected))
    monkeypatch.setattr(common, "refit", refit)
    robot = search({("lateral_slip", "slope"): 600.0, ("slope",): 100.0}, ("lateral_slip", "slope"))
    simulator = search({("marker_offset",): 300.0}, ("marker_offset",))
    nominal = fit(()).solution
    found = explain_together(robot._replace(nominal=nominal), simulator._replace(nominal=nominal))
    assert set(found.robot.selected) == {"marker_offset", "slope"}
    assert found.missing == ("slope",)


def test_what_robot_and_simulator_share_is_refitted_on_its_own(monkeypatch):
    """The gap is measured from there: without that set among the candidates it would begin from the nominal model."""
    monkeypatch.setattr(common, "one_more", lambda finding, selected: finding)
    monkeypatch.setattr(common, "_crossed", lambda finding, own, other, theirs: finding)
    monkeypatch.setattr(common, "_reselected", lambda finding, selected: finding._replace(selected=selected))
    monkeypatch.setattr(common, "refit", lambda data, vector, starts, effects: fit(effects, 0.1).solution)
    shared = ("turn_loss", "transport_delay")
    robot = search({(*shared, "slope"): 900.0}, (*shared, "slope"))
    more = (*shared, "heading_offset")
    simulator = search({more: 500.0}, more)
    nominal = fit(()).solution
    found = explain_together(robot._replace(nominal=nominal), simulator._replace(nominal=nominal))
    assert found.missing == ("slope",)
    assert shared in found.robot.candidates
