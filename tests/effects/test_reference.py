"""Each effect against an independent simulator: plain floats, small steps, events by bisection, no shared code."""

import jax
import numpy as np
import pytest
from support.effect_robots import ROBOT, START, drive_log, full, poses, typical
from support.reference_effects import simulate_reference

import jaxident as ji
from jaxident.effects import CATALOGUE, to_vector
from jaxident.effects.full import _keys, substeps_for
from jaxident.robot.model import Effect

PARAMETERS = ROBOT.physical._asdict() | {"dead_zone": ROBOT.dead_zone}
CORNERS = ("coulomb_friction", "stiction", "backlash", "input_rate_limit")
CERTAIN = [name for name, entry in CATALOGUE.items() if not entry.random]
SETS = [(name,) for name in CERTAIN] + [
    ("transport_delay", "motor_lag", "coulomb_friction"),
    ("asymmetric_dead_zone", "input_rate_limit", "quadratic_drag", "lateral_slip", "marker_offset"),
    ("payload_change", "stiction", "gain_drift"),
    ("twist_quantisation", "transport_delay", "command_polling", "payload_change", "motor_lag"),
]


def reference(names, log, **options):
    effects = {name: CATALOGUE[name].typical() for name in names}
    sharp = any(name in CORNERS for name in names)
    command = np.array(log.u_r), np.array(log.u_l)
    return simulate_reference(
        PARAMETERS, effects, log.t, *command, START, **({"step": 1e-3 if sharp else 2e-3} | options)
    )


def tolerance(names):
    """120 samples: position to 1e-6 m, with corners to 1e-4 m, heading to as many radians."""
    return 1e-4 if any(name in CORNERS for name in names) else 1e-6


@pytest.mark.parametrize("names", SETS, ids="+".join)
def test_the_trajectory_is_that_of_the_reference(names):
    """In the program that holds all effects, which is compiled once."""
    log = drive_log()
    found = full(to_vector(typical(*names).effects), log, substeps=substeps_for(frozenset(names)))
    assert np.abs(found - reference(names, log)).max() < tolerance(names)


def test_a_wheel_that_coasts_in_its_play():
    play, log = {"right": 0.03, "left": 0.05, "coasting": 1.0}, drive_log()
    found = full(to_vector([Effect("backlash", play)]), log, substeps=substeps_for(frozenset({"backlash"})))
    command = np.array(log.u_r), np.array(log.u_l)
    wanted = simulate_reference(PARAMETERS, {"backlash": play}, log.t, *command, START, step=1e-3)
    braked = simulate_reference(PARAMETERS, {"backlash": play | {"coasting": 0.0}}, log.t, *command, START, step=1e-3)
    assert np.abs(braked - wanted).max() > 1e-2
    assert np.abs(found - wanted).max() < tolerance(("backlash",))


FORMS = [
    ("input_quantisation", {"step": 0.15}, {"towards_zero": 1.0}),
    ("input_saturation", {"level": 0.6}, {"soft": 1.0}),
    ("input_rate_limit", {"rate": 3.0}, {"falling_ratio": 2.5}),
    ("motor_lag", {"time_constant": 0.15}, {"second_order": 0.9}),
    ("gain_drift", {"rate": -0.02}, {"growth": 1.0}),
    ("dead_zone_drift", {"rate": 0.02}, {"growth": -1.0}),
    ("lens_distortion", {"strength": 0.2, "centre_x": 0.2}, {"edge": 2.0}),
]


@pytest.mark.parametrize(("name", "plain", "form"), FORMS, ids=[name for name, *_ in FORMS])
def test_the_other_forms_of_effects(name, plain, form):
    log, law = drive_log(), plain | form
    found = full(to_vector([Effect(name, law)]), log, substeps=substeps_for(frozenset({name})))
    command = np.array(log.u_r), np.array(log.u_l)
    wanted, other = (
        simulate_reference(PARAMETERS, {name: each}, log.t, *command, START, step=1e-3) for each in (law, plain)
    )
    assert np.abs(other - wanted).max() > 1e-3
    assert np.abs(found - wanted).max() < tolerance((name,))


@pytest.mark.parametrize("spin", [0.0, 0.02])
def test_a_dry_wheel_that_slides(spin):
    law, log = {"limit": 0.5, "dry": 1.0, "spin": spin}, drive_log()
    found = full(to_vector([Effect("traction_limit", law)]), log, substeps=substeps_for(frozenset({"traction_limit"})))
    command = np.array(log.u_r), np.array(log.u_l)
    wanted, yields = (
        simulate_reference(PARAMETERS, {"traction_limit": each}, log.t, *command, START, step=1e-3)
        for each in (law, {"limit": 0.5})
    )
    assert np.abs(yields - wanted).max() > 0.3
    assert np.abs(found - wanted).max() < 1e-4


@pytest.mark.parametrize("names", [pytest.param(s, marks=[pytest.mark.slow] * (len(s) == 1)) for s in SETS])
def test_a_program_of_these_effects_alone_does_the_same(names):
    log = drive_log()
    found = poses(ji.simulate(typical(*names), log, start=START))
    assert np.abs(found - reference(names, log)).max() < tolerance(names)


UNEVEN = [("transport_delay",), ("payload_change",), ("motor_lag", "slope"), ("command_polling", "transport_delay")]


@pytest.mark.parametrize("names", UNEVEN, ids="+".join)
def test_uneven_steps(names):
    log = drive_log(even=False)
    found = poses(ji.simulate(typical(*names), log, start=START, session_time=1.0))
    assert np.abs(found - reference(names, log, session_time=1.0)).max() < 1e-4


@pytest.mark.parametrize("name", [name for name, entry in CATALOGUE.items() if entry.random])
def test_random_effects_have_the_reference_s_statistics(name):
    """Mean squared departure from the undisturbed path over 64 runs each, within four standard errors of the
    difference; these come from the spread over runs, since rows of a run depend on each other."""
    log = drive_log(61)
    base = reference((), log, step=0.05)
    keys = jax.random.split(jax.random.key(0), 64)
    model = typical(name)
    ours = [poses(ji.simulate(model, log, start=START, key=key)) - base for key in keys]
    theirs = [reference((name,), log, rng=np.random.default_rng(k), step=0.05) - base for k in range(64)]
    squares = [np.mean(np.square(each), axis=1) for each in (ours, theirs)]
    error = np.sqrt(sum(np.var(each, axis=0, ddof=1) / 64 for each in squares))
    assert np.all(squares[1].mean(axis=0) > 0)
    assert np.all(np.abs(squares[0].mean(axis=0) - squares[1].mean(axis=0)) < 4.0 * error)


class _Replay:
    """A generator whose uniform draws are given."""

    def __init__(self, draws):
        self.draws = iter(draws)

    def random(self):
        return float(next(self.draws))


def test_lost_commands_are_those_of_the_reference_row_by_row():
    """With the same draws, of which the first row needs none."""
    log, key = drive_log(), jax.random.key(4)
    draws = np.asarray(jax.random.uniform(_keys(key)[0], (len(log.t),)))
    expected = reference(("lost_commands",), log, rng=_Replay(draws[1:]))
    found = poses(ji.simulate(typical("lost_commands"), log, start=START, key=key))
    assert np.abs(found - expected).max() < 1e-6
    assert np.abs(found - reference((), log)).max() > 1e-2
