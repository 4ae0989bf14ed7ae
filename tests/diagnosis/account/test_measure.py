"""What the judging rows tell of a robot with a law that is in no catalogue."""

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.diagnosis.account.measure import _wander
from jaxident.diagnosis.account.shrink import shrink_of
from jaxident.diagnosis.preparation.judging import judge_model
from jaxident.log import join, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Model
from jaxident.robot.noise import Noise

AT = np.linspace(-3.0, 3.0, 9)
ROBOT = Model(
    0.05, Physical(np.array([3.0, 5.0]), np.array([[0.4, 0.39], [4.5, -4.6]])), np.array([0.16, 0.2]),
    Noise(3e-4, 2e-3), discovered=(Discovered("acceleration along", "v", "w", AT, -0.4 * AT**2),),
)  # fmt: skip


@pytest.mark.slow
def test_the_whole_shrink_is_that_of_the_model_with_its_laws():
    rng, t, logs = np.random.default_rng(1), 0.05 * np.arange(600), []
    for run in range(3):
        u = np.repeat(rng.uniform(-2.0, 2.0, (40, 2)), 15, axis=0)
        logs.append(ji.simulate(ROBOT, make_log(t, *u.T, *np.zeros((3, 600))), key=jax.random.key(run)))
    found = ji.diagnose(join(logs))
    gap = found.gap
    assert found.discovered
    assert gap.whole.value == pytest.approx(1.0 - (gap.discovered - gap.floor) / (gap.refitted - gap.floor))
    low, high = gap.whole.interval
    assert low <= gap.whole.value <= high
    assert gap.whole.value > gap.shrink.value
    judged = judge_model(found.corrected_model, found.prepared)
    wander = _wander(judged, gap.unit, 0)
    told = gap.errors[1], gap.errors[-1], gap.floor, gap.noise.draws
    known, exact = ([shrink_of(*told, each, least=least) for least in (None, gap.noise.steady)]
                    for each in (wander, 0.0 * wander))  # fmt: skip
    assert gap.whole in known
    assert gap.whole not in exact, "its own parameters are not known exactly"
