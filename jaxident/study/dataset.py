"""A study's arrays with names: axes, units, and where the numbers come from."""

import json
import math
import platform
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
import xarray

from jaxident.diagnosis.decide import VERDICTS
from jaxident.effects.catalogue import CATALOGUE
from jaxident.origin import versions as of_packages
from jaxident.robot.model import DIFFERENCE_ORDER, Discovered, Effect
from jaxident.study.design import PARTS, Study, check_study
from jaxident.study.engine import chunks, run_locally
from jaxident.study.estimators import settings_of
from jaxident.study.sight import REASONS

FURTHER_AXES = {
    "estimate": ("estimator", "parameter"),
    "deviation": ("estimator", "parameter"),
    "truth": ("parameter",),
    "reason": ("estimator",),
}
"""The variables of a study, fields of `Outcome`, and their axes after those of the trials."""
OF_DIAGNOSES = {
    "verdict": ("estimator",),
    "takes_part": ("estimator", "catalogue"),
    "named": ("estimator", "catalogue"),
    "alike": ("estimator", "catalogue"),
}
"""Those that only studies with diagnoses have."""
_SMALL = ("reason", "verdict")
"""Variables that are an index."""

_MEANING: dict[str, dict[str, Any]] = {
    "estimate": {"long_name": "estimated parameter, NaN where the estimator failed"},
    "deviation": {"long_name": "standard deviation that the estimator claims, NaN where it claims none"},
    "truth": {"long_name": "parameter of the robot that made the log"},
    "reason": {
        "long_name": "how the estimate ended",
        "flag_values": list(range(len(REASONS))),
        "flag_meanings": "; ".join(REASONS),
    },
    "verdict": {
        "long_name": "verdict of the diagnosis, -1 where the estimator gives none",
        "flag_values": list(range(len(VERDICTS))),
        "flag_meanings": " ".join(VERDICTS),
    },
    "takes_part": {"long_name": "probability that the effect takes part, NaN where the estimator gives none"},
    "named": {"long_name": "1 where the diagnosis names the effect, NaN where the estimator names none"},
    "alike": {"long_name": "1 where the diagnosis says that an effect it names looks like this one, NaN likewise"},
}
_UNITS = {"alpha": "1", "dead_zone": "unit", "1": "m/unit", "2": "rad/unit"}


def study_arrays(study: Study, advance: Callable[[int], None] = lambda trials: None) -> xarray.Dataset:
    """Run a study in memory: all trials with named axes; advance(trials) is called after each chunk. InputError for a
    study that makes no sense; needs double precision."""
    check_study(study)
    arrays = {name: np.empty(shape, kind) for name, (shape, kind) in layout(study).items()}
    cut = chunks(study)
    for number, outcome in run_locally(study, range(len(cut))):
        for name, array in arrays.items():
            array[cut[number].cut] = getattr(outcome, name)
        advance(math.prod(cut[number].shape))
    axes = study.axes
    further = further_axes(study)
    made = xarray.Dataset({name: (axes + further[name], array, _MEANING[name]) for name, array in arrays.items()})
    return made.assign_coords(coordinates(study).coords).assign_attrs(coordinates(study).attrs)


def further_axes(study: Study) -> dict[str, tuple[str, ...]]:
    """The variables of a study and their axes after those of the trials."""
    return FURTHER_AXES | (OF_DIAGNOSES if study.diagnoses else {})


def layout(study: Study) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
    """Shape and type of each variable."""
    further = {"estimator": len(study.estimators), "parameter": len(DIFFERENCE_ORDER), "catalogue": len(CATALOGUE)}
    return {
        name: (study.shape + tuple(further[axis] for axis in axes), np.dtype("i1" if name in _SMALL else "f8"))
        for name, axes in further_axes(study).items()
    }


def attributes(name: str) -> dict[str, Any]:
    """What a variable means."""
    return _MEANING[name]


