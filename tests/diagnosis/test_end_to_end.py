"""One diagnosis from logs to sentence, as small as one can be: the one of the quick tier."""

import dataclasses

import jax
import pytest

import jaxident as ji
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.effects.apply import with_effects

RUNS, ROWS, PERIOD = 3, 400, 1.0 / 30.0


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    robot = dataclasses.replace(ji.load_model("published"), noise=ji.Noise(3e-4, 3e-3))
    tired = with_effects(robot, [("transport_delay", {"delay": 0.12})])
    keys = jax.random.split(jax.random.key(0), (RUNS, 2))
    inputs = [ji.excite(key, "multilevel", ROWS, PERIOD, hold=10) for key in keys[:, 0]]
    return ji.diagnose([ji.simulate(tired, run, key=key) for run, key in zip(inputs, keys[:, 1], strict=True)])


def test_the_effect_is_named(found):
    assert found.verdict == "effects"
    assert found.selected == ("transport_delay",)


def test_the_corrected_model_has_it_at_its_size(found):
    (effect,) = found.corrected_model.effects
    assert effect.name == "transport_delay"
    assert effect.parameters["delay"] == pytest.approx(0.12, abs=0.01)


def test_most_of_the_gap_goes(found):
    assert found.gap.shrink.value > 0.9


def test_it_says_so_in_words(found):
    assert "one unmodelled effect: transport delay" in str(found)
