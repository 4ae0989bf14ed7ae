"""From logs to a model by maximum likelihood on poses."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Pose
from jaxident.errors import InputError, WorkError
from jaxident.estimation.poses.maximum_likelihood import Fit, uncertain_as_by
from jaxident.estimation.poses.noise_law import WHITE, colour, fit_law
from jaxident.estimation.poses.parameters import Law, names, to_vector
from jaxident.estimation.poses.prior import RATE, from_prior
from jaxident.estimation.poses.runs import Runs, stack_runs, with_room, with_wheels
from jaxident.estimation.poses.wheel_colour import WHITE_WHEELS, spacing, thinned, wheel_colour
from jaxident.estimation.suspicions.log_suspicions import log_suspicions, odometry_suspicions
from jaxident.estimation.uncertainty.precision import difference_covariance, spread_of
from jaxident.log import Log
from jaxident.robot.model import Model, Provenance
from jaxident.robot.wheel_sensor import WheelSensor

SMALLEST_LOG = 20
COASTED = (
    "the poses alone ask for a robot that coasts through each run, whatever it is told; robots answer within some "
    f"seconds: rates held at {RATE:g} 1/s; record longer runs, in which the commands change"
)


class PoseFit(NamedTuple):
    """A model, the residuals [m], [m], [rad] (rows,) of the log, NaN where no pose was, the fit and its law, and what
    speaks against that law or the log itself, a line each."""

    model: Model
    residuals: Pose
    fit: Fit
    law: Law
    suspicions: tuple[str, ...]


def identify_poses(log: Log, d_max: float, noise_law: str, coupling: bool) -> PoseFit:
    """The model behind a joined log with any number of runs, steps of any length, poses missing or not.

    Residuals are pose minus model pose, with slip or a memory of the camera error the prediction error of the next
    pose. InputError for a log that is too short, WorkError where nothing finite came out.
    """
    measured = int(np.sum(np.isfinite(log.x) & np.isfinite(log.y) & np.isfinite(log.theta)))
    if measured < SMALLEST_LOG:
        raise InputError(f"{len(log.t)} rows, {measured} with a pose: maximum likelihood needs at least {SMALLEST_LOG}")
    log = _with_commands(log)
    runs = stack_runs(log)
    runs = runs if log.wheel_r is None else with_wheels(runs, log)
    fit, law, doubts = _fitted(with_room(runs), d_max, noise_law, coupling)
    count, rows = runs.seen.shape
    own = jax.tree.map(lambda part: part[:count, ..., :rows], fit.innovations)
    fit = fit._replace(innovations=own, starts=fit.starts[:count])
    if not all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves((fit.robot, fit.covariance))):
        raise WorkError("the maximum-likelihood estimate is not finite: the log does not determine the model")
    doubts = (*_suspicions(fit, law, runs, noise_law), *doubts, *log_suspicions(log))
    doubts = (*doubts, *odometry_suspicions(log, fit.robot))
    return PoseFit(_model(fit, law, float(np.median(_steps(log)))), _residuals(fit, runs, log), fit, law, doubts)


def _fitted(runs: Runs, d_max: float, noise_law: str, coupling: bool) -> tuple[Fit, Law, tuple[str, ...]]:
    """The fit, its law and a line where residuals of wheel speeds hang together. The covariance then counts so few of
    them that they do not: taken for independent they would make every interval too narrow."""
    fit, law = fit_law(jax.tree.map(jnp.asarray, runs), jnp.asarray(d_max), noise_law, coupling)
    if not law.wheels:
        return fit, law, ()
    found = wheel_colour(fit.innovations.turning, runs.turning)
    every = spacing(fit.innovations.turning, runs.turning)
    if found < WHITE_WHEELS or every == 1:
        return fit, law, ()
    line = (
        f"residuals of the wheel speeds are coloured ({found:.0f}, white ones below {WHITE_WHEELS:g}): the motors do "
        f"what the model has not, such as a delay; one wheel speed in {every} counts for the intervals, as so few are "
        "independent"
    )
    few = jax.tree.map(jnp.asarray, thinned(runs, every))
    return jax.device_get(uncertain_as_by(fit, few, law)), law, (line,)


def _with_commands(log: Log) -> Log:
    """The log, its missing commands checked: only the last row of a run may lack them."""
    for number, run in enumerate(log.runs()):
        holes = ~np.isfinite(np.stack(run.command)).all(axis=0)[:-1]
        if holes.any():
            raise InputError(f"run {number}: no command at t = {run.t[np.argmax(holes)]:g} s")
    return log


def _steps(log: Log) -> np.ndarray:
    return np.concatenate([np.diff(run.t) for run in log.runs()])


def _model(fit: Fit, law: Law, period: float) -> Model:
    """The estimate as a model with its noise law, covariance and standard deviations."""
    difference = difference_covariance(to_vector(fit.robot, law), fit.covariance, period, law)
    noise = fit.robot.noise
    return Model(
        period,
        fit.robot.drive,
        fit.robot.dead_zone,
        noise=noise._replace(**{name: float(v) for name, v in noise._asdict().items() if v is not None}),
        standard_deviation=spread_of(fit.covariance, difference, law),
        covariance=fit.covariance,
        parameter_order=names(law),
        wheels=None if fit.robot.wheels is None else WheelSensor(*map(float, fit.robot.wheels)),
        provenance=Provenance(method="maximum-likelihood", from_prior=from_prior(np.asarray(fit.prior_share), law)),
    )


def _suspicions(fit: Fit, law: Law, runs: Runs, noise_law: str) -> tuple[str, ...]:
    """A line where slip was found, which what the model lacks may look like; and where residuals are not white: the
    intervals are then too narrow."""
    lines = []
    if noise_law == "auto" and law.slip:
        lines.append(
            "wheels seem to slip at random: they do, or the model lacks something; `jaxident diagnose` tells which"
        )
    if fit.prior is not None and np.any(fit.prior.held):
        lines.append(COASTED)
    found = colour(fit, runs)
    if not found < WHITE:
        tried = "no noise law makes them white, so the model may lack something: `jaxident diagnose` looks for it"
        other = "the noise law 'auto' tries slip and a camera error with a memory"
        words = tried if noise_law == "auto" else other
        lines.append(
            f"residuals are coloured ({found:.0f}, white ones below {WHITE}): intervals are too narrow; {words}"
        )
    return tuple(lines)


def _residuals(fit: Fit, runs: Runs, log: Log) -> Pose:
    """Innovations in the units of the pose, row by row of the log."""
    values: Any = fit.innovations.normalised * np.exp(0.5 * fit.innovations.log_variance)
    values = np.where(np.asarray(runs.seen)[:, None], values, np.nan)
    lengths = [len(run.t) for run in log.runs()]
    return Pose(*(np.concatenate([v[k, :n] for v, n in zip(values, lengths, strict=True)]) for k in range(3)))