def coordinates(study: Study) -> xarray.Dataset:
    """The axes of a study with their units, and its provenance: a dataset without variables."""
    noise = np.asarray(study.noise, float)
    entries: dict[str, tuple[str, Any, dict[str, Any]]] = {
        "excitation": ("excitation", list(study.excitations), {}),
        "samples": ("samples", list(study.samples), {"long_name": "rows of a run"}),
        "robot": ("robot", [candidate.name for candidate in study.robots], {}),
        "period": ("period", list(study.period), {"units": "s", "long_name": "sample period"}),
        "amplitude": ("amplitude", list(study.amplitude), {"units": "unit", "long_name": "largest command"}),
        "noise": ("noise", noise, {"units": "m", "long_name": "standard deviation of the camera's position"}),
        "heading_noise": (
            "noise",
            study.heading_per_position * noise,
            {"units": "rad", "long_name": "standard deviation of the camera's heading"},
        ),
        "seed": ("seed", np.arange(study.seeds), {}),
        "estimator": ("estimator", [choice.name for choice in study.estimators], {}),
        "parameter": ("parameter", list(DIFFERENCE_ORDER), {"long_name": "as in a model file"}),
        "unit": ("parameter", [_unit(name) for name in DIFFERENCE_ORDER], {}),
    }
    if study.diagnoses:
        entries["catalogue"] = ("catalogue", list(CATALOGUE), {"long_name": "effects that a diagnosis may name"})
    if study.effects:
        entries["effect"] = ("effect", [one.name for one in study.effects], {"long_name": "effects added to the robot"})
    return xarray.Dataset(coords=entries, attrs=provenance(study))


def provenance(study: Study) -> dict[str, str]:
    """Name, seed, versions and the whole study as JSON text."""
    return {
        "title": study.name,
        "seed": str(study.seed),
        "versions": json.dumps(of_packages() | versions()),
        "study": json.dumps(describe(study)),
    }


def versions() -> dict[str, str]:
    """What a study's last bits depend on besides itself; the version of Python is no part of that."""
    packages = {name: found for name, found in of_packages().items() if name != "python"}
    return packages | {"device": jax.default_backend(), "machine": platform.machine()}


def describe(study: Study) -> dict[str, Any]:
    """Everything that a study's numbers depend on, as lists, numbers and text."""
    plain = {key: list(v) if isinstance(v, tuple) else v for key, v in study._asdict().items()}
    robots = [
        {"name": one.name, **_parts(one.model), "spread": dict(zip(PARTS, one.spread, strict=True))}
        for one in study.robots
    ]
    estimators = [{"name": one.name, "method": one.method, **settings_of(one)} for one in study.estimators]
    plain |= {"robots": robots, "estimators": estimators}
    added = [{"name": one.name, "effects": _sizes(one.effects)} for one in study.effects]
    # what a study does not use is left out, as older versions did: their folders go on
    unused = {"effects"} | ({"runs"} if study.runs == 1 else set())
    return {key: value for key, value in plain.items() if key not in unused} | ({"effects": added} if added else {})


def _parts(model: Any) -> dict[str, Any]:
    drive, noise = model.dynamics, model.noise
    lists = {key: None if part is None else np.asarray(part, float).tolist() for key, part in drive._asdict().items()}
    slip = None if noise is None else [float(noise.slip_along), float(noise.slip_heading)]
    plain = lists | {"dead_zone": np.asarray(model.dead_zone, float).tolist(), "slip": slip}
    plain |= {"effects": _sizes(model.effects)} if model.effects else {}
    plain |= {"wheels": list(map(float, model.wheels))} if model.wheels else {}
    return plain | ({"discovered": [_law(law) for law in model.discovered]} if model.discovered else {})


def _law(law: Discovered) -> dict[str, Any]:
    kind = {"acts_on": law.acts_on, "times": law.times, "signal": law.signal}
    curve = {"at": np.asarray(law.at, float).tolist(), "value": np.asarray(law.value, float).tolist()}
    if not law.second_signal:
        return kind | curve
    return kind | curve | {"second_signal": law.second_signal, "second_at": np.asarray(law.second_at, float).tolist()}


def _sizes(effects: Sequence[Effect]) -> dict[str, dict[str, float]]:
    return {effect.name: {key: float(value) for key, value in effect.parameters.items()} for effect in effects}


def _unit(parameter: str) -> str:
    kind, _, index = parameter.rpartition("_")
    return _UNITS[kind] if kind in _UNITS else _UNITS[index[0]]
