"""Which recursive estimator stands the camera?

    python -m experiments.recursive_estimators --trials 100 --out recursive_estimators

Three of them on the same runs of 1000 rows of the paper's robot, all begun on the first 200: the joint Kalman filter,
the paper's recursive least squares, and recursive instrumental variables (Soederstroem and Stoica 1983), whose
instruments are increments that the estimate itself simulates. First the error at the end of the run over the
Cramer-Rao bound of the whole run; then, with one parameter that falls by a fifth over the run, the error over its
second half over that of the fit frozen after 200 rows.
"""

import argparse
import functools
import json
import pathlib

import jax
import jax.numpy as jnp
import numpy as np

import jaxident as ji
from experiments.diagonal import DRIVE, PERIOD, TRUTH
from jaxident.array_types import AT_REST, Wheels
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.initialise import initialise
from jaxident.estimation.increments.observations import observe_log, tail
from jaxident.estimation.increments.regressors import key_terms
from jaxident.estimation.online import joint_filter
from jaxident.estimation.poses.parameters import Law, Robot, to_vector
from jaxident.estimation.poses.runs import Runs
from jaxident.estimation.uncertainty.precision import bound_covariance, difference_covariance
from jaxident.log import Log
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.difference import to_difference
from jaxident.robot.drive import Physical, force, hold
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import DIFFERENCE_ORDER, difference_vector
from jaxident.robot.noise import Noise, draw_noise, observe
from jaxident.robot.simulate import run_forces

ROWS, SETUP, D_MAX = 1000, 200, 0.9
FALL = 0.2
ESTIMATORS = ("joint filter", "recursive least squares", "instrumental variables")
FALLING = {"rate": (1, "alpha_2"), "gain": (5, "delta_22"), "dead zone": (6, "dead_zone_r")}
"""What falls: its place among the eight physical numbers, and the number of the twelve that is compared."""
FORGETTING = 0.985
"""Of both equation-error recursions: a memory of 67 rows, the filter's 2.2 s."""


def drive_of(values):
    """The drive of eight numbers (8, ...)."""
    return Physical((values[0], values[1]), ((values[2], values[3]), (values[4], values[5])))


def record(key, excitation, noise, values):
    """Commands and poses of a robot whose eight numbers (8, ROWS) change with time."""
    key, own = jax.random.split(key)
    command, unit = EXCITATIONS[excitation](key, ROWS), draw_noise(own, ROWS)
    pull = force(drive_of(values), effective_command(command, values[6:]))
    state = run_forces(hold(drive_of(values[:, :-1]), jnp.full(ROWS - 1, PERIOD)), pull, AT_REST)
    return command, observe(state.pose, noise, unit, jnp.asarray(PERIOD))


def image(values):
    """Eight numbers as the twelve of the difference equations."""
    drive = Physical(values[:2], values[2:6].reshape(2, 2))
    return difference_vector(to_difference(drive, PERIOD), values[6:])


def joint(command, pose, memory):
    """Twelve numbers after each row from SETUP on (rows, 12)."""
    run = Runs(jnp.asarray(PERIOD), *jax.tree.map(lambda c: c[:SETUP], (command, pose)), jnp.ones(SETUP, bool))
    state = joint_filter.start(run, D_MAX, memory, "white")

    def body(state, row):
        state, _ = joint_filter.step(state, joint_filter.Sample(state.t + PERIOD, *row))
        return state, image(joint_filter.estimate(state)[0])

    late = jax.tree.map(lambda c: c[SETUP:], (*command, *pose))
    return image(joint_filter.estimate(state)[0]), jax.lax.scan(body, state, late)[1]


def least_squares(command, pose, forgetting):
    """The paper's recursion, its start values from the free run."""
    observations = observe_log(Log(PERIOD * jnp.arange(ROWS), *command, *pose, jnp.zeros(ROWS)))
    early = jax.tree.map(lambda c: c[: SETUP - 1], observations)
    setup = initialise(early, d_max=D_MAX, reading="free_run")
    first = recursive.start(setup.difference, setup.dead_zone, early, D_MAX, forgetting)
    _, (steps, _) = recursive.run(first, tail(observations, SETUP - 1))
    return jax.vmap(lambda one: difference_vector(*recursive.parameters(one)))(steps)


