"""The estimators of a study, side by side on the same logs."""

import numpy as np
import pytest
from support.studies import ROBOT, SMALL

from jaxident.robot.drive import Physical
from jaxident.robot.model import Model
from jaxident.study.dataset import study_arrays
from jaxident.study.design import Candidate
from jaxident.study.estimators import BEST, DIAGNOSE, METHODS
from jaxident.study.sight import FOUND, Choice
from jaxident.study.statistics import summarise

DRIVE = Physical(np.array([0.541386, 7.817043]), np.array([[0.128988, 0.127287], [66.824208, -65.25288]]))
DIAGONAL = Model(1.0 / 30.0, DRIVE, np.array([0.25, 0.2]))


@pytest.mark.slow
def test_likelihood_knows_of_the_camera_and_the_papers_method_does_not():
    study = SMALL._replace(
        robots=(Candidate("diagonal", DIAGONAL, (0.0, 0.0, 0.0, 0.0)),),
        estimators=tuple(Choice(name, name) for name in METHODS if name != DIAGNOSE),
        excitations=("multilevel",),
        noise=(1e-3,),
        samples=(300,),
        hold=10,
    )
    trials = study_arrays(study)
    assert np.all(trials["reason"] == FOUND)
    rmse = summarise(trials)["rmse"].squeeze().sel(parameter="alpha_1")
    assert rmse.sel(estimator="maximum-likelihood") < 0.01
    for name in ("batch", "recursive"):
        assert rmse.sel(estimator=name) > 0.3  # the printed reading shrinks the pole towards zero


@pytest.mark.slow
def test_batch_claims_what_its_dead_zones_scatter():
    """The heading's equation determines them; an average with those of the path length would claim twenty times more.
    Forty trials tell a standard deviation to 11 %."""
    study = SMALL._replace(estimators=(Choice("batch", "batch"),), seeds=40, samples=(200,), hold=8, noise=(1e-5,),
                           excitations=("multilevel",), chunk=40)  # fmt: skip
    trials = study_arrays(study._replace(robots=(Candidate("diagonal", DIAGONAL),)))
    zones = trials.sel(parameter=["dead_zone_r", "dead_zone_l"])
    scatter = (zones["estimate"] - zones["truth"]).std("seed", ddof=1).values.ravel()
    claimed = np.sqrt((zones["deviation"] ** 2).mean("seed")).values.ravel()
    assert np.all(claimed > 0.5 * scatter)
    assert np.all(claimed < 1.5 * scatter)


@pytest.mark.slow
def test_likelihood_of_a_coupled_robot_has_right_intervals_with_coupling_alone():
    """The published robot; forty trials tell a root mean square of 1 to 11 %, those of twelve numbers to less."""
    choices = (Choice("with", BEST, (("coupling", True),)), Choice("without", BEST))
    study = SMALL._replace(robots=(Candidate("published", ROBOT),), estimators=choices, seeds=40, samples=(300,),
                           hold=20, noise=(1e-4,), excitations=("multilevel",), chunk=40)  # fmt: skip
    trials = study_arrays(study)
    away = ((trials["estimate"] - trials["truth"]) / trials["deviation"]).squeeze()
    size = np.sqrt((away**2).mean(dim=["seed", "parameter"]))
    assert float(size.sel(estimator="with")) == pytest.approx(1.0, abs=0.25)
    assert float(size.sel(estimator="without")) > 10.0
