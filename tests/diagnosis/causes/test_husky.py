"""The search on a real log that it had lost its way on: a Husky on wet grass, poses of its lidar."""

import pytest

import jaxident as ji
from jaxident.diagnosis.causes.finding import find_effects
from jaxident.diagnosis.preparation.prepare import prepare
from jaxident.estimation.increments.observations import poses_only


@pytest.mark.slow
@pytest.mark.parametrize("wheels", [False, True])
def test_what_is_named_fits_no_worse_than_its_neighbours_and_than_no_effect(shared, wheels):
    """Two effects were named though none was better by 46 of log evidence; with the wheels the search ended in an
    error."""
    log = ji.read_log(shared / "data" / "husky_encoders" / "wet_grass.csv.gz")
    finding = find_effects(prepare(log if wheels else poses_only(log), None))[1]
    assert max(finding.values.values()) <= 0.0
    assert abs(finding.fit.vector[2:6]).max() < 1e3, "gains of a robot [m/s^2, rad/s^2 per unit]"
