"""The Python and the C export against the package's own simulator, on 1,000 commands."""

import dataclasses
import math
from types import MappingProxyType

import numpy as np
import pytest
from support.exported import DIFFERENCE, c_poses, program, python_poses

import jaxident as ji
from jaxident.effects.apply import with_effects
from jaxident.effects.catalogue import CATALOGUE
from jaxident.errors import InputError
from jaxident.export import c_header, python
from jaxident.export.split import values_of
from jaxident.log import make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model

ROWS, PERIOD = 1000, 0.03
DRIVE = Physical(np.array([4.0, 6.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.array([0.02, -1.0]))
PLAIN = Model(PERIOD, DRIVE, np.array([0.1, 0.12]))
SMOOTH, SHARP = 2e-5, 2e-3
"""Largest departure [m, rad] from the simulator after up to 30 s: the programs take a push of each substep for held,
and settle dry friction to first order."""

GROUPS = {
    "none": ((), 1e-8),
    "chain": (("input_saturation", "transport_delay", "asymmetric_dead_zone", "direction_gain", "motor_lag",
               "quadratic_drag", "marker_offset", "heading_offset", "camera_latency"), SMOOTH),
    "clock": (("twist_quantisation", "command_polling", "dead_zone_drift", "gain_drift", "supply_sag", "turn_loss",
               "mass_offset", "lateral_slip", "camera_scale", "lens_distortion"), SMOOTH),
    "gears": (("input_quantisation", "input_rate_limit", "backlash", "slope", "payload_change", "camera_tilt"), 2e-4),
    "rub": (("coulomb_friction", "stiction"), SHARP),
    "grip": (("traction_limit",), SMOOTH),
    "forms": (("input_quantisation", "input_saturation", "gain_drift", "dead_zone_drift"), SMOOTH),
    "ramps": (("input_rate_limit", "motor_lag", "lens_distortion"), 2e-4),
}  # fmt: skip
FORMS = {"input_quantisation": {"towards_zero": 1.0}, "input_saturation": {"soft": 1.0},
         "gain_drift": {"growth": 0.15}, "dead_zone_drift": {"growth": -0.05},
         "input_rate_limit": {"falling_ratio": 0.4}, "lens_distortion": {"edge": 0.3},
         "motor_lag": {"second_order": 0.5}}  # fmt: skip
"""Forms of the effects of the last groups; one drift ends after 20 of 30 s."""


def commands(rows=ROWS, seed=0) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, (-(-rows // 10), 2)), 10, axis=0)[:rows]


def simulated(model, u) -> np.ndarray:
    """Poses after each row of commands."""
    u = np.concatenate([u, u[-1:]])
    log = make_log(float(model.sample_period) * np.arange(len(u)), u[:, 0], u[:, 1])
    return np.stack([np.asarray(column) for column in ji.simulate(model, log).pose], axis=1)[1:]


def robot(names, forms=MappingProxyType({})) -> Model:
    sizes = {name: CATALOGUE[name].typical(ROWS * PERIOD) | forms.get(name, {}) for name in names}
    if "direction_gain" in sizes:
        sizes["direction_gain"] = {"right": -0.08, "left": 0.05}  # a negative number within statements
    return with_effects(PLAIN, sizes.items())


def test_the_groups_hold_every_effect_that_has_statements():
    covered = {name for names, _ in GROUPS.values() for name in names}
    assert covered == {name for name, record in CATALOGUE.items() if record.step is not None}
    assert all((record.step is None) == record.random for record in CATALOGUE.values())


@pytest.mark.parametrize("group", GROUPS)
def test_programs_move_as_the_simulator(group, tmp_path):
    names, bound = GROUPS[group]
    model, u = robot(names, FORMS if group in ("forms", "ramps") else {}), commands()
    own = python_poses(python.write(model, model.effects), u)
    wanted = simulated(model, u)
    assert np.abs(own - wanted).max() < bound
    if names:
        assert np.abs(wanted - simulated(PLAIN, u)).max() > 100.0 * bound  # the effects are there
    np.testing.assert_allclose(c_poses(c_header.write(model, model.effects), u, tmp_path), own, rtol=0.0, atol=1e-10)


def test_difference_equations_are_those_of_the_model(tmp_path):
    physical = dataclasses.replace(PLAIN, dynamics=DRIVE._replace(coupling=None))
    model, u = dataclasses.replace(PLAIN, dynamics=physical.difference), commands()
    own = python_poses(python.write(model, ()), u)
    np.testing.assert_allclose(own, simulated(model, u), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(c_poses(c_header.write(model, ()), u, tmp_path, DIFFERENCE), own, rtol=0.0, atol=1e-10)


def test_a_longer_delay_than_a_row_and_steps_of_other_lengths():
    """Steps of a third of a period hear the same commands."""
    model = with_effects(PLAIN, [("transport_delay", {"delay": 0.107})])
    u = commands(200)
    text = python.write(model, model.effects)
    fine = python_poses(text, u)
    slow = program(text)["Robot"]()
    third = []
    for row in u.tolist():
        for _ in range(3):
            last = slow.step(*row, PERIOD / 3.0)
        third.append(last)
    np.testing.assert_allclose(third, fine, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("names", [(), ("asymmetric_dead_zone",)])
def test_commands_bring_the_robot_to_the_speeds_asked_for(names):
    model = robot(names)
    made = program(python.write(model, model.effects))
    own = made["Robot"]()
    for v, w in ((0.2, 0.5), (-0.1, -1.0), (0.15, 0.0)):
        for _ in range(200):
            own.step(*own.command(v, w))
        assert own.v == pytest.approx(v, abs=1e-6)
        assert own.w == pytest.approx(w, abs=1e-6)
    assert own.goal() == pytest.approx((0.15, 0.0), abs=1e-6)
    assert own.command(0.0, 0.0) == (0.0, 0.0)


def test_feed_forward_follows_a_ramp_without_lag():
    """Speed rises by 0.2 m/s^2; without the feed-forward of acceleration it would be late by 1 / rate."""
    own = program(python.write(PLAIN, ()))["Robot"]()
    for k in range(60):
        middle = PERIOD * (k + 0.5)  # the command is held over the row
        own.step(*own.command(0.2 * middle, 0.0, 0.2, 0.0))
    assert own.v == pytest.approx(0.2 * PERIOD * 60, rel=0.01)


def test_commands_of_difference_equations_hold_the_speeds():
    physical = dataclasses.replace(PLAIN, dynamics=DRIVE._replace(coupling=None))
    own = program(python.write(dataclasses.replace(PLAIN, dynamics=physical.difference), ()))["Robot"]()
    for _ in range(200):
        own.step(*own.command(0.2, -0.6))
    assert (own.length / PERIOD, own.turn / PERIOD) == pytest.approx((0.2, -0.6), abs=1e-9)


def test_an_effect_at_neutral_leaves_no_line():
    model = with_effects(PLAIN, [("transport_delay", {"delay": 0.0}), ("input_saturation", {})])
    assert python.write(model, model.effects) == python.write(PLAIN, ())
    assert math.isinf(values_of(model.effects[1])["level"])


def test_wheels_that_do_the_same_are_refused():
    same = dataclasses.replace(PLAIN, dynamics=DRIVE._replace(gain=np.array([[1.0, 1.0], [2.0, 2.0]])))
    with pytest.raises(InputError, match="both wheels do the same"):
        python.write(same, ())


def test_difference_equations_that_never_come_to_rest_are_refused():
    difference = PLAIN.difference._replace(alpha=np.array([1.0, 0.5]))
    with pytest.raises(InputError, match="poles below 1"):
        c_header.write(dataclasses.replace(PLAIN, dynamics=difference), ())


def test_numbers_that_are_not_finite_are_refused():
    broken = dataclasses.replace(PLAIN, dead_zone=np.array([np.nan, 0.1]))
    with pytest.raises(InputError, match="finite"):
        c_header.write(broken, ())
