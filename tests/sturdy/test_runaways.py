"""A prediction that runs away, or that no pose stands beside, is told in numbers that are numbers."""

import json

import numpy as np
import pytest

from jaxident.cli.predict import _told
from jaxident.estimation.predict import Prediction, prediction_error, root_mean_square
from jaxident.files.models import load_model
from jaxident.log import make_log


def ends(x: float) -> Prediction:
    """One free run over three rows, which ends at x [m]."""
    one = np.ones(1)
    return Prediction(0 * one, one, 3 * one, 4 * one, x * one, one, one, one, one, one, np.zeros(1, bool))


@pytest.mark.parametrize(("x", "seen"), [(1e200, True), (0.5, False)])
def test_no_summary_holds_what_is_no_number(x, seen):
    pose = np.full(5, 0.0 if seen else np.nan)
    found = prediction_error(ends(x), make_log(np.arange(5.0), np.zeros(5), np.zeros(5), pose, pose, pose))
    json.dumps(found, allow_nan=False)
    assert (found["compared"], found["position_rms"]) == ((1, 1e200) if seen else (0, None))
    lines = " ".join(_told(found | {"session_time": 0.0}, load_model("published"), False, True))
    assert "nan" not in lines
    assert "inf" not in lines
    assert ("0 of them with a pose" in lines) == (not seen)


def test_root_mean_square():
    values = np.random.default_rng(0).normal(size=50)
    assert root_mean_square(values) == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-14)
    assert root_mean_square(np.zeros(3)) == 0.0
    assert root_mean_square(1e300 * values) == pytest.approx(1e300 * root_mean_square(values), rel=1e-14)
