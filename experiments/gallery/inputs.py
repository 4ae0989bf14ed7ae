"""Questions about what is driven and what is measured: excitation, camera rate, further sensors."""

import dataclasses

import jax
import numpy as np

import jaxident as ji
from experiments.gallery.answer import CAMERA, HOLD, PERIOD, ROWS, Answer, picture, plain_robot
from jaxident.plot.names import written
from jaxident.report.page import PHONE
from jaxident.robot.wheel_sensor import WheelSensor

NAMES = ("rate_1", "rate_2", "gain_11", "gain_12", "gain_21", "gain_22", "dead_zone_r", "dead_zone_l")
FINE, COARSE = 0.05, 0.5
"""Noise [rad/s] of two kinds of encoders, at top speeds of 12 rad/s."""


def _bound(inputs: ji.Log, camera: ji.Noise = CAMERA, robot: ji.Model | None = None) -> np.ndarray:
    """Smallest standard deviation possible of rates, gains and dead zones, in per cent of each."""
    robot = robot or plain_robot()
    bound = ji.cramer_rao(robot, inputs, camera)
    size = np.abs(np.concatenate([*map(np.ravel, (robot.physical.rate, robot.physical.gain, robot.dead_zone))]))
    return 100 * np.asarray(bound.standard_deviation)[: len(size)] / size


def excitation(_: int) -> Answer:
    """Which excitation serves which parameter?"""
    inputs = {kind: ji.excite(jax.random.key(0), kind, ROWS, PERIOD, hold=HOLD) for kind in ji.EXCITATIONS}
    table = np.array([_bound(log) for log in inputs.values()])
    figure, ax = ji.plot.figure(size=(6.3, 2.2))
    ji.plot.heat_map(table, rows=list(inputs), columns=_symbols(), label="least standard deviation [%]", ax=ax)
    best = [list(inputs)[k] for k in np.argmin(table, axis=0)]
    told = ", ".join(f"{name} {kind}" for name, kind in zip(NAMES, best, strict=True))
    return Answer(f"The best of five, 10 s each: {told}.", picture(figure, "Bound by excitation and parameter"))


def sample_period(_: int) -> Answer:
    """What does a slower camera cost?"""
    factors, hold = (1, 2, 5), 20
    base = ji.excite(jax.random.key(0), "multilevel", ROWS * 2, PERIOD, hold=hold)
    errors = np.array([_bound(base[::factor]) for factor in factors])
    medians = np.median(errors, axis=1)
    figure, ax = ji.plot.figure(size=(PHONE, 3.0))
    ax.plot(1 / (PERIOD * np.array(factors)), errors, color="0.8")
    ax.plot(1 / (PERIOD * np.array(factors)), medians, "o-", label="median parameter")
    ax.set(xlabel="poses a second", ylabel="least standard deviation [%]", yscale="log")
    ji.plot.legend_above(ax)
    ratio = medians[-1] / medians[0]
    return Answer(f"With a fifth of the poses, the median parameter is {ratio:.1f} times as uncertain.",
                  picture(figure, "Bound by rate of the camera"))  # fmt: skip


def sensors(_: int) -> Answer:
    """What do a second camera and wheel encoders buy?"""
    plain = ji.excite(jax.random.key(0), "multilevel", ROWS, PERIOD, hold=HOLD)
    empty = np.full(ROWS, np.nan)  # measured at every row, as the bound takes it
    counted = plain._replace(wheel_r=empty, wheel_l=empty)
    twice = CAMERA._replace(position=CAMERA.position / np.sqrt(2), heading=CAMERA.heading / np.sqrt(2))
    table = {"one camera": _bound(plain), "two cameras": _bound(plain, twice)} | {
        f"camera and encoders of {noise:g} rad/s": _bound(counted, robot=_with_encoders(noise))
        for noise in (COARSE, FINE)
    }
    figure, ax = ji.plot.figure(size=(6.3, 2.0))
    ji.plot.heat_map(np.array(list(table.values())), rows=list(table), columns=_symbols(),
                     label="least standard deviation [%]", ax=ax)  # fmt: skip
    one, two, coarse, fine = (float(np.median(row)) for row in table.values())
    return Answer(f"The median parameter is {one / two:.2f} times as certain with a second camera, "
                  f"{one / fine:.2f} times with encoders of {FINE:g} rad/s and {one / coarse:.2f} times with encoders "
                  f"of {COARSE:g} rad/s.", picture(figure, "Bound by sensors and parameter"))  # fmt: skip


def _with_encoders(noise: float) -> ji.Model:
    """The robot with encoders on wheels that fit its published speeds (radius 20 mm, track 56 mm)."""
    return dataclasses.replace(plain_robot(), wheels=WheelSensor(radius=0.02, track=0.056, noise=noise))


def _symbols() -> list[str]:
    """The names of the parameters as the picture writes them."""
    return [written(name).symbol.replace("_", " ") if name.startswith(("rate", "gain")) else written(name).symbol
            for name in NAMES]  # fmt: skip
