"""Do bootstrap intervals cover where the noise law is wrong?

    python -m experiments.bootstrap_coverage --seeds 100 --count 100

A robot of 1000 rows at 1 mm / 10 mrad on multilevel inputs, the noise white or not, always fitted as white. Does the
95 % interval of each of eight parameters hold the truth? The likelihood's own, and the bootstrap's from blocks of
innovations; with --runs, of as many runs together, also from whole runs. Standard errors over seeds, because the
parameters of one seed err together.
"""

import argparse
import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np

import jaxident as ji
from experiments.diagonal import PERIOD, ROBOT, TRUTH
from jaxident.array_types import AT_REST, Pose, Wheels
from jaxident.estimation.bootstrap import PILOTS, enlargement, refit, summarise
from jaxident.estimation.poses.maximum_likelihood import fit_runs
from jaxident.estimation.poses.parameters import Law, names
from jaxident.estimation.poses.runs import Runs
from jaxident.estimation.uncertainty.blocks import block_length
from jaxident.estimation.uncertainty.precision import natural_values
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.noise import Noise, draw_noise, observe
from jaxident.robot.simulate import run_physical

D_MAX = 0.9
NOISES = {
    "white": Noise(1e-3, 1e-2),
    "ar0.7": Noise(1e-3, 1e-2, -PERIOD / np.log(0.7)),
    "ar0.9": Noise(1e-3, 1e-2, -PERIOD / np.log(0.9)),
    "slip": Noise(1e-3, 1e-2, None, 0.01, 0.1),
}
WHITE = Law()


@functools.partial(jax.jit, static_argnames=("rows", "runs", "excitation"))
def record(key, noise, rows, runs, excitation="multilevel"):
    """Runs (runs, rows) of one robot, each from rest on an input of its own."""

    def one(key):
        key, own = jax.random.split(key)
        command, unit = EXCITATIONS[excitation](key, rows), draw_noise(own, rows)
        model = dataclasses.replace(ROBOT, noise=noise)
        state = run_physical(model, command, jnp.asarray(PERIOD), AT_REST, unit)
        return command, observe(state.pose, noise, unit, jnp.asarray(PERIOD))

    command, pose = jax.vmap(one)(jax.random.split(key, runs))
    return Runs(jnp.asarray(PERIOD), Wheels(*command), Pose(*pose), jnp.ones((runs, rows), bool))


def resampled(key, found, runs, count, block):
    """Intervals (8, 2) and standard deviations (8,) of a bootstrap of a fit."""
    innovation, rest = found.innovations.normalised, (runs, jnp.asarray(D_MAX), WHITE, block)
    if block is not None:
        pilots = jax.random.split(key, count)[:PILOTS]
        innovation = innovation * enlargement(pilots, found.robot, found.starts, innovation, *rest)
    values, ok, _ = refit(jax.random.split(key, count), found.robot, found.starts, innovation, *rest)
    estimate = np.asarray(natural_values(found.robot, WHITE))
    again = summarise(estimate, np.asarray(values), np.asarray(ok), names(WHITE), "blocks" if block else "runs", block)
    return again.interval[:8], np.sqrt(np.diagonal(again.covariance))[:8]


def judge(key, noise, options):
    """For one seed: method -> whether each parameter is covered (8,), and the widths (8,) over the likelihood's."""
    key, own = jax.random.split(key)
    runs = record(key, noise, options.rows, options.runs)
    found = FIT(runs)
    estimate = np.asarray(natural_values(found.robot, WHITE))[:8]
    deviation = np.sqrt(np.diagonal(np.asarray(found.covariance)))[:8]
    results = {"likelihood": (np.abs(estimate - TRUTH) < 1.96 * deviation, np.ones(8))}
    best = block_length(np.asarray(found.innovations.normalised), np.asarray(runs.seen))
    for name, block in {"blocks": best, **({"runs": None} if options.runs > 1 else {})}.items():
        interval, spread = resampled(own, found, runs, options.count, block)
        results[name] = ((interval[:, 0] < TRUTH) & (interval[:, 1] > TRUTH), spread / deviation)
    return results


FIT = jax.jit(functools.partial(fit_runs, d_max=D_MAX))


def main() -> None:
    """One line per noise and method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--rows", type=int, default=1000)
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--noises", nargs="*", choices=list(NOISES), default=["white", "ar0.9"])
    options = parser.parse_args()
    for name in options.noises:
        keys = [jax.random.fold_in(jax.random.key(5), seed) for seed in range(options.seeds)]
        judged = [judge(key, NOISES[name], options) for key in keys]
        for method in judged[0]:
            covered, width = (np.array([one[method][part] for one in judged], float) for part in (0, 1))
            error = covered.mean(axis=1).std(ddof=1) / np.sqrt(options.seeds)
            worst = covered.mean(axis=0).min()
            print(
                f"{name} | {method} | {100 * covered.mean():.1f} ± {100 * error:.1f} % | worst parameter "
                f"{100 * worst:.0f} % | {width.mean():.2f} times as wide",
                flush=True,
            )


if __name__ == "__main__":
    ji.start_jax()
    main()
