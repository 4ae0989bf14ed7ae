"""Residuals of the nominal model as accelerations, and what each effect of the catalogue would add to them.

The textbook's way, without start states, noise law or refit: speeds from differences of poses, less those of the
nominal model under the same commands; over windows of a fifth of a second what is left must be a sum of terms.
"""

from typing import NamedTuple

import numpy as np

import jaxident as ji
from jaxident.log import Log

WINDOW = 0.2


class Regression(NamedTuple):
    """Rows are windows of the three channels, one below the other, each in units of its own spread: target (rows,),
    nominal columns (rows, 8), and the columns of each effect. Windows `apart` rows away share no pose; run (rows,)
    numbers the runs."""

    target: np.ndarray
    nominal: np.ndarray
    effects: dict[str, np.ndarray]
    apart: int
    run: np.ndarray


def regression(model: ji.Model, runs: list[Log]) -> Regression:
    """The regression of all runs of a case."""
    span = sum(float(run.t[-1] - run.t[0]) for run in runs)
    parts, begin = [], 0.0
    for run in runs:
        parts.append(_one(model, run, begin, span))
        begin += float(run.t[-1] - run.t[0])
    channels = [np.concatenate([part[0][c] for part in parts]) for c in range(3)]
    weight = [1.0 / (1.4826 * np.median(np.abs(r - np.median(r)))) for r in channels]

    def stacked(key):
        return np.concatenate([np.concatenate([key(part)[c] for part in parts]) * weight[c] for c in range(3)])

    number = np.concatenate([np.repeat(np.arange(len(parts)), [len(part[0][c]) for part in parts]) for c in range(3)])
    apart = 2 * max(2, round(WINDOW / float(np.median(np.diff(runs[0].t)))))
    effects = {name: stacked(lambda part, name=name: part[2][name]) for name in parts[0][2]}
    return Regression(stacked(lambda part: part[0]), stacked(lambda part: part[1]), effects, apart, number)


def _one(model: ji.Model, run: Log, begin: float, span: float):
    """Targets, nominal columns and effect columns of one run, each a triple of channels."""
    start = ji.State(*(float(column[0]) for column in run.pose), 0.0, 0.0)
    told = run._replace(u_r=np.nan_to_num(run.u_r), u_l=np.nan_to_num(run.u_l))
    nominal = speeds(ji.simulate(model, told, start=start))
    period = float(np.median(np.diff(run.t)))
    size = max(2, round(WINDOW / period))
    rate, gain = np.array(model.physical.rate), np.array(model.physical.gain)
    residual = speeds(run) - nominal
    target = [
        slope(residual[:, 0], size, period) + rate[0] * mean(residual[:, 0], size),
        mean(residual[:, 1], size),
        slope(residual[:, 2], size, period) + rate[1] * mean(residual[:, 2], size),
    ]
    signals = _signals(model, told, nominal, begin, span)
    m, v, w = (signals[key] for key in ("m", "v", "w"))

    def column(along=None, lateral=None, heading=None):
        given = [np.zeros(len(v)) if each is None else each for each in (along, lateral, heading)]
        return [mean(each, size)[:, None] for each in given]

    def wheels(each):
        return join([column(gain[0, k] * each[:, k], None, gain[1, k] * each[:, k]) for k in range(2)])

    base = [column(along=c) for c in (v, w, *m.T)] + [column(heading=c) for c in (v, w, *m.T)]
    return target, join(base), _library(signals, column, wheels)


def _signals(model: ji.Model, run: Log, nominal: np.ndarray, begin: float, span: float) -> dict[str, np.ndarray]:
    """What terms are made of, at the rows between which speeds are taken."""
    u = np.stack(run.command, axis=1)[:-1]
    width = np.array(model.dead_zone)
    m = np.sign(u) * np.maximum(np.abs(u) - width, 0.0)
    v, _, w = nominal.T
    n = np.linalg.solve(np.array(model.physical.gain), (np.array(model.physical.rate) * nominal[:, [0, 2]]).T).T
    late = np.concatenate([m[:1], m[:-1]])
    sign = np.sign(m)
    turned = (sign != np.concatenate([sign[:1], sign[:-1]])) & (sign != 0)
    x, y, theta = (np.asarray(column)[:-1] for column in run.pose)
    time = (np.asarray(run.t)[:-1] - run.t[0] + begin) / span
    return {"u": u, "m": m, "n": n, "v": v, "w": w, "late": late, "turned": turned, "x": x, "y": y, "theta": theta,
            "time": time, "push": m - n}  # fmt: skip


