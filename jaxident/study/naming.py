"""What the diagnoses of a study name: right names, wrong ones, and how often nothing is claimed.

Every number is a mean over the trials of a cell whose log was not refused; its standard error is that of a mean. An
effect counts as named under its own name alone, but for `right_or_alike`: there a wrong name stands for an effect that
the diagnosis says it cannot tell from a named one.
"""

import json
import warnings
from typing import Any

import numpy as np
import xarray

from jaxident.diagnosis.decide import VERDICTS
from jaxident.study.estimators import DIAGNOSE
from jaxident.study.statistics import cell_axes

CLAIMS = tuple(VERDICTS.index(name) for name in ("effects", "partly", "unknown"))
"""Verdicts that say that something acts which the nominal model has not."""


def naming(trials: xarray.Dataset) -> xarray.Dataset | None:
    """Statistics of the diagnoses of a study, by cell and diagnosis; None of a study without.

    Args:
        trials: of `jaxident.study`.

    Returns:
        xarray.Dataset: axes of the cells, `estimator` (diagnoses alone) and `catalogue` (effects). All numbers are
            shares or counts.
            `in_force` (robot, effect where the study has that axis, catalogue): whether an effect acts.
            `share_named`, `takes_part` (cells, estimator, catalogue): share of trials that name an effect, and its
            mean probability.
            (cells, estimator): `diagnosed`, trials that count; and the shares of these in which all effects in force
            are named (`all_named`), in which nothing else is (`right`), the same with look-alikes (`right_or_alike`),
            in which anything is claimed (`claimed`); `false_names`, names a trial that are not in force.
            Each share and mean has its standard error (`_se`).

    Examples:
        >>> import jaxident as ji
        >>> ji.start_jax()
        >>> content = {"seeds": 8, "noise": [1e-5], "robots": [{"model": "published"}], "estimators": ["batch"]}
        >>> ji.naming(ji.study(content)) is None
        True
    """
    if "named" not in trials:
        return None
    methods = [one["method"] for one in json.loads(trials.attrs["study"])["estimators"]]
    chosen = [k for k, method in enumerate(methods) if method == DIAGNOSE]
    named, verdict, alike = (trials[name].isel(estimator=chosen).load() for name in ("named", "verdict", "alike"))
    there = in_force(trials)
    seen = verdict >= 0
    missing = there & (named != 1.0)
    missed, other = missing.any("catalogue"), (missing & (alike != 1.0)).any("catalogue")
    false = (~there & (named == 1.0)).sum("catalogue")
    claimed = verdict.isin(CLAIMS)
    instead = ~other & (false <= missing.sum("catalogue"))
    of_trials = {"all_named": ~missed, "right": ~missed & (false == 0), "right_or_alike": instead, "claimed": claimed,
                 "false_names": false}  # fmt: skip
    means = {name: value.astype(float).where(seen) for name, value in of_trials.items()}
    means |= {"share_named": named.where(seen), "takes_part": trials["takes_part"].isel(estimator=chosen).where(seen)}
    found: dict[str, Any] = {"in_force": there, "diagnosed": seen.sum("seed")}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # cells without a diagnosis: NaN is right
        for name, value in means.items():
            found[name] = value.mean("seed")
            found[f"{name}_se"] = value.std("seed", ddof=1) / np.sqrt(value.count("seed"))
    axes = cell_axes(trials)
    made = xarray.Dataset(found).transpose(*axes, "estimator", "catalogue", missing_dims="ignore")
    return made.drop_vars([name for name in made.coords if name not in made.dims]).assign_attrs(trials.attrs)


def in_force(trials: xarray.Dataset) -> xarray.DataArray:
    """Whether each effect of the catalogue acts (robot, effect where a study has that axis, catalogue)."""
    told, names = json.loads(trials.attrs["study"]), list(trials["catalogue"].values)
    robots = [one.get("effects", {}) for one in told["robots"]]
    added = [one["effects"] for one in told.get("effects", [{"effects": {}}])]
    there = np.array([[[name in own or name in more for name in names] for more in added] for own in robots])
    axes = ("robot", "effect", "catalogue") if "effect" in trials.dims else ("robot", "catalogue")
    there = there if "effect" in trials.dims else there[:, 0]
    return xarray.DataArray(there, dims=axes, coords={axis: trials[axis].values for axis in axes})
