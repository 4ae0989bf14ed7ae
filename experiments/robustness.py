"""Which effects spoil which parameter, for the paper's method and for maximum likelihood?

    python -m experiments.robustness --out robustness [--seeds 200]

The published robot without coupling, each effect of the catalogue alone at three strengths (in typical sizes), the
same seeds for all. Both estimators know of no effect: what their estimates are off by is the effect's doing, but for
the row `none`, which is that of the camera's noise; a trial that fails is counted and in no bias. Writes
robustness.csv (bias of each parameter with its Monte-Carlo standard error, in SI units and per cent of the parameter),
robustness.md (the parameter that each effect moves furthest) and robustness.png (size of the bias, empty where small or
not clear of zero). The study's store lies in the same folder: stopped, the same command goes on.
"""

import argparse
import csv
import dataclasses
import pathlib

import numpy as np

import jaxident as ji
from jaxident.effects import CATALOGUE
from jaxident.plot.names import written
from jaxident.robot.model import DIFFERENCE_ORDER

STRENGTHS = (0.5, 1.0, 2.0)
SHOWN = STRENGTHS[1]
CLEAR, SMALL = 3.0, 0.1
"""Standard errors, and per cent of the parameter, from which a bias is shown."""

COLOURS = (SMALL, 100.0)

ESTIMATORS = {"paper": "recursive", "likelihood": "maximum-likelihood"}


def study(seeds: int, samples: int, noise: float) -> dict:
    """The study's content: one robot under no effect, then under each of the catalogue at each strength."""
    published = ji.load_model("published")
    plain = dataclasses.replace(published, dynamics=published.physical._replace(coupling=None))
    return {
        "name": "which effects spoil which parameter",
        "seeds": seeds,
        "noise": [noise],
        "samples": [samples],
        "hold": 10,
        "chunk": 500,
        "robots": [{"model": plain, "name": "robot"}],
        "effects": ["none", *({name: list(STRENGTHS)} for name in CATALOGUE)],
        "estimators": [{"method": method, "name": name} for name, method in ESTIMATORS.items()],
    }


def rows_of(summary) -> list[dict]:
    """One row for each effect, strength, estimator and parameter."""
    cell = summary.isel(excitation=0, samples=0, robot=0, period=0, amplitude=0, noise=0)
    cases = [("none", 0.0), *((name, strength) for name in CATALOGUE for strength in STRENGTHS)]
    rows = []
    for k, (effect, strength) in enumerate(cases):
        for estimator in ESTIMATORS:
            at = cell.isel(effect=k).sel(estimator=estimator)
            failed = int(at["failures"].sum())
            for parameter in DIFFERENCE_ORDER:
                one = at.sel(parameter=parameter)
                truth, bias, error = (float(one[name]) for name in ("truth", "bias", "bias_se"))
                share = 100.0 / abs(truth)
                rows.append(
                    {
                        "effect": effect, "strength": strength, "estimator": estimator, "parameter": parameter,
                        "truth": truth, "bias": bias, "bias_se": error, "percent": share * bias,
                        "percent_se": share * error, "trials": int(one["trials"]), "failed": failed,
                    }
                )  # fmt: skip
    return rows


def write_table(rows: list[dict], path: pathlib.Path) -> None:
    """All rows as CSV."""
    with open(path, "w", newline="") as stream:
        table = csv.DictWriter(stream, rows[0].keys(), lineterminator="\n")
        table.writeheader()
        table.writerows({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)


def write_markdown(rows: list[dict], path: pathlib.Path) -> None:
    """For each effect at its typical size: the parameter that it moves furthest, and failures."""
    lines = [
        "| effect | paper: worst parameter | failed | likelihood: worst parameter | failed |",
        "|---|---|---|---|---|",
    ]
    for effect in ("none", *CATALOGUE):
        told = []
        for estimator in ESTIMATORS:
            own = _own(rows, effect, estimator)
            known = [row for row in own if np.isfinite(row["percent"])]
            worst = max(known, key=lambda row: abs(row["percent"]), default=None)
            text = (
                "" if worst is None else f"{worst['parameter']} {worst['percent']:+.3g} ± {worst['percent_se']:.2g} %"
            )
            told += [text, str(own[0]["failed"])]
        lines.append(f"| {effect} | {' | '.join(told)} |")
    path.write_text("\n".join(lines) + "\n")


def _own(rows: list[dict], effect: str, estimator: str) -> list[dict]:
    size = 0.0 if effect == "none" else SHOWN
    return [r for r in rows if (r["effect"], r["strength"], r["estimator"]) == (effect, size, estimator)]


def _shown(size: float, error: float) -> float:
    """A bias to two digits, or NaN where it is not shown."""
    return float(f"{size:.2g}") if size >= max(SMALL, CLEAR * error) else np.nan


def draw(rows: list[dict], seeds: int, path: pathlib.Path) -> None:
    """Size of the bias in per cent, effects by parameters, one map for each estimator."""
    names = ["none", *CATALOGUE]
    figure, axes = ji.plot.figure(1, 2, size=(12.0, 8.4))
    columns = [written(name).symbol for name in DIFFERENCE_ORDER]
    for ax, estimator in zip(axes, ESTIMATORS, strict=True):
        values = np.full((len(names), len(columns)), np.nan)
        for k, effect in enumerate(names):
            own = _own(rows, effect, estimator)
            values[k] = [_shown(abs(row["percent"]), row["percent_se"]) for row in own]
        labels = [name.replace("_", " ") for name in names] if ax is axes[0] else [""] * len(names)
        label = f"{estimator}: bias [%], empty below {SMALL:g} % or {CLEAR:g} standard errors ({seeds} seeds)"
        ji.plot.heat_map(values, rows=labels, columns=columns, label=label, ax=ax, limits=COLOURS)
    ji.plot.save(figure, path)


def main() -> None:
    """Run what is missing of the study, sum up, write table, text and picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("robustness"))
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--noise", type=float, default=1e-5, help="camera noise in position [m]; 10 rad/m in heading")
    options = parser.parse_args()
    content = study(options.seeds, options.samples, options.noise)
    summary = ji.summarise(ji.study(content, out=options.out))
    rows = rows_of(summary)
    write_table(rows, options.out / "robustness.csv")
    write_markdown(rows, options.out / "robustness.md")
    draw(rows, options.seeds, options.out / "robustness.png")
    print((options.out / "robustness.md").read_text())


if __name__ == "__main__":
    ji.start_jax()
    main()