def _library(s: dict[str, np.ndarray], column, wheels) -> dict[str, list[np.ndarray]]:
    """The columns of each effect that has some; those of chance alone and of steps within a row have none."""
    u, m, n, v, w = (s[key] for key in ("u", "m", "n", "v", "w"))
    x, y, cosine, sine, time = s["x"], s["y"], np.cos(s["theta"]), np.sin(s["theta"]), s["time"]
    size = np.abs(u).sum(axis=1)[:, None]
    radius = x * x + y * y
    return {
        "asymmetric_dead_zone": wheels((m != 0.0) * 1.0),
        "direction_gain": wheels(np.abs(m)),
        "input_saturation": wheels(np.sign(u) * np.maximum(np.abs(u) - 0.7, 0.0)),
        "transport_delay": wheels(s["late"] - m),
        "backlash": wheels(s["turned"] * np.sign(m)),
        "supply_sag": wheels(m * size),
        "coulomb_friction": wheels(np.sign(n)),
        "stiction": wheels(np.sign(n) * np.exp(-((n / 0.05) ** 2))),
        "quadratic_drag": join([column(along=v * np.abs(v)), column(heading=w * np.abs(w))]),
        "mass_offset": join([column(along=w * w), column(heading=v * w)]),
        "turn_loss": column(along=np.abs(w) * v),
        "traction_limit": wheels(s["push"] ** 3),
        "lateral_slip": column(lateral=v * w),
        "slope": join([column(along=cosine), column(along=sine)]),
        "gain_drift": wheels(m * (time - 0.5)[:, None]),
        "dead_zone_drift": wheels(np.sign(m) * (time - 0.5)[:, None]),
        "payload_change": wheels(s["push"] * (time > 0.5)[:, None]),
        "marker_offset": join([column(lateral=w), column(along=w * 0.0 + np.gradient(w))]),
        "heading_offset": column(lateral=v),
        "camera_scale": column(along=v * (cosine**2 - sine**2), lateral=-2.0 * v * cosine * sine),
        "lens_distortion": column(along=v * radius, lateral=v * (cosine * y - sine * x) * (cosine * x + sine * y)),
        "camera_tilt": join([column(along=v * x), column(along=v * y)]),
    }


def speeds(run: Log) -> np.ndarray:
    """Along, lateral and turning speed (rows - 1, 3) from differences of poses, in the frame of the middle heading."""
    x, y, theta = (np.asarray(column) for column in run.pose)
    step, turn = np.diff(run.t), np.diff(np.unwrap(theta))
    middle = np.unwrap(theta)[:-1] + 0.5 * turn
    dx, dy, cosine, sine = np.diff(x), np.diff(y), np.cos(middle), np.sin(middle)
    return np.stack([dx * cosine + dy * sine, dy * cosine - dx * sine, turn], axis=1) / step[:, None]


def mean(signal: np.ndarray, size: int) -> np.ndarray:
    """Means over triangular windows of 2 `size` rows: those that weigh the derivative in `slope`."""
    box = np.full(size, 1.0 / size)
    return np.convolve(np.convolve(signal, box, mode="valid"), box, mode="valid")[:-1]


def slope(signal: np.ndarray, size: int, period: float) -> np.ndarray:
    """Difference of the means of neighbouring windows of `size` rows, per second."""
    smooth = np.convolve(signal, np.full(size, 1.0 / size), mode="valid")
    return (smooth[size:] - smooth[:-size]) / (size * period)


def join(columns: list[list[np.ndarray]]) -> list[np.ndarray]:
    """Columns side by side, channel by channel."""
    return [np.concatenate(parts, axis=1) for parts in zip(*columns, strict=True)]
