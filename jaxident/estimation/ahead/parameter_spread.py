"""Robots as likely as a model's covariance says: what its parameters' uncertainty does to anything computed from it."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxident.array_types import Array
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.law_kinds import MOST_KNOTS, MOST_SURFACE_KNOTS, knots_by_signal, value_name
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Model, require_physical

STEP = 1e-4
"""Part of a parameter's size, or of its deviation if that is smaller, by which a robot is moved."""
MOST, MIXED = 48, 24
"""Directions that are followed one by one, each of which costs a run of the filter, and random mixtures that stand for
more of them: a surface alone has 64 values. A variance then has a standard error of 26 % (of 141 directions: the square
root of 2 / MIXED, times the part left out), a standard deviation one of 13 %."""
FURTHER = 0.5
"""Part of the range of a discovered law's knots over which it may go on beyond them. No other value was tried."""
NO_SIZE = 1e-6
"""Below which a parameter says nothing of its size, in its own unit."""


def directions(model: Model) -> list[tuple[Model, float]]:
    """Robots moved along the independent directions of the model's covariance, or along mixtures of these (`MOST`), and
    by how many deviations each; and robots whose laws go on beyond their knots. None for a model without a covariance.
    What changes from the model to one of them, over that number, is one deviation's worth."""
    values = parameter_values(model)
    own = [k for k, name in enumerate(model.parameter_order) if name in values]
    if model.covariance is None or not own:
        return []
    names = [model.parameter_order[k] for k in own]
    here = np.array([values[name] for name in names])
    found = []
    for direction in _roots(np.asarray(model.covariance, float)[np.ix_(own, own)]):
        size = STEP * min(1.0, float(np.min(np.abs(_sizes(names, here)) / np.maximum(np.abs(direction), 1e-300))))
        found.append((with_values(model, dict(zip(names, here + size * direction, strict=True))), size))
    return found + [
        (dataclasses.replace(model, discovered=(*model.discovered[:k], other, *model.discovered[k + 1 :])), STEP)
        for k, law in enumerate(model.discovered)
        for other in _continued(law)
    ]


def opposite(model: Model, other: Model) -> Model | None:
    """The robot as far from a model as another one, on the other side; None where that one's laws have more knots."""
    here, there = parameter_values(model), parameter_values(other)
    if here.keys() != there.keys():
        return None
    return with_values(model, {name: 2.0 * value - there[name] for name, value in here.items()})


def _continued(law: Discovered) -> list[Discovered]:
    """A law that goes on beyond each end of its knots, as steep as it is inside (root mean square), STEP of that: what
    it does there nobody has seen. From FURTHER of its range on it is constant again."""
    value, found = np.asarray(law.value, float), []
    most = MOST_SURFACE_KNOTS if law.second_signal else MOST_KNOTS
    for axis, at in enumerate(knots_by_signal(law).values()):
        if len(at) == most:
            continue  # no room for a knot more
        along, far = np.moveaxis(value, axis, 0), FURTHER * np.ptp(at)
        rise = STEP * far * np.sqrt(np.mean((np.diff(along, axis=0).T / np.diff(at)) ** 2))
        for knots, moved in (
            (np.append(at, at[-1] + far), np.append(along, along[-1:] + rise, axis=0)),
            (np.insert(at, 0, at[0] - far), np.insert(along, 0, along[0] + rise, axis=0)),
        ):
            own: dict[str, Any] = {("at", "second_at")[axis]: knots, "value": np.moveaxis(moved, 0, axis)}
            found.append(dataclasses.replace(law, **own, standard_deviation=None))
    return found


def _roots(covariance: Array) -> np.ndarray:
    """Rows (n, n) whose outer products add up to a covariance (n, n); of more than MOST, MIXED rows whose outer
    products do so on average."""
    deviation = np.sqrt(np.maximum(np.diagonal(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / deviation / deviation[:, None])
    roots = (vectors * np.sqrt(np.maximum(values, 0.0))).T * deviation
    if len(roots) <= MOST:
        return roots
    mixed, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(len(roots), MIXED)))
    return np.sqrt(len(roots) / MIXED) * mixed.T @ roots


def _sizes(names: list[str], values: Array) -> np.ndarray:
    """Typical sizes (n,) of parameters: their own, or where they are next to nothing that of the largest of their kind,
    of an effect that of a clear case. Values of a discovered law are of one kind. A kind that is next to nothing has no
    size (infinite): a step is then a part of the deviation.

    A drag at its bound of 0 once made steps of 1e-9, two dead zones of 0 made some of 1e-10. The filter's own
    differences are good to some 1e-9 m, so that the predicted deviations came out as 23 m, or 7e7 m."""
    kinds = [name if name.count(".") == 1 else name.replace(".", "_").rsplit("_", 1)[0] for name in names]
    largest = {kind: max(abs(v) for k, v in zip(kinds, values, strict=True) if k == kind) for kind in kinds}
    sizes = np.array([max(largest[kind], _clear(kind)) for kind in kinds])
    return np.where(sizes > NO_SIZE, sizes, np.inf)


def _clear(kind: str) -> float:
    """The size of an effect's parameter in a clear case, or where that is neutral the largest on real robots; 0 for
    what is no parameter of an effect."""
    effect, _, name = kind.partition(".")
    own = [each for each in CATALOGUE[effect].parameters if each.name == name] if effect in CATALOGUE else []
    return max((abs(each.typical) or max(map(abs, each.range)) for each in own), default=0.0)


def parameter_values(model: Model) -> dict[str, float]:
    """The parameters of a physical model by name: rate_1, gain_12, dead_zone_r, coupling_1, effect.parameter, and
    `value_name` of discovered laws."""
    drive = require_physical(model)
    coupling = (0.0, 0.0) if drive.coupling is None else drive.coupling
    rows: Mapping[str, Array] = {
        "rate_1": drive.rate[0], "rate_2": drive.rate[1],
        **{f"gain_{i + 1}{j + 1}": drive.gain[i][j] for i in (0, 1) for j in (0, 1)},
        "dead_zone_r": model.dead_zone[0], "dead_zone_l": model.dead_zone[1],
        "coupling_1": coupling[0], "coupling_2": coupling[1],
    }  # fmt: skip
    effects = {f"{e.name}.{key}": value for e in model.effects for key, value in e.parameters.items()}
    laws = {
        value_name(k, n): value for k, law in enumerate(model.discovered) for n, value in enumerate(np.ravel(law.value))
    }
    return {name: float(value) for name, value in (dict(rows) | effects | laws).items()}


def with_values(model: Model, changed: Mapping[str, float]) -> Model:
    """The model with some parameters replaced."""
    value = parameter_values(model) | dict(changed)
    drive = Physical(
        np.array([value["rate_1"], value["rate_2"]]),
        np.array([[value["gain_11"], value["gain_12"]], [value["gain_21"], value["gain_22"]]]),
        np.array([value["coupling_1"], value["coupling_2"]]),
    )
    effects = tuple(
        dataclasses.replace(e, parameters={key: value[f"{e.name}.{key}"] for key in e.parameters})
        for e in model.effects
    )  # fmt: skip
    laws = tuple(
        dataclasses.replace(
            law, value=np.reshape([value[value_name(k, n)] for n in range(np.size(law.value))], np.shape(law.value))
        )
        for k, law in enumerate(model.discovered)
    )
    dead_zone = np.array([value["dead_zone_r"], value["dead_zone_l"]])
    return dataclasses.replace(model, dynamics=drive, dead_zone=dead_zone, effects=effects, discovered=laws)