def instrumental(command, pose, forgetting):
    """Recursive instrumental variables on the same regressors: the measured last increment is replaced, in the
    instrument, by the one that the estimate simulates."""
    observations = observe_log(Log(PERIOD * jnp.arange(ROWS), *command, *pose, jnp.zeros(ROWS)))
    early = jax.tree.map(lambda c: c[: SETUP - 1], observations)
    setup = initialise(early, d_max=D_MAX, reading="free_run")
    first = recursive.start(setup.difference, setup.dead_zone, early, D_MAX, forgetting)
    unknowns = jnp.stack([jnp.stack(equation.unknowns) for equation in (first.length, first.turn)])
    small = 0.1 * jnp.abs(unknowns[:, (1, 4)])
    wide = jnp.array([[1e-2] * 7, [1.0] * 7]) * jnp.abs(unknowns).max(axis=1, keepdims=True) * 1e2
    steps = jnp.stack(observations.increment), jnp.stack(observations.command), jnp.stack(observations.command_before)

    def body(carry, row):
        unknowns, covariance, width, last, simulated, count = carry
        increment, now, before = row
        rows = [
            jnp.stack([jnp.stack(key_terms(past[k], Wheels(*now), Wheels(*before), Wheels(*width))) for k in (0, 1)])
            for past in (last, simulated)
        ]
        regressor, instrument = rows
        gain = jnp.einsum("cij,cj->ci", covariance, instrument)
        gain = gain / (forgetting + jnp.sum(regressor * gain, axis=1, keepdims=True))
        learn = jnp.where(count < SETUP, 0.0, 1.0)
        error = increment - jnp.sum(regressor * unknowns, axis=1)
        back = jnp.einsum("ci,cij->cj", regressor, covariance)
        covariance = (covariance - gain[:, :, None] * back[:, None, :]) / jnp.where(count < SETUP, 1.0, forgetting)
        unknowns = unknowns + learn * gain * error[:, None]
        ratio = jnp.clip(unknowns[:, (2, 5)] / unknowns[:, (1, 4)], 0.0, D_MAX)
        clear = jnp.abs(unknowns[:, (1, 4)]) > small
        width = jnp.mean(jnp.where(clear, ratio, width), axis=0)
        simulated = jnp.clip(jnp.sum(instrument * unknowns, axis=1), -10.0, 10.0)
        found = jnp.concatenate([unknowns[:, 0], unknowns[:, (1, 4)].ravel(), -unknowns[:, (3, 6)].ravel(), width])
        return (unknowns, covariance, width, increment, simulated, count + 1), found

    covariance = jax.vmap(jnp.diag)(wide**2)
    carry = unknowns, covariance, jnp.stack(first.dead_zone), steps[0][:, 0], steps[0][:, 0], 1
    return jax.lax.scan(body, carry, tuple(s[:, 1:].T for s in steps))[1][SETUP - 1 :]


@functools.partial(jax.jit, static_argnames="excitation")
@functools.partial(jax.vmap, in_axes=(0, None, None))
def at_the_end(key, excitation, noise):
    """Errors (3, 12) at the end of the run over the bound of the whole run."""
    values = jnp.tile(TRUTH[:, None], (1, ROWS))
    command, pose = record(key, excitation, noise, values)
    ends = [joint(command, pose, jnp.inf)[1][-1]]
    ends += [method(command, pose, 1.0)[-1] for method in (least_squares, instrumental)]
    runs = Runs(jnp.asarray(PERIOD), *jax.tree.map(lambda c: c[None], (command, pose)), jnp.ones((1, ROWS), bool))
    vector = to_vector(Robot(DRIVE, TRUTH[6:], noise), Law())
    bound = difference_covariance(vector, bound_covariance(vector, jnp.zeros(5), runs, Law()), PERIOD, Law())
    return (jnp.stack(ends) - image(TRUTH)) / jnp.sqrt(jnp.diagonal(bound))


@functools.partial(jax.jit, static_argnames="excitation")
@functools.partial(jax.vmap, in_axes=(0, None, None, None))
def while_falling(key, excitation, noise, which):
    """Mean squared errors (4, 12) over the second half: frozen fit, then the three recursions."""
    part = jnp.where(jnp.arange(8)[:, None] == which, 1.0 - FALL * jnp.arange(ROWS) / ROWS, 1.0)
    values = TRUTH[:, None] * part
    command, pose = record(key, excitation, noise, values)
    frozen, steps = joint(command, pose, PERIOD / (1.0 - FORGETTING))
    found = [frozen + 0.0 * steps, steps]
    found += [method(command, pose, FORGETTING) for method in (least_squares, instrumental)]
    truth = jax.vmap(image, in_axes=1)(values)
    half = ROWS // 2
    return jnp.stack([jnp.mean((one[half - ROWS :] - truth[half:]) ** 2, axis=0) for one in found])


def root_mean_square(values):
    """Over trials, and how many were not finite."""
    good = np.isfinite(values)
    return np.sqrt(np.nanmean(np.where(good, values**2, np.nan), axis=0)), int(np.sum(~good.all(axis=-1)))


def rows_of(excitation, level, keys):
    """Rows of the table: one per estimator at the end of the run, one per falling parameter."""
    noise = Noise(1e-3 * level, 1e-2 * level)
    where = {"excitation": excitation, "noise_mm": level}
    errors = np.asarray(at_the_end(keys, excitation, noise))
    for k, name in enumerate(ESTIMATORS):
        rms, failed = root_mean_square(errors[:, k])
        yield where | {
            "estimator": name,
            "over_bound_mean": rms.mean(),
            "over_bound_largest": rms.max(),
            "failed": failed,
        }
    for what, (which, shown) in FALLING.items():
        squares = np.asarray(while_falling(keys, excitation, noise, which))[:, :, DIFFERENCE_ORDER.index(shown)]
        frozen, *sizes = np.sqrt(np.nanmean(squares, axis=0))
        yield where | {"falling": what, **{name: s / frozen for name, s in zip(ESTIMATORS, sizes, strict=True)}}


def main() -> None:
    """Both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--excitations", nargs="*", default=["multilevel", "staircase"])
    parser.add_argument("--noise", type=float, nargs="*", default=[0.2, 0.5, 1.0], help="Camera noise [mm].")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("recursive_estimators"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    keys, rows = jax.random.split(jax.random.key(1), options.trials), []
    for excitation in options.excitations:
        for level in options.noise:
            for row in rows_of(excitation, level, keys):
                rows.append({key: float(v) if isinstance(v, np.floating) else v for key, v in row.items()})
                print(rows[-1], flush=True)
    (options.out / "table.json").write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    ji.start_jax()
    main()
