"""Laws that logs cannot show: which signals hardly vary or go together, and that such laws are not looked for."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from jaxident.diagnosis.laws.candidates import Path, candidates
from jaxident.diagnosis.laws.kinds import KINDS, OF_FORCE, Kind
from jaxident.diagnosis.laws.not_shown import FEWEST, NotShown, not_shown, not_shown_along
from jaxident.effects.law_kinds import ALONG, HEADING, WHEELS

GAIN, RATES = np.array([[2.0, 2.0], [20.0, -20.0]]), np.array([5.0, 10.0])
"""Of a robot whose top speeds are 0.8 m/s and 4 rad/s."""


class Few(NamedTuple):
    """Windows of which only the number matters."""

    run: Any


def path_with(**changed: Any) -> Path:
    """A path whose signals go through all that they could, each for itself, but for those that are changed."""
    draw = np.random.default_rng(1).uniform(-1.0, 1.0, (len(OF_FORCE), 20, 30))
    size = {"v": 0.8, "w": 4.0, "heading": np.pi, "since reversal": 0.5}
    signals = {name: size.get(name, 1.0) * part for name, part in zip(OF_FORCE, draw, strict=True)}
    made = {name.replace("_", " "): make(signals) for name, make in changed.items()}
    return Path(signals | made, {}, GAIN, RATES, None, None, None, None)


def test_signals_that_each_go_their_own_way_are_all_shown():
    assert not_shown_along(path_with()) == NotShown()


def test_a_robot_that_goes_straight_does_not_show_its_turn_rate_nor_one_wheel():
    """Its gains differ a little: it turns, by 0.02 of what it could, with its speed."""
    straight = path_with(w=lambda s: 0.1 * s["v"], push_left=lambda s: s["push right"])
    assert not_shown_along(straight) == NotShown(still=("w",), together=(("push right", "push left"),))


@pytest.mark.parametrize(
    ("y", "told"),
    [
        (lambda s: 0.5 * s["x"] - 1.0, (("x", "y"),)),
        (lambda s: s["x"] ** 3 + s["x"], (("x", "y"),)),
        (lambda s: s["x"] ** 2, ()),
        (lambda s: s["x"] + 0.1 * s["y"], ()),
    ],
)
def test_signals_go_together_where_each_follows_from_the_other(y, told):
    """y = x^2 does not tell x, and y = x but for a tenth of it is told apart by many rows."""
    assert not_shown_along(path_with(y=y)).together == told


def test_kinds_by_such_signals_are_not_looked_for_and_others_are():
    found = NotShown(still=("w",), together=(("x", "y"),))
    assert found.hides(Kind(ALONG, "v", "w"))
    assert found.hides(Kind(ALONG, "1", "x", "y"))
    assert found.hides(Kind(HEADING, "w", "y"))
    assert not found.hides(Kind(ALONG, "w", "v"))
    assert not found.hides(Kind(WHEELS, "1", "own push"))
    assert not any(NotShown().hides(kind) for kind in KINDS)


def test_few_windows_show_no_law():
    found = not_shown(None, Few(np.zeros(FEWEST - 1)))
    assert found == NotShown(windows=FEWEST - 1)
    assert all(found.hides(kind) for kind in KINDS)


def test_no_kind_no_candidate():
    assert list(candidates(path_with(), None, ())) == []
