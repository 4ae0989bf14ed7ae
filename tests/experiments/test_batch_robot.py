"""The batched generator of withheld cases against the slow reference of the package's tests."""

import numpy as np
import pytest
from support.reference_effects import simulate_reference
from withheld.batch_robot.camera import disturbed, mapped
from withheld.batch_robot.commands import BURST, happens
from withheld.batch_robot.outside import LATER, bumped
from withheld.batch_robot.simulate import NEUTRAL, OUTSIDE, simulate
from withheld.protocol.robots import FORMS, form

from jaxident.effects import CATALOGUE

ROBOT = {
    "rate": np.array([2.0, 6.0]),
    "gain": np.array([[0.4, 0.38], [24.0, -25.0]]),
    "coupling": np.array([0.002, -0.3]),
    "dead_zone": np.array([0.12, 0.09]),
}
PERIOD, ROWS = 0.04, 41
START = np.array([0.1, -0.2, 0.5])
CERTAIN = [name for name, entry in CATALOGUE.items() if not (entry.random or entry.poses_only)]
"""These robots measure no wheel speeds, beside which alone a late camera is another thing than a late command."""
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
    assert not (NEUTRAL | OUTSIDE | LATER).keys() & camera


def test_effects_outside_move_the_robot(together):
    sizes = {"cube": 0.3, "drag": 0.3, "right": 0.1, "turns": 30.0, "loss": 0.3, "pull": 0.3}
    moved = batch([{name: {key: sizes.get(key, value) for key, value in law.items()}} for name, law in OUTSIDE.items()])
    assert np.all(np.abs(moved - together[:, :1]).max(axis=(0, 2)) > 1e-3)


LATE = {
    "castor_kick": {"kick": 5.0}, "cogging": {"right": 0.1, "left": 0.1, "turns": 10.0},
    "speed_dependent_delay": {"delay": 0.1}, "weak_braking": {"loss": 0.5},
    "gusts": {"acceleration": 0.2, "every": 0.8}, "bumps": {"rate": 5.0, "along": 0.1, "heading": 1.0},
}  # fmt: skip


def test_later_effects_move_the_robot_and_no_other(together):
    """Beside them a robot without any and one with a payload: bit by bit what they are without such neighbours."""
    plain = [{}, {"payload_change": CATALOGUE["payload_change"].typical()}]
    effects = [*({name: law} for name, law in LATE.items()), *plain]
    moved = batch(effects, rngs=[np.random.default_rng(k) for k in range(len(effects))])
    assert LATE.keys() == LATER.keys()
    assert np.all(np.abs(moved[:, :-2] - together[:, :1]).max(axis=(0, 2)) > 1e-3)
    assert np.array_equal(moved[:, -2:], batch(plain))


def test_later_effects_at_nought_are_nothing():
    zero = {"kick": 0.0, "right": 0.0, "left": 0.0, "delay": 0.0, "loss": 0.0, "acceleration": 0.0, "rate": 0.0}
    effects = [{name: {key: zero.get(key, value) for key, value in law.items()} for name, law in LATE.items()}]
    still = batch(effects, rngs=[np.random.default_rng(1)])
    assert np.abs(still - batch([{}])).max() < 1e-14


def test_castors_kick_after_a_reversal_alone():
    """Straight ahead, back at row 15: the heading stays until the robot rolls back, then turns to the kick's side."""
    straight = ROBOT | {"gain": np.array([[0.4, 0.4], [24.0, -24.0]]), "dead_zone": np.zeros(2)}
    straight["coupling"] = np.zeros(2)
    command = np.where(np.arange(ROWS) < 15, 0.8, -0.8)[:, None, None] * np.ones((1, 2))
    found = simulate(
        [straight], [{"castor_kick": {"kick": 4.0, "fade": 0.2}}], np.array([PERIOD]), command, START[None], np.zeros(1)
    )[:, 0]
    back = int(np.argmax((found[:, :2] - START[:2]) @ [np.cos(0.5), np.sin(0.5)]))
    assert 15 < back < ROWS - 10
    assert np.abs(found[: back - 1, 2] - START[2]).max() < 1e-9
    assert found[-1, 2] < START[2] - 0.05  # to the sign of v


def test_bumps_come_at_their_rate_and_jump_as_far():
    """Within five standard errors: 2000 rows of 0.04 s at 5 a second."""
    law = {"bumps": {"rate": np.array([5.0]), "along": np.array([0.1]), "heading": np.array([2.0])}}
    found = bumped(law, np.array([PERIOD]), np.zeros((2000, 1, 2)), [np.random.default_rng(1)])[:, 0] * PERIOD
    hit = np.any(found != 0.0, axis=1)
    assert abs(hit.sum() - 400) < 5 * np.sqrt(400 * 0.8)
    assert found[hit].std(axis=0) == pytest.approx([0.1, 2.0], rel=5 / np.sqrt(2 * 400))
    assert np.array_equal(bumped(law, np.array([PERIOD]), np.ones((9, 1, 2)), None), np.ones((9, 1, 2)))


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
