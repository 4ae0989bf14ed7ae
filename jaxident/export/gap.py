"""How many millimetres of the gap stay where a target does not carry a part of the model.

A diagnosis beside the model knows it from the robot's own runs. Else the model runs with and without the part on a
default input, and the two are compared over stretches of 1 s.
"""

import dataclasses
import functools
import os
import pathlib

import jax
import numpy as np

from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.simulate import is_random, simulate
from jaxident.errors import InputError
from jaxident.export.split import COUPLING, DEAD_ZONE, DISCOVERED, LOST, RATE, SLIP, Part
from jaxident.files.json_text import read_json
from jaxident.log import Log, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model

HORIZON = 1.0
"""Seconds ahead at which the two are compared, as in the account of a diagnosis."""
ROWS, HOLD = 600, 20
"""Rows of the default input, and rows that each of its levels lasts; NumPy draws them, the same in any precision."""
AT_ONCE = 30.0
"""A robot without rates reaches its speed this many times faster."""


def measured(model: Model, parts: list[Part], diagnosis: str | os.PathLike | None, largest: float) -> list[Part]:
    """The parts, those not carried with how many millimetres stay. diagnosis: a file, or None to compute. largest: the
    largest command of the default input."""
    account = {} if diagnosis is None else read_account(diagnosis)
    runner = functools.cache(lambda: _run(model, largest))
    return [_measured(model, part, account, runner, largest) if part.how == LOST else part for part in parts]


def beside(path: str | os.PathLike) -> pathlib.Path | None:
    """The diagnosis.json in the folder of a model file, if there is one."""
    found = pathlib.Path(path).parent / "diagnosis.json"
    return found if found.is_file() else None


def read_account(path: str | os.PathLike) -> dict[str, float]:
    """Root mean square errors of position [mm] by part, from a diagnosis.json; InputError for another file."""
    name, content = os.fspath(path), read_json(path)
    schema = content.get("schema") if isinstance(content, dict) else None
    if schema != "jaxident.diagnosis/2":
        raise InputError(f"{name}: schema: is {schema!r}; it should be 'jaxident.diagnosis/2'")
    try:
        rows = content["account"]["rows"]
        return {str(row["part"]): float(row["rms_position"]) for row in rows}
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{name}: account.rows: each row should have part and rms_position") from None


def _measured(model: Model, part: Part, account: dict[str, float], runner, largest: float) -> Part:
    name = "slip" if part.name == SLIP else part.name
    if name in account and (part.effect or part.name in (SLIP, DISCOVERED)):
        return part._replace(gap=account[name], source="diagnosis.json")
    less = _without(model, part)
    if less is None:
        return part._replace(source="not measured")
    difference = apart(runner(), _run(less, largest), float(model.sample_period))
    if not np.isfinite(difference):
        return part._replace(source="not measured: the model runs away on the default input")
    return part._replace(gap=1e3 * difference, source="computed on a default input")


def _without(model: Model, part: Part) -> Model | None:
    """The model without a part; None where that makes no model. An effect stays, without doing anything, so that one
    compiled program runs them all."""
    drive = model.physical
    if part.effect:
        effects = tuple(_idle(one) if one.name == part.name else one for one in model.effects)
        return dataclasses.replace(model, effects=effects)
    if part.name == DISCOVERED:
        return dataclasses.replace(model, discovered=())
    if part.name == DEAD_ZONE:
        return dataclasses.replace(model, dead_zone=np.zeros(2))
    if part.name == COUPLING and drive is not None:
        return dataclasses.replace(model, dynamics=drive._replace(coupling=None))
    if part.name == RATE and drive is not None:
        scaled = (None if one is None else AT_ONCE * np.asarray(one) for one in drive)
        return dataclasses.replace(model, dynamics=Physical(*scaled))
    return None


def _idle(effect: Effect) -> Effect:
    return Effect(effect.name, {one.name: one.neutral for one in CATALOGUE[effect.name].parameters})


def _run(model: Model, largest: float) -> np.ndarray:
    """Poses (ROWS, 3) of the model on the default input, without noise; effects of chance draw from one key."""
    levels = np.random.default_rng(0).uniform(-largest, largest, (-(-ROWS // HOLD), 2))
    right, left = np.repeat(levels, HOLD, axis=0)[:ROWS].T
    log = make_log(float(model.sample_period) * np.arange(ROWS), right, left)
    quiet = dataclasses.replace(model, noise=None)
    return _poses(simulate(quiet, log, key=jax.random.key(0) if is_random(quiet) else None))


def _poses(log: Log) -> np.ndarray:
    return np.stack([np.asarray(column) for column in log.pose], axis=1)


def apart(one: np.ndarray, other: np.ndarray, period: float) -> float:
    """Root mean square distance [m] of two paths (rows, 3) after each stretch of HORIZON, both begun at one pose."""
    rows = max(1, min(round(HORIZON / period), len(one) - 1))
    a, b = (_moved(path, rows) for path in (one, other))
    return float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))))


def _moved(path: np.ndarray, rows: int) -> np.ndarray:
    """How far the robot came in each stretch, in the frame of its start (stretches, 2)."""
    x, y, theta = path.T
    dx, dy, angle = x[rows:] - x[:-rows], y[rows:] - y[:-rows], theta[:-rows]
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine * dx + sine * dy, cosine * dy - sine * dx], axis=1)
