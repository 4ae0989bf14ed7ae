"""Trials of a study that nobody ran."""

import numpy as np
import xarray

from jaxident.study.dataset import coordinates, further_axes, layout


def invented(study):
    """Trials whose estimates are the truth and an error of one per cent."""
    draws = np.random.default_rng(0)
    arrays = {name: np.zeros(shape, kind) for name, (shape, kind) in layout(study).items()}
    arrays["truth"] += 1.0
    arrays["deviation"] += 0.01
    arrays["estimate"] = 1.0 + 0.01 * draws.normal(size=arrays["estimate"].shape)
    named = {name: (study.axes + further_axes(study)[name], array) for name, array in arrays.items()}
    return xarray.Dataset(named).assign_coords(coordinates(study).coords).assign_attrs(coordinates(study).attrs)
