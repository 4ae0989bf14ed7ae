"""What simpler ways would say, written as diagnoses so that the same scorer judges them."""

import json
import pathlib
import time
from collections.abc import Callable

import numpy as np
from scipy import stats

import jaxident as ji
from jaxident.effects import CATALOGUE
from jaxident.errors import InputError, WorkError
from jaxident.log import Log

from .refit import refit_errors
from .regression import Regression, regression

COMMONEST = "transport_delay"
MOST = 2
"""Effects that the sparse regression may take."""


def commonest(given: Regression) -> dict:
    """Always the same effect: all are drawn equally often, so any is the commonest."""
    return diagnosis([COMMONEST], {COMMONEST: 1.0})


def correlation(given: Regression) -> dict:
    """The effect whose terms go best with the residual, if that is significant at 5 % over all effects (F test that
    takes windows a window apart as independent, Bonferroni)."""
    target, columns = projected(given)
    tests = {name: f_test(target, each) for name, each in columns.items()}
    best = min(tests, key=lambda name: tests[name][0])
    significant = tests[best][0] < 0.05 / len(tests)
    gains = {name: gain for name, (_, gain) in tests.items()}
    return diagnosis([best] if significant else [], gains)


def sparse(given: Regression) -> dict:
    """Forward selection of groups of terms while the Bayesian information criterion falls (two at most)."""
    target, columns = projected(given)
    count, chosen, gains = len(target), [], {}
    score, inside = count * np.log(np.mean(target**2)), np.zeros((count, 0))
    for _ in range(MOST):
        tried = {}
        for name, each in columns.items():
            if name not in chosen:
                wide = np.column_stack([inside, each])
                rest = target - wide @ np.linalg.lstsq(wide, target, rcond=None)[0]
                tried[name] = count * np.log(np.mean(rest**2)) + wide.shape[1] * np.log(count)
        best = min(tried, key=tried.__getitem__)
        gains = gains or {name: score - value for name, value in tried.items()}
        if tried[best] >= score:
            break
        chosen.append(best)
        score, inside = tried[best], np.column_stack([inside, columns[best]])
    return diagnosis(chosen, gains)


def held_out(given: Regression) -> dict:
    """The effect with the smallest error on odd runs after a fit to even ones, whatever its size: the best of many is
    better than nothing by chance alone."""
    known, errors = given.run % 2 == 0, {}
    for name, columns in ({"": np.zeros((len(given.target), 0))} | given.effects).items():
        wide = np.column_stack([given.nominal, columns])
        found = np.linalg.lstsq(wide[known], given.target[known], rcond=None)[0]
        errors[name] = float(np.mean((given.target - wide @ found)[~known] ** 2))
    return smallest(errors)


def smallest(errors: dict[str, float]) -> dict:
    """The effect with the smallest error, if that is less than without any ("")."""
    gains = {name: errors[""] - error for name, error in errors.items() if name}
    best = max(gains, key=gains.__getitem__)
    return diagnosis([best] if gains[best] > 0.0 else [], gains)


REGRESSIONS: dict[str, Callable[[Regression], dict]] = {
    "commonest": commonest,
    "correlation": correlation,
    "sparse": sparse,
    "held_out": held_out,
}


def refits(runs: list[Log]) -> dict[str, dict]:
    """The effect that a full refit with it predicts held-out runs best with."""
    return {"refit": smallest(refit_errors(runs))}


def regressions(runs: list[Log]) -> dict[str, dict]:
    """What every method says of the regression of some runs after their own identification."""
    given = regression(ji.identify(runs, coupling=True, noise_law="white").model, runs)
    return {name: method(given) for name, method in REGRESSIONS.items()}


FAMILIES: dict[Callable[[list[Log]], dict[str, dict]], tuple[str, ...]] = {
    refits: ("refit",),
    regressions: tuple(REGRESSIONS),
}
METHODS = tuple(name for names in FAMILIES.values() for name in names)


def run(cases: pathlib.Path, out: pathlib.Path) -> None:
    """OUT/METHOD/case_NNN/diagnosis.json of every method that is not there yet."""
    for case in sorted(folder for folder in cases.iterdir() if folder.is_dir()):
        for family, names in FAMILIES.items():
            folders = {name: out / name / case.name for name in names}
            if not all((folder / "process.json").exists() for folder in folders.values()):
                _record(case, family, folders)


def _record(case: pathlib.Path, family: Callable, folders: dict[str, pathlib.Path]) -> None:
    """What the methods of a family say of a case, each in a folder of its own, and how long all took."""
    begin, code = time.monotonic(), 0
    try:
        found = family(_runs(case))
    except (InputError, WorkError) as error:
        print(f"{case.name}: {error}", flush=True)
        found, code = {}, 1
    seconds = round(time.monotonic() - begin, 2)
    for name, folder in folders.items():
        folder.mkdir(parents=True, exist_ok=True)
        if name in found:
            (folder / "diagnosis.json").write_text(json.dumps(found[name], indent=1) + "\n")
        (folder / "process.json").write_text(json.dumps({"seconds": seconds, "exit_code": code}) + "\n")
    print(f"{case.name}: {', '.join(folders)} in {seconds:.1f} s", flush=True)


def _runs(case: pathlib.Path) -> list[Log]:
    """A case's real logs."""
    paths = sorted(case.glob("real_*"), key=lambda path: int(path.name.split("_")[1].split(".")[0]))
    return [ji.read_log(path) for path in paths]


def projected(given: Regression) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Target and columns of effects, at windows that share no row, without what the nominal parameters explain."""
    kept = slice(None, None, given.apart)
    basis, _ = np.linalg.qr(given.nominal[kept])

    def off(columns):
        return columns - basis @ (basis.T @ columns)

    return off(given.target[kept]), {name: off(each[kept]) for name, each in given.effects.items()}


def f_test(target: np.ndarray, columns: np.ndarray) -> tuple[float, float]:
    """P-value of the columns, and the share of the target's variance that they explain."""
    rest = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    left, right = columns.shape[1], len(target) - columns.shape[1]
    gain = np.sum(target**2) - np.sum(rest**2)
    return float(stats.f.sf(gain / left / (np.sum(rest**2) / right), left, right)), float(gain / np.sum(target**2))


def diagnosis(selected: list[str], gains: dict[str, float]) -> dict:
    """The keys of a diagnosis that the scorer reads; where from the selected effects alone."""
    first = selected[:1]
    channels = CATALOGUE[first[0]].channels if first else ()
    return {
        "schema": "jaxident.diagnosis/1",
        "verdict": "effects" if selected else "no_gap",
        "selected": selected,
        "causes": [{"effect": name, "indistinguishable_from": []} for name in selected],
        "probability": None,
        "where": {
            "site": {CATALOGUE[name].site: 1.0 for name in first},
            "channels": {name: 1.0 / len(channels) for name in channels},
        },
        "gains": gains,
    }
