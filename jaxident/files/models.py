"""Model files: one robot as JSON, "schema": "jaxident.model/1".

Where `physical` is present it is the truth; alpha, delta and epsilon then stand in the file as its image at the sample
period, are checked against it on loading and never used. Numbers come back as NumPy float64 arrays and Python floats,
so that loading needs no switch of JAX.
"""

import importlib.resources
import os
from collections.abc import Collection
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.effects.catalogue import CATALOGUE
from jaxident.errors import InputError
from jaxident.files.atomic import Target, write_text
from jaxident.files.json_text import format_json, parse_json, read_json
from jaxident.files.model_provenance import read_provenance, write_provenance
from jaxident.files.model_sections import (
    SHAPES,
    or_none,
    read_covariance,
    read_discovered,
    read_effects,
    read_noise,
    read_physical,
    read_spread,
    read_wheels,
    to_lists,
    write_covariance,
    write_deviations,
    write_discovered,
    write_effect,
    write_noise,
    write_physical,
    write_wheels,
)
from jaxident.files.schema import take_array, take_keys, take_number
from jaxident.files.source import Source
from jaxident.numerics import float64_switch
from jaxident.robot.difference import Difference, to_difference
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model, Provenance

SCHEMA = "jaxident.model/1"
SHIPPED = ("published", "published-simplified")
"""Robots that come with the program, loaded by name where no file of that name exists."""
IMAGE_TOLERANCE = 1e-6
"""Largest departure of alpha, delta, epsilon from the image of `physical`, relative to the largest entry of each."""

_NEEDED = ("schema", "sample_period", *SHAPES, "physical")
_FREE = ("noise", "effects", "discovered", "standard_deviation", "covariance", "provenance", "wheels")
_compiled_image = jax.jit(to_difference)


def load_model(path: Source, known_effects: Collection[str] = tuple(CATALOGUE)) -> Model:
    """Load a model from its file, or a robot that comes with the program by its name.

    Args:
        path: the file, or "published" or "published-simplified".
        known_effects: names that the file's effects may have, by default those of the catalogue.

    Returns:
        Model: its numbers are NumPy float64 arrays.

    Raises:
        InputError: one line that names the file and the key at fault.

    Examples:
        >>> import jaxident as ji
        >>> ji.load_model("published").physical.rate.round(2)
        array([0.54, 7.82])
    """
    name = os.fspath(path)
    if os.path.exists(path):
        return model_from_dict(read_json(path), known_effects, name)
    if name in SHIPPED:
        shipped = importlib.resources.files("jaxident") / "robots" / f"{name.replace('-', '_')}.json"
        return model_from_dict(parse_json(shipped.read_text("utf-8"), name), known_effects, name)
    raise InputError(f"{name}: no such file, nor a robot that comes with the program ({', '.join(SHIPPED)})")


def save_model(model: Model, path: Target) -> None:
    """Write a model file, whole or not at all; it reads back exactly.

    Args:
        model: the model.
        path: the file.

    Raises:
        InputError: a model that would not load, or a file that cannot be written.
        WorkError: the disk is full.

    Examples:
        >>> import jaxident as ji
        >>> ji.save_model(ji.load_model("published"), "robot.json")
        >>> ji.load_model("robot.json").dead_zone
        array([0.25, 0.2 ])
    """
    write_text(path, format_json(model_to_dict(model)))


def model_to_dict(model: Model) -> dict[str, Any]:
    """The content of the model's file: dicts, lists, strings, numbers and None.

    Standard deviations that are not finite (a parameter that the data do not determine) become null. InputError for
    a model that `model_from_dict` would refuse.
    """
    difference = model.difference if model.physical is None else _image(model.physical, model.sample_period)
    content = {
        "schema": SCHEMA,
        "sample_period": float(model.sample_period),
        **{key: to_lists(value) for key, value in difference._asdict().items()},
        "dead_zone": to_lists(model.dead_zone),
        "physical": or_none(write_physical, model.physical),
        "noise": or_none(write_noise, model.noise),
        "effects": [write_effect(effect) for effect in model.effects],
        **({"discovered": [write_discovered(law) for law in model.discovered]} if model.discovered else {}),
        **({} if model.wheels is None else {"wheels": write_wheels(model.wheels)}),
        "standard_deviation": write_deviations(model.standard_deviation),
        "covariance": or_none(write_covariance, model.covariance, model.parameter_order),
        "provenance": write_provenance(model.provenance),
    }
    model_from_dict(content, {effect.name for effect in model.effects}, "this model")
    return content


def model_from_dict(content: Any, known_effects: Collection[str] = tuple(CATALOGUE), name: str = "model") -> Model:
    """The model that a file's content describes; `name` is what error lines call the file.

    The keys from noise on may be left out: none. InputError for an unknown or missing key and for a value of a wrong
    kind, shape or sign.
    """
    found = take_keys(content, name, _NEEDED, _FREE)
    if found["schema"] != SCHEMA:
        raise InputError(f"{name}: schema: is {found['schema']!r}; this program reads {SCHEMA!r}")
    period = take_number(found["sample_period"], f"{name}: sample_period", least=0.0)
    if period == 0.0:
        raise InputError(f"{name}: sample_period: is 0; it should be the positive time between samples in seconds")
    difference = Difference(
        *(take_array(found[key], f"{name}: {key}", SHAPES[key]) for key in ("alpha", "delta", "epsilon"))
    )
    physical = or_none(read_physical, found["physical"], f"{name}: physical")
    if physical is not None:
        _check_image(difference, physical, period, name)
    if found["discovered"] and physical is None:
        raise InputError(f"{name}: discovered: needs a model with physical parameters; `physical` is null")
    order, covariance = or_none(read_covariance, found["covariance"], f"{name}: covariance") or ((), None)
    return Model(
        sample_period=period,
        dynamics=difference if physical is None else physical,
        dead_zone=take_array(found["dead_zone"], f"{name}: dead_zone", SHAPES["dead_zone"], least=0.0),
        noise=or_none(read_noise, found["noise"], f"{name}: noise"),
        effects=or_none(read_effects, found["effects"], f"{name}: effects", known_effects) or (),
        standard_deviation=or_none(read_spread, found["standard_deviation"], f"{name}: standard_deviation"),
        covariance=covariance,
        parameter_order=order,
        provenance=or_none(read_provenance, found["provenance"], f"{name}: provenance") or Provenance(),
        discovered=or_none(read_discovered, found["discovered"], f"{name}: discovered") or (),
        wheels=or_none(read_wheels, found["wheels"], f"{name}: wheels"),
    )


def _check_image(given: Difference, physical: Physical, period: float, name: str) -> None:
    for key, value, image in zip(Difference._fields, given, _image(physical, period), strict=True):
        if not np.isfinite(image).all():
            raise InputError(f"{name}: physical: its {key} at this sample_period overflows; give rates in 1/s")
        if np.any(np.abs(value - image) > IMAGE_TOLERANCE * np.max(np.abs(image))):
            raise InputError(
                f"{name}: {key}: does not follow from physical at this sample_period, whose image is "
                f"{image.tolist()}; correct one of the two, or set physical to null"
            )


def _image(physical: Physical, period: Any) -> Difference:
    """`to_difference` in double precision, whatever JAX is set to; compiled, for that is quicker even once."""
    exact = Physical(*(or_none(np.asarray, value, np.float64) for value in physical))
    with float64_switch(True):
        return Difference(*(np.asarray(value) for value in _compiled_image(exact, jnp.asarray(period, float))))
