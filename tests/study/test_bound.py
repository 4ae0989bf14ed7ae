"""The bound of a study's cells is that of `cramer_rao` on the same commands."""

import numpy as np
import pytest
from support.studies import ROBOT, SMALL

import jaxident as ji
from jaxident.effects.apply import with_effects
from jaxident.robot.model import Effect
from jaxident.robot.noise import Noise
from jaxident.study import bound
from jaxident.study.design import Candidate, EffectSet
from jaxident.study.engine import run_one


def test_it_is_that_of_one_log_and_grows_with_the_noise(monkeypatch):
    monkeypatch.setattr(bound, "SEEDS", 1)
    lagging = with_effects(ROBOT, [("motor_lag", {"time_constant": 0.05})])
    robots = (Candidate("published", ROBOT), Candidate("lagging", lagging))
    sets = (EffectSet("none"), EffectSet("slope", (Effect("slope", {"acceleration": 0.1}),)))
    study = SMALL._replace(robots=robots, noise=(0.0, 1e-4, 3e-4), effects=sets)
    every = bound.bounds(study).squeeze()
    assert every.dims == ("robot", "effect", "noise", "parameter")
    assert np.isnan(every[:, 1]).all()
    found = every[:, 0]
    made = run_one(SMALL._replace(robots=robots[:1], noise=(1e-4,)), 0)[0]
    log = ji.make_log(ROBOT.sample_period * np.arange(60), *made.command, *made.measured)
    expected = ji.cramer_rao(ROBOT, log, Noise(1e-4, 1e-3)).difference_deviation
    np.testing.assert_allclose(found[0, 1], expected, rtol=1e-6)
    np.testing.assert_allclose(found[0, 2], 3.0 * found[0, 1])
    assert np.isnan(found[0, 0]).all()
    assert np.isnan(found[1]).all()


def test_studies_without_a_bound_say_so():
    assert bound.bounds(SMALL._replace(heading_per_position=0.0)) is None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bound, "MOST_CELLS", 0)
        assert bound.bounds(SMALL) is None
