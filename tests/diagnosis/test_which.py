"""Which set of effects is chosen, from candidates that are made up."""

from types import SimpleNamespace

import numpy as np
import pytest

from jaxident.diagnosis.causes import sets, which
from jaxident.diagnosis.causes.candidates import ELSEWHERE, FORM, Candidate, form_price
from jaxident.diagnosis.causes.corrector import Term
from jaxident.diagnosis.noise.law import Law
from jaxident.effects.coordinates import SIZE

FIRST, SECOND, OTHER = "turn_loss", "supply_sag", "transport_delay"


@pytest.fixture
def exchange(monkeypatch):
    """The set chosen from sets and their gains; nothing further is tried."""
    monkeypatch.setattr(sets, "scores_of", lambda data, solution, without: {})
    monkeypatch.setattr(sets, "refit_each", lambda found, data, begin, names, beside: None)

    def chosen(gains, selected):
        found = {effects: Candidate(effects, None, gain) for effects, gain in {(): 0.0, **gains}.items()}
        return sets.exchange(found, None, selected, ())

    return chosen


def test_a_set_that_is_worth_its_effects_stays(exchange):
    gains = {(FIRST,): 1000.0, (SECOND,): 900.0, (FIRST, SECOND): 1200.0}
    assert exchange(gains, (FIRST, SECOND)) == (FIRST, SECOND)


def test_an_effect_that_brings_less_than_its_price_is_left_out(exchange):
    """Its coordinate costs 4, the form of another at its site 10, to be claimed 9: 35 is enough, 20 is not."""
    assert exchange({(OTHER,): 1000.0, (SECOND,): 900.0, (OTHER, SECOND): 1035.0}, (OTHER, SECOND)) == (OTHER, SECOND)
    assert exchange({(OTHER,): 1000.0, (SECOND,): 900.0, (OTHER, SECOND): 1020.0}, (OTHER, SECOND)) == (OTHER,)


def test_the_first_gives_way_to_one_that_fits_better_beside_the_second(exchange):
    gains = {(FIRST,): 1000.0, (SECOND,): 900.0, (FIRST, SECOND): 1200.0, (SECOND, OTHER): 1400.0}
    assert exchange(gains, (FIRST, SECOND)) == (SECOND, OTHER)


def test_a_single_effect_has_nothing_to_exchange(exchange):
    assert exchange({(FIRST,): 30.0, (SECOND,): 40.0}, (FIRST,)) == (FIRST,)


def test_what_may_be_the_form_of_another_costs_more():
    """A second effect at a site that the set has already pays 1 % of what is explained, elsewhere 0.1 %."""
    base = {("supply_sag",): 10_000.0}
    same, other = ("supply_sag", "motor_lag"), ("supply_sag", "turn_loss")
    price = {
        effects: Candidate(effects, None, gain).evidence for effects, gain in {same: 10_100.0, other: 10_100.0}.items()
    }
    alone = Candidate(("supply_sag",), None, base[("supply_sag",)]).evidence
    assert price[same] - alone == pytest.approx(100.0 - 4.0 - 101.0)
    assert price[other] - alone == pytest.approx(100.0 - 4.0 - 10.1)


def test_three_effects_pay_for_each_beyond_the_first():
    assert form_price(()) == form_price((FIRST,)) == 0.0
    assert form_price((FIRST, SECOND, OTHER)) == pytest.approx(FORM + ELSEWHERE)
    assert form_price(("heading_offset", "lens_distortion")) == ELSEWHERE, "one site, but geometry has one form"
    assert form_price(("camera_tilt", "lens_distortion")) == FORM


@pytest.mark.parametrize(
    ("left", "alone", "selected"),
    [(40.0, 40.0, (FIRST, OTHER)), (80.0, 80.0, (FIRST,)), (80.0, 4e3, (FIRST, OTHER)), (4e3, 4e3, (FIRST, OTHER))],
)
def test_a_further_effect_must_be_worth_two_of_the_terms_that_are_left(monkeypatch, left, alone, selected):
    """It brings 125 less 4 for its coordinate and 10 for form; the largest term that both leave, or the first alone,
    brings 40, 80, or so much that the gap is unknown: then both stay."""
    term = Term("drive", "v^3 in the acceleration along")
    monkeypatch.setattr(which, "resized", lambda solution, data, responses, law, *rest: law)

    def unexplained(data, solution, *rest):
        return [(term, left if len(solution.effects) > 1 else alone), (term, 20.0)], Law(1.0, 1.0)

    monkeypatch.setattr(which, "unexplained", unexplained)
    gains = {(): 0.0, (FIRST,): 10_000.0, (OTHER,): 9_000.0, (FIRST, OTHER): 10_125.0}
    found = {e: Candidate(e, SimpleNamespace(effects=e), gain) for e, gain in gains.items()}
    finding = which._defended(which.Search(found, None, None, Law(1.0, 1.0), (FIRST, OTHER)), True)
    assert finding.selected == selected
    assert finding.further == 2.0 * (left if selected == (FIRST, OTHER) else alone)


def test_the_rival_is_the_best_set_of_one_effect_more_whatever_its_form_costs():
    """It is looked for before the price of forms: under a law that took it for noise it gains too little for that."""
    gains = {(): 0.0, (FIRST,): 10_000.0, (SECOND,): 900.0, (FIRST, SECOND): 10_020.0, (OTHER, SECOND): 20_000.0}
    found = {effects: Candidate(effects, None, gain) for effects, gain in gains.items()}
    assert which._rival(found, (FIRST,)).effects == (FIRST, SECOND)
    found[FIRST, SECOND] = Candidate((FIRST, SECOND), None, 10_010.0)
    assert which._rival(found, (FIRST,)) is None


def test_beside_a_rival_there_is_a_single_effect_left_to_grow_from(exchange, monkeypatch):
    """However many larger sets are better: the search begins with one effect."""
    costs = {(): 900.0, (FIRST,): 700.0, (SECOND,): 800.0, (FIRST, SECOND): 200.0}
    costs |= {(FIRST, SECOND, name): 100.0 for name in ("slope", "motor_lag", "backlash", OTHER)}
    for module in (which, sets):
        monkeypatch.setattr(module, "refit", lambda data, vector, starts, effects: fit(effects))
    monkeypatch.setattr(which, "resized", lambda *args, **options: Law(0.5, 1.0))
    monkeypatch.setattr(which, "whiten", lambda *args: (data, None))
    data = SimpleNamespace(windows=None)

    def fit(effects):
        return SimpleNamespace(cost=costs.get(tuple(effects), 850.0), vector=np.zeros(SIZE), starts=None)

    found = {effects: Candidate(effects, fit(effects), 900.0 - cost) for effects, cost in costs.items()}
    now = which.Search(found, data, None, Law(1.0, 1.0), (FIRST, SECOND))
    assert set(which._beside_rival(now, ()).selected) >= {FIRST, SECOND}
