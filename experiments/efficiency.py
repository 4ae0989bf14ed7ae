"""Does maximum likelihood reach the Cramér–Rao bound, does it arrive, and do its intervals cover?

    python -m experiments.efficiency --seeds 500 --out efficiency.csv

The robot without coupling, one run of 1000 rows (`--rows`) from rest at 1/30 s, maximum likelihood from its own start.
First white camera noise of 0.2 to 5 mm, 10 mrad for each mm, on both inputs; then 1 mm under every noise law, fitted as
the law that made the data, as white, and as the one that `identify` finds. For each of eight parameters the RMS error
over the bound of its own trial; their mean with its standard error over seeds (the parameters of one seed err
together), and the largest. Failed fits (`ok` false) are in no error, but counted; a fit that says ok and lies more than
six bounds off is `wrong`.
"""

import argparse
import functools
import pathlib

import jax
import jax.numpy as jnp
import numpy as np

import jaxident as ji
from experiments.bootstrap_coverage import D_MAX, NOISES, record
from experiments.diagonal import DRIVE, ROBOT, TRUTH
from experiments.rows import write_rows
from jaxident.estimation.poses.maximum_likelihood import Fit, fit_runs
from jaxident.estimation.poses.noise_law import fit_law
from jaxident.estimation.poses.parameters import Law, Robot, to_vector
from jaxident.estimation.uncertainty.precision import bound_covariance, natural_values
from jaxident.robot.noise import Noise

LEVELS = (0.2, 0.5, 1.0, 2.0, 5.0)  # [mm]
LAWS = {"white": Law(), "ar0.9": Law(memory=True), "slip": Law(slip=True)}
BLOCK = 50
"""Trials mapped at once: more wait for the slowest of them."""
LOST = 6.0
"""Bounds beyond which an estimate is wrong and not unlucky: once in 10^9."""


@functools.partial(jax.jit, static_argnames=("rows", "excitation", "law"))
def bounds(keys, rows: int, noise: Noise, excitation: str, law: Law):
    """Cramér–Rao bounds (trials, 8) under the law that made the data."""

    def one(key):
        vector = to_vector(Robot(DRIVE, ROBOT.dead_zone, noise), law)
        runs = record(key, noise, rows, 1, excitation)
        return jnp.sqrt(jnp.diagonal(bound_covariance(vector, jnp.zeros(5), runs, law)))[:8]

    return jax.vmap(one)(keys)


@functools.partial(jax.jit, static_argnames=("rows", "excitation", "law"))
def fits(keys, rows: int, noise: Noise, excitation: str, law: Law):
    """Estimates and their own deviations (trials, 8), and ok (trials,)."""

    def one(key):
        return told(fit_runs(record(key, noise, rows, 1, excitation), jnp.asarray(D_MAX), law), law)

    return jax.vmap(one)(keys)


def told(found: Fit, law: Law):
    """Estimate and deviations (8,) of a fit, and ok."""
    return natural_values(found.robot, law)[:8], jnp.sqrt(jnp.diagonal(found.covariance))[:8], found.ok


def fits_by_auto(keys, rows: int, noise: Noise, excitation: str):
    """The same under the law that each record asks for, one after the other as `identify` does."""
    found = [told(*fit_law(record(key, noise, rows, 1, excitation), jnp.asarray(D_MAX), "auto", False)) for key in keys]
    return tuple(np.stack(part) for part in zip(*found, strict=True))


def judge(seeds: int, rows: int, noise: Noise, excitation: str, truth: str, fitted: str) -> list[str]:
    """Cells of the table for one noise and input."""
    parts = []
    for keys in jax.random.split(jax.random.key(11), (-(-seeds // BLOCK), BLOCK)):
        record_of = keys, rows, noise, excitation
        own = fits_by_auto(*record_of) if fitted == "auto" else fits(*record_of, LAWS[fitted])
        parts.append(jax.device_get((bounds(*record_of, LAWS[truth]), *own)))
    bound, estimate, deviation, ok = (np.concatenate(part)[:seeds] for part in zip(*parts, strict=True))
    error = estimate[ok] - TRUTH
    squares, inside = (error / bound[ok]) ** 2, np.abs(error / deviation[ok]) < 1.96
    rms = np.sqrt(squares.mean(axis=0))
    mean_error = np.std((squares / (2.0 * rms)).mean(axis=1), ddof=1) / np.sqrt(ok.sum())
    cover_error = np.std(inside.mean(axis=1), ddof=1) / np.sqrt(ok.sum())
    return [
        f"{rms.mean():.3f} ± {mean_error:.3f}",
        f"{rms.max():.3f}",
        f"{np.sum(~ok)} of {seeds}",
        f"{np.sum(np.sqrt(squares).max(axis=1) > LOST)}",
        f"{100 * inside.mean():.1f} ± {100 * cover_error:.1f}",
    ]


def main() -> None:
    """Run all cells and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=500)
    parser.add_argument("--rows", type=int, default=1000)
    parser.add_argument("--levels", type=float, nargs="*", default=LEVELS, help="camera noise [mm]")
    parser.add_argument("--fitted", nargs="*", choices=[*LAWS, "auto"], help="only cells fitted so")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("efficiency.csv"))
    options = parser.parse_args()
    rows = [["input", "noise", "fitted as", "RMS over bound", "largest", "failed", "wrong", "95 % intervals cover [%]"]]
    cells = [
        (excitation, f"white, {level:g} mm", Noise(1e-3 * level, 1e-2 * level), "white", "white")
        for excitation in ("multilevel", "staircase")
        for level in options.levels
    ]
    fitted_as = {"white": ("auto",), "ar0.9": ("ar0.9", "white", "auto"), "slip": ("slip", "white", "auto")}
    cells += [("multilevel", f"{law}, 1 mm", NOISES[law], law, one) for law, own in fitted_as.items() for one in own]
    for excitation, label, noise, truth, fitted in cells:
        if options.fitted and fitted not in options.fitted:
            continue
        rows.append([excitation, label, fitted, *judge(options.seeds, options.rows, noise, excitation, truth, fitted)])
        print(" | ".join(rows[-1]), flush=True)
    write_rows(options.out, rows)


if __name__ == "__main__":
    ji.start_jax()
    main()
