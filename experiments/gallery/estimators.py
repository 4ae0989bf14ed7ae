"""Questions about estimators: the noise that they bear, and the settings of the recursion."""

import dataclasses

import jax
import numpy as np

import jaxident as ji
from experiments.gallery.answer import HOLD, PERIOD, ROWS, Answer, picture, plain_robot
from jaxident.effects.apply import with_effects
from jaxident.plot import style
from jaxident.plot.studies import Curve
from jaxident.report.page import PHONE
from jaxident.robot.model import DIFFERENCE_ORDER

DRIVEN = 2000
"""Rows of a run with drift: 67 s."""


def study(seeds: int, noise: list[float], estimators: list) -> tuple:
    """Summary of a study of the plain robot, its axes of one entry dropped."""
    content = {"seeds": seeds, "noise": noise, "samples": [ROWS], "hold": HOLD, "robots": [{"model": plain_robot()}],
               "estimators": estimators}  # fmt: skip
    return ji.summarise(ji.study(content)).squeeze()


def bears_noise(seeds: int) -> Answer:
    """How much camera noise does each estimator bear?"""
    names = ("batch", "recursive", "instrumental-variables")
    summary = study(seeds, [1e-6, 1e-5, 1e-4, 1e-3], [{"method": name} for name in names])
    one = summary.sel(parameter="alpha_2")
    curves = {name: Curve(*(one[key].sel(estimator=name).values for key in Curve._fields)) for name in names}
    figure, ax = ji.plot.figure(size=(PHONE, 3.4))
    ji.plot.error_curves(one.noise.values, curves, label="alpha_2", ax=ax)
    levels = {name: float(summary.breakdown.sel(estimator=name)) for name in names}
    told = [f"{name} from {1e3 * level:g} mm on" for name, level in levels.items() if np.isfinite(level)]
    sentence = f"Broken by it (the median parameter off by a tenth): {', '.join(told) or 'none of them'}."
    return Answer(sentence, picture(figure, "Error against noise"))


def setup_time(seeds: int) -> Answer:
    """How long must the setup time of the recursion be?"""
    rows = (40, 80, 160, 240)
    estimators = [{"method": "recursive", "name": f"{n} rows", "settings": {"setup_samples": n}} for n in rows]
    summary = study(seeds, [1e-5, 1e-4], estimators)
    error = (100 * summary.rmse / np.abs(summary.truth)).median("parameter").transpose("estimator", "noise").values
    figure, ax = ji.plot.figure(size=(PHONE, 3.0))
    for column, level in enumerate(summary.noise.values):
        ax.plot(PERIOD * np.array(rows), error[:, column], "o-", label=f"{1e3 * level:g} mm of camera noise")
    ax.set(xlabel="setup time [s]", ylabel="error of the median parameter [%]", yscale="log")
    ji.plot.legend_above(ax)
    enough = [rows[int(np.argmax(column <= 1.2 * column.min()))] for column in error.T]
    ends = {n: f"{PERIOD * n:.1f} s" + (", the longest that was tried," if n == rows[-1] else "") for n in rows}
    pairs = zip(enough, 1e3 * summary.noise.values, strict=True)
    told = " and ".join(f"{ends[n]} at {level:g} mm" for n, level in pairs)
    return Answer(f"Within a fifth of the least error: {told} of camera noise.", picture(figure, "Error by setup time"))


def forgetting(seeds: int) -> Answer:
    """Which forgetting factor serves a robot that drifts?"""
    factors, falls = (0.9, 0.95, 0.97, 0.98, 0.99, 0.995), (0.01, 0.05, 0.2, 0.5)
    inputs = ji.excite(jax.random.key(0), "staircase", DRIVEN, PERIOD, hold=5)
    figure, ax = ji.plot.figure(size=(PHONE, 3.4))
    best = []
    for fall, (colour, marker) in zip(falls, style.SERIES, strict=False):
        logs = [_drifting(inputs, fall, seed) for seed in range(max(2, seeds // 10))]
        error = np.array([[_off(log, fall, factor) for factor in factors] for log in logs])
        spread = error.std(axis=0, ddof=1) / np.sqrt(len(logs))
        label = f"gains fall by {100 * fall:g} % a minute"
        ax.errorbar(1.0 - np.array(factors), error.mean(axis=0), 2 * spread, color=colour, marker=marker, label=label)
        best.append(f"{factors[int(np.argmin(error.mean(axis=0)))]:g} if they fall by {100 * fall:g} %")
    ax.set(xlabel="forgetting factor", ylabel="error of delta_21 [%]", xscale="log", yscale="log")
    ax.set_xticks(1.0 - np.array(factors), [f"{factor:g}" for factor in factors])
    ax.set_xticks([], minor=True)
    ji.plot.legend_above(ax)
    return Answer(f"The best factor of six, by how much the gains fall in a minute: {', '.join(best)}.",
                  picture(figure, "Error by forgetting factor"))  # fmt: skip


def _drifting(inputs: ji.Log, fall: float, seed: int) -> ji.Log:
    """What a camera of 1 um sees of the robot whose gains fall by this share in a minute."""
    robot = dataclasses.replace(plain_robot(), noise=ji.Noise(1e-6, 1e-5))
    tired = with_effects(robot, [("gain_drift", {"rate": -fall / 60.0})])
    return ji.simulate(tired, inputs, key=jax.random.key(seed))


def _off(log: ji.Log, fall: float, factor: float) -> float:
    """Root mean square error [%] of delta_21 over the second half of a run, by the paper's recursion."""
    history = ji.identify(log, "paper", forgetting=factor, reading="one_step").history.parameters
    half = len(log.t) // 2
    slope = float(np.asarray(ji.to_difference(plain_robot().physical, PERIOD).delta)[1, 0])
    true = slope * (1.0 - fall * np.asarray(log.t)[half:] / 60.0)
    found = np.asarray(history)[-len(true) :, DIFFERENCE_ORDER.index("delta_21")]
    return 100.0 * float(np.sqrt(np.mean((found / true - 1.0) ** 2)))
