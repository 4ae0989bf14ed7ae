"""Robots without any effect, in odd units, far away, dim, noisy or without noise: a diagnosis is finite or refused, and
names nothing."""

import jax
import numpy as np
import pytest
from support.stressed import random_robot, random_stress, stressed

import jaxident as ji
from jaxident.errors import InputError, WorkError
from jaxident.log import Log, join

RUNS, ROWS = 5, 300


def five_runs(seed: int) -> Log:
    random = np.random.default_rng(seed)
    stress = random_stress(random)
    robot = random_robot(random, stress.period)
    return join([stressed(robot, stress, 100 * seed + k, rows=ROWS) for k in range(RUNS)])


def named(seed: int) -> tuple[str, ...] | None:
    """What a diagnosis names, its numbers finite; None where it refuses the log."""
    try:
        found = ji.diagnose(five_runs(seed))
    except (InputError, WorkError):
        return None
    numbers = (found.account, found.gap._replace(shrink=None, placebo=None), found.corrected_model.dynamics)
    for leaf in jax.tree.leaves(numbers):
        assert not isinstance(leaf, float | np.ndarray | jax.Array) or np.all(np.isfinite(leaf))
    assert 0.0 <= found.judgement.unexplained <= 1.0
    return (*found.selected, *found.surplus)


@pytest.mark.slow
def test_no_diagnosis_under_stress_breaks_or_names():
    """Seed 1 (no noise, three poses in four missing) ended in a singular matrix; 8 and 9 (no noise) had outliers."""
    found = {seed: named(seed) for seed in range(20)}
    judged = [names for names in found.values() if names is not None]
    assert len(judged) >= 8
    assert sum(bool(names) for names in judged) <= 1, found
