"""All questions that a small study answers, on one page: each with its answer first, then its picture.

    python -m experiments.gallery --out gallery

Writes gallery/index.html. Answers are computed, not written down: with another `--seeds` they may differ.
"""

import argparse
import dataclasses
import pathlib
from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np

import jaxident as ji
from jaxident.plot.names import written
from jaxident.plot.studies import Curve
from jaxident.report.page import Figure, Page, Section, write_page

PERIOD, ROWS, HOLD = 1 / 30, 300, 10
CAMERA = ji.Noise(position=5e-4, heading=5e-3)


class Answer(NamedTuple):
    """One sentence, and the picture that it comes from."""

    sentence: str
    picture: Figure


def plain_robot() -> ji.Model:
    """The published robot without coupling of its two speeds."""
    published = ji.load_model("published")
    return dataclasses.replace(published, dynamics=published.physical._replace(coupling=None))


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
    figure, ax = ji.plot.figure(size=(6.3, 3.4))
    ji.plot.error_curves(one.noise.values, curves, label="alpha_2", ax=ax)
    levels = {name: float(summary.breakdown.sel(estimator=name)) for name in names}
    told = [f"{name} from {1e3 * level:g} mm on" for name, level in levels.items() if np.isfinite(level)]
    sentence = f"Broken by it (the median parameter off by a tenth): {', '.join(told) or 'none of them'}."
    return Answer(sentence, _done(figure, "Error against noise"))


def setup_time(seeds: int) -> Answer:
    """How long must the setup time of the recursion be?"""
    rows = (40, 80, 160, 240)
    estimators = [{"method": "recursive", "name": f"{n} rows", "settings": {"setup_samples": n}} for n in rows]
    summary = study(seeds, [1e-5, 1e-4], estimators)
    error = (100 * summary.rmse / np.abs(summary.truth)).median("parameter").transpose("estimator", "noise").values
    figure, ax = ji.plot.figure(size=(6.3, 3.0))
    for column, level in enumerate(summary.noise.values):
        ax.plot(PERIOD * np.array(rows), error[:, column], "o-", label=f"{1e3 * level:g} mm of camera noise")
    ax.set(xlabel="setup time [s]", ylabel="error of the median parameter [%]", yscale="log")
    ji.plot.legend_above(ax)
    enough = [rows[int(np.argmax(column <= 1.2 * column.min()))] for column in error.T]
    ends = {n: f"{PERIOD * n:.1f} s" + (", the longest that was tried," if n == rows[-1] else "") for n in rows}
    pairs = zip(enough, 1e3 * summary.noise.values, strict=True)
    told = " and ".join(f"{ends[n]} at {level:g} mm" for n, level in pairs)
    return Answer(f"Within a fifth of the least error: {told} of camera noise.", _done(figure, "Error by setup time"))


def _bound(inputs: ji.Log) -> np.ndarray:
    """Smallest standard deviation possible of rates, gains and dead zones, in per cent of each."""
    robot = plain_robot()
    bound = ji.cramer_rao(robot, inputs, CAMERA)
    size = np.abs(np.concatenate([*map(np.ravel, (robot.physical.rate, robot.physical.gain, robot.dead_zone))]))
    return 100 * np.asarray(bound.standard_deviation)[: len(size)] / size


def excitation(_: int) -> Answer:
    """Which excitation serves which parameter?"""
    names = ("rate_1", "rate_2", "gain_11", "gain_12", "gain_21", "gain_22", "dead_zone_r", "dead_zone_l")
    inputs = {kind: ji.excite(jax.random.key(0), kind, ROWS, PERIOD, hold=HOLD) for kind in ji.EXCITATIONS}
    table = np.array([_bound(log) for log in inputs.values()])
    figure, ax = ji.plot.figure(size=(6.3, 2.2))
    symbols = [written(name).symbol.replace("_", " ") if name.startswith(("rate", "gain")) else written(name).symbol
               for name in names]  # fmt: skip
    ji.plot.heat_map(table, rows=list(inputs), columns=symbols, label="least standard deviation [%]", ax=ax)
    best = [list(inputs)[k] for k in np.argmin(table, axis=0)]
    told = ", ".join(f"{name} {kind}" for name, kind in zip(names, best, strict=True))
    return Answer(f"The best of five, 10 s each: {told}.", _done(figure, "Bound by excitation and parameter"))


def sample_period(_: int) -> Answer:
    """What does a slower camera cost?"""
    factors, hold = (1, 2, 5), 20
    base = ji.excite(jax.random.key(0), "multilevel", ROWS * 2, PERIOD, hold=hold)
    errors = np.array([_bound(base[::factor]) for factor in factors])
    medians = np.median(errors, axis=1)
    figure, ax = ji.plot.figure(size=(6.3, 3.0))
    ax.plot(1 / (PERIOD * np.array(factors)), errors, color="0.8")
    ax.plot(1 / (PERIOD * np.array(factors)), medians, "o-", label="median parameter")
    ax.set(xlabel="poses a second", ylabel="least standard deviation [%]", yscale="log")
    ji.plot.legend_above(ax)
    ratio = medians[-1] / medians[0]
    return Answer(f"With a fifth of the poses, the median parameter is {ratio:.1f} times as uncertain.",
                  _done(figure, "Bound by rate of the camera"))  # fmt: skip


def asymmetry(_: int) -> Answer:
    """What does a weaker wheel cost?"""
    robot, shares = plain_robot(), np.array([0.0, 0.01, 0.02, 0.05, 0.1])
    log = ji.make_log(PERIOD * np.arange(ROWS), np.ones(ROWS), np.ones(ROWS))
    aside, turned = [], []
    for share in shares:
        gain = np.asarray(robot.physical.gain) * np.array([1.0, 1.0 - share])
        path = ji.simulate(dataclasses.replace(robot, dynamics=robot.physical._replace(gain=gain)), log)
        aside.append(float(path.y[-1]))
        turned.append(float(path.theta[-1]))
    turned = np.array(turned) - turned[0]
    figure, ax = ji.plot.figure(size=(6.3, 3.0))
    ax.plot(100 * shares, turned, "o-")
    ax.set(xlabel="left wheel weaker by [%]", ylabel="turned after 10 s [rad]")
    return Answer(f"A left wheel that is 1 % weaker turns the robot by {turned[1]:.2f} rad in 10 s of equal commands.",
                  _done(figure, "Turn by asymmetry"))  # fmt: skip


QUESTIONS: tuple[Callable[[int], Answer], ...] = (bears_noise, setup_time, excitation, sample_period, asymmetry)
"""Every question is the docstring of the function that answers it."""


def _done(figure, alt: str) -> Figure:
    return Figure(ji.plot.image(figure), alt)


def main() -> None:
    """Answer every question and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("gallery"))
    parser.add_argument("--seeds", type=int, default=40)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    sections = []
    for question in QUESTIONS:
        answer = question(options.seeds)
        sections.append(Section(question.__doc__ or "", [answer.sentence, answer.picture]))
        print(f"{question.__doc__}\n  {answer.sentence}", flush=True)
    lead = "Each question has its answer as the first sentence; the picture below shows where it comes from."
    write_page(Page("What small studies tell", lead, sections, f"{options.seeds} seeds"), options.out / "index.html")


if __name__ == "__main__":
    ji.start_jax()
    main()
