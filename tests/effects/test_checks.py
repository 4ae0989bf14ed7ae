"""Bad effects are refused in the catalogue's own words; the catalogue itself is whole."""

import dataclasses
import math

import jax.numpy as jnp
import numpy as np
import pytest
from support.effect_robots import ROBOT, drive_log

import jaxident as ji
from jaxident.effects import CATALOGUE, NEUTRAL, ORDER, SITES, by_name, to_vector
from jaxident.robot.model import Effect

CANONICAL = {
    "actuation": "asymmetric_dead_zone direction_gain input_saturation input_quantisation input_rate_limit "
    "transport_delay motor_lag backlash supply_sag",
    "drive": "coulomb_friction stiction quadratic_drag mass_offset turn_loss",
    "contact": "traction_limit lateral_slip slope",
    "time": "gain_drift dead_zone_drift payload_change",
    "camera": "marker_offset heading_offset camera_scale lens_distortion coloured_noise outliers frozen_frames",
}


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("gearbox", {"x": 1.0}, "unknown effect 'gearbox'; the catalogue has asymmetric_dead_zone"),
        ("transport_delay", {"lag": 0.1}, r"'transport_delay': unknown parameter 'lag'; it has delay \[s\]"),
        ("transport_delay", {"delay": -0.1}, "delay is -0.1; at least 0 s"),
        ("transport_delay", {"delay": 99.0}, "delay is 99 s, longer than the log of 4 s"),
        ("transport_delay", {"delay": math.nan}, "delay is nan"),
        ("command_polling", {"period": 99.0}, "'command_polling': period is 99 s, longer than the log of 4 s"),
        ("twist_quantisation", {"mean": -0.1}, "mean is -0.1; at least 0 unit"),
        ("motor_lag", {"time_constant": math.inf}, "time_constant is inf"),
        ("input_saturation", {"level": 0.0}, "level is 0; above 0 unit; 0.3 to 1 unit on real robots"),
        ("input_quantisation", {"step": -1.0}, "step is -1"),
        ("backlash", {"right": -0.1}, "right is -0.1"),
        ("outliers", {"probability": 1.5}, "probability is 1.5; at least 0 and at most 1"),
        ("payload_change", {"ratio": 0.0}, "ratio is 0; above 0"),
    ],
)
def test_bad_effects_are_refused(name, parameters, words):
    model = dataclasses.replace(ROBOT, effects=(Effect(name, parameters),))
    with pytest.raises(ji.InputError, match=words):
        ji.simulate(model, drive_log())


def test_an_effect_twice_and_free_numerators_are_refused():
    one = Effect("motor_lag", {"time_constant": 0.1})
    with pytest.raises(ji.InputError, match="twice"):
        ji.simulate(dataclasses.replace(ROBOT, effects=(one, one)), drive_log())
    with pytest.raises(ji.InputError, match="physical: null"):
        ji.simulate(dataclasses.replace(ROBOT, dynamics=ROBOT.difference, effects=(one,)), drive_log())


def test_the_catalogue_has_every_canonical_name_and_marks_the_others():
    for site in SITES:
        own = {name for name, entry in CATALOGUE.items() if entry.site == site and not entry.extension}
        assert own == set(CANONICAL[site].split())
    assert ji.effects.CATALOGUE is CATALOGUE


@pytest.mark.parametrize("entry", CATALOGUE.values(), ids=lambda entry: entry.name)
def test_rows_are_whole(entry):
    assert entry.equation
    assert entry.source
    assert set(entry.confused_with) <= CATALOGUE.keys()
    assert set(entry.channels) <= {"along", "lateral", "heading"}
    for parameter in entry.parameters:
        low, high = parameter.range
        assert parameter.least <= low <= parameter.typical <= high <= parameter.most
        assert parameter.shape or parameter.typical != parameter.neutral


def test_vector_and_names_lead_to_and_fro():
    vector = jnp.arange(len(ORDER)) + 0.5
    named = by_name(vector)
    again = to_vector([Effect(name, values) for name, values in named.items()])
    np.testing.assert_array_equal(again, vector)
    np.testing.assert_array_equal(to_vector([]), NEUTRAL)
