"""The same robot in other units, elsewhere, at another time: the same model, scaled, or a word that says why not."""

import jax
import numpy as np
import pytest

from jaxident.errors import InputError, WorkError
from jaxident.estimation.identify import identify
from jaxident.files.models import load_model
from jaxident.log import Log
from jaxident.study.synthetic import excite, simulate_runs

ROWS = 600
NUMERATORS = {"delta", "epsilon"}


@pytest.fixture(scope="module")
def log() -> Log:
    """The published robot, seen with a millionth of a metre of noise."""
    command = excite(jax.random.key(0), "multilevel", ROWS, 1.0 / 30.0, hold=5)
    return simulate_runs(load_model("published"), command, noise=(1e-6, 1e-5), key=jax.random.key(1))


def parts(log: Log, method: str) -> dict[str, np.ndarray]:
    """The numbers of an identified model."""
    settings = {"noise_law": "white"} if method == "maximum-likelihood" else {}
    found = identify(log, method, **settings)
    assert bool(found.ok)
    return {key: np.asarray(getattr(found.model, key)) for key in ("alpha", "delta", "epsilon", "dead_zone")}


METHODS = pytest.mark.parametrize("method", ["paper", pytest.param("maximum-likelihood", marks=pytest.mark.slow)])


@METHODS
@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e6])
def test_commands_in_another_unit(log, method, scale):
    plain, other = parts(log, method), parts(log._replace(u_r=scale * log.u_r, u_l=scale * log.u_l), method)
    for key, value in plain.items():
        factor = 1.0 / scale if key in NUMERATORS else scale if key == "dead_zone" else 1.0
        np.testing.assert_allclose(other[key], factor * value, rtol=1e-3, atol=2e-3 * factor * np.abs(value).max())


@METHODS
@pytest.mark.parametrize(
    "change",
    [
        lambda log: log._replace(theta=(log.theta + np.pi) % (2.0 * np.pi) - np.pi),
        lambda log: log._replace(theta=log.theta + 2000.0 * np.pi),
        lambda log: log._replace(x=log.x + 1e3, y=log.y - 1e3),
        lambda log: log._replace(t=log.t + 1.7e9),
    ],
    ids=["wrapped", "turned", "elsewhere", "epoch"],
)
def test_elsewhere_and_at_another_time(log, method, change):
    plain, other = parts(log, method), parts(change(log), method)
    for key, value in plain.items():
        np.testing.assert_allclose(other[key], value, rtol=1e-3, atol=2e-3 * np.abs(value).max())


@METHODS
@pytest.mark.parametrize(
    "change",
    [
        lambda log: log._replace(x=log.x + 1e9, y=log.y + 1e9),
        lambda log: log._replace(x=1e6 * log.x, y=1e6 * log.y),
        lambda log: log._replace(x=1e-9 * log.x, y=1e-9 * log.y),
        lambda log: log._replace(
            **{name: np.where(np.arange(ROWS) % 3 > 0, np.nan, getattr(log, name)) for name in ("x", "y", "theta")}
        ),
        lambda log: log._replace(x=log.x + np.random.default_rng(0).normal(size=ROWS) * 1e3),
        lambda log: log._replace(t=1e-4 * log.t),
        lambda log: log._replace(t=1e4 * log.t),
    ],
    ids=["far", "micrometres", "large", "holes", "noise", "fast", "slow"],
)
def test_finite_or_flagged(log, method, change):
    """A model of finite numbers, or the program's own error."""
    try:
        found = identify(change(log), method, **({"noise_law": "white"} if method != "paper" else {}))
    except (InputError, WorkError):
        return
    numbers = jax.tree.leaves((found.model.dynamics, found.model.dead_zone, found.covariance))
    assert all(np.all(np.isfinite(leaf)) for leaf in numbers)
    assert np.all(np.diagonal(found.covariance) >= 0.0)
