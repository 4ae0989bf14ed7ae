"""The batched generator of withheld cases against the slow reference of the package's tests."""

import numpy as np
import pytest
from support.reference_effects import simulate_reference
from withheld.batch_camera import disturbed, mapped
from withheld.batch_input import BURST, happens
from withheld.batch_robot import NEUTRAL, OUTSIDE, simulate
from withheld.robots import FORMS, form

from jaxident.effects import CATALOGUE

ROBOT = {
    "rate": np.array([2.0, 6.0]),
    "gain": np.array([[0.4, 0.38], [24.0, -25.0]]),
    "coupling": np.array([0.002, -0.3]),
    "dead_zone": np.array([0.12, 0.09]),
}
PERIOD, ROWS = 0.04, 41
START = np.array([0.1, -0.2, 0.5])
CERTAIN = [name for name, entry in CATALOGUE.items() if not entry.random]
SETS = [(), *((name,) for name in CERTAIN), ("payload_change", "stiction", "backlash", "motor_lag", "transport_delay")]


def commands():
    levels = np.random.default_rng(1).uniform(-1.0, 1.0, (-(-ROWS // 8), 2))
    return np.repeat(levels, 8, axis=0)[:ROWS]


def batch(effects, **options):
    runs = len(effects)
    command = np.repeat(commands()[:, None], runs, axis=1)
    return simulate(
        [ROBOT] * runs, effects, np.full(runs, PERIOD), command, np.tile(START, (runs, 1)), np.zeros(runs), **options
    )


@pytest.fixture(scope="module")
def together():
    """All sets in one batch: what one run has must not reach another."""
    return batch([{name: CATALOGUE[name].typical() for name in names} for names in SETS])


@pytest.mark.parametrize("names", SETS, ids=lambda names: "+".join(names) or "none")
def test_a_column_is_the_reference(names, together):
    """To half a millimetre and milliradian over 4 s: dry friction costs most, the others stay below 1e-5."""
    effects = {name: CATALOGUE[name].typical() for name in names}
    expected = simulate_reference(
        ROBOT, effects, PERIOD * np.arange(ROWS), *commands().T, (*START, 0.0, 0.0), step=4e-3
    )
    assert np.abs(together[:, SETS.index(names)] - expected).max() < 6e-4


def test_no_certain_effect_is_missing():
    camera = {name for name, entry in CATALOGUE.items() if entry.site == "camera"}
    assert set(CATALOGUE) - camera == NEUTRAL.keys()
    assert not (NEUTRAL | OUTSIDE).keys() & camera


def test_effects_outside_move_the_robot(together):
    sizes = {"cube": 0.3, "drag": 0.3, "right": 0.1, "turns": 30.0, "loss": 0.3, "pull": 0.3}
    moved = batch([{name: {key: sizes.get(key, value) for key, value in law.items()}} for name, law in OUTSIDE.items()])
    assert np.all(np.abs(moved - together[:, :1]).max(axis=(0, 2)) > 1e-3)


def test_other_forms_are_other_and_alike():
    """Every other form moves the robot apart from the catalogue's, by 1 % to ten times of what the effect does."""
    mechanical = [name for name in FORMS if name in NEUTRAL and name != "lost_commands"]
    effects = [{name: CATALOGUE[name].typical()} for name in mechanical]
    others = [
        {name: own[name] | {"form": form(name, own[name], 4.0)}} for name, own in zip(mechanical, effects, strict=True)
    ]
    rngs = [np.random.default_rng(k) for k in range(len(others))]
    plain, usual, other = (batch(each, rngs=rngs) for each in ([{} for _ in others], effects, others))
    apart = np.abs(other - usual).max(axis=(0, 2))
    moved = np.abs(usual - plain).max(axis=(0, 2))
    ratio = dict(zip(mechanical, apart / moved, strict=True))
    assert all(0.01 < value < 10.0 for value in ratio.values()), ratio


def test_bursts_last_and_have_the_same_share():
    """Within five standard errors of the share, of rows that come in threes; no burst is shorter, but at the end."""
    rows, chance = 60_000, 0.05
    hit = happens(np.random.default_rng(1), rows, chance, bursts=1.0)
    assert abs(hit.mean() - chance) < 5.0 * np.sqrt(3.0 * chance / rows) + chance**2
    edges = np.flatnonzero(np.diff(np.concatenate([[False], hit, [False]]).astype(int)))
    assert np.diff(edges)[::2][:-1].min() == BURST


def test_other_forms_of_the_camera():
    """A lens of the other form bends the edge more and the middle less; a mast that sways swings back."""
    far, near = np.array([[0.8, 0.0, 0.0]]), np.array([[0.1, 0.0, 0.0]])
    usual, other = ({"lens_distortion": {"strength": 0.1, "form": value}} for value in (0.0, 0.16))
    assert mapped(other, far)[0, 0] > mapped(usual, far)[0, 0]
    assert mapped(other, near)[0, 0] < mapped(usual, near)[0, 0]
    law = {"position": 1.0, "heading": 1.0, "correlation_time": 2.0}
    errors = [
        disturbed({"coloured_noise": law | {"form": value}}, 0.04, np.zeros((20_000, 3)), np.random.default_rng(2))
        for value in (0.0, 0.5)
    ]
    half = [np.mean(error[25:] * error[:-25]) for error in errors]  # a second apart: half a swing
    assert half[0] > 0.3
    assert half[1] < -0.3
