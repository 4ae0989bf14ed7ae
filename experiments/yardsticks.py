"""How far do classical estimators of the difference equations come beside maximum likelihood?

    python -m experiments.yardsticks --seeds 100 --out yardsticks.csv

The robot without coupling, multilevel inputs of 1000 rows at 1/30 s, camera noise from 0.2 to 5 mm with 10 mrad
for each mm, the same draws for every estimator. Relative root-mean-square errors with standard errors over seeds, and
medians, because a few lost fits rule a mean square: pole and numerators of either equation, dead zones; groups of
parameters as the root of their mean square. Failed fits are in no error, but counted.
"""

import argparse
import pathlib

import numpy as np

import jaxident as ji
from experiments.diagonal import ROBOT
from experiments.rows import write_rows
from jaxident.robot.model import DIFFERENCE_ORDER
from jaxident.study.dataset import study_arrays
from jaxident.study.design import Candidate, Study
from jaxident.study.sight import FOUND, Choice

ESTIMATORS = ("recursive", "key-term-least-squares", "instrumental-variables", "maximum-likelihood")
NOISE = (2e-4, 5e-4, 1e-3, 2e-3, 5e-3)
GROUPS = {
    "pole, length": ("alpha_1",),
    "numerators, length": ("delta_11", "delta_12", "epsilon_11", "epsilon_12"),
    "pole, heading": ("alpha_2",),
    "numerators, heading": ("delta_21", "delta_22", "epsilon_21", "epsilon_22"),
    "dead zones": ("dead_zone_r", "dead_zone_l"),
}


def sizes(errors: np.ndarray) -> tuple[float, float, float]:
    """Root mean square of errors (seeds, parameters), its standard error over seeds, and the median over seeds of each
    seed's own root mean square."""
    squares = np.mean(errors**2, axis=1)
    rms = np.sqrt(np.mean(squares))
    spread = np.std(squares, ddof=1) / np.sqrt(len(squares))
    return rms, spread / (2.0 * rms), np.sqrt(np.median(squares))


def short(value: float, digits: int) -> str:
    """A number rounded to some digits, without a power of ten."""
    return f"{float(f'{value:.{digits}g}'):g}"


def main() -> None:
    """Run the study; one row per noise level and estimator."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--excitation", default="multilevel")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("yardsticks.csv"))
    options = parser.parse_args()
    study = Study(
        robots=(Candidate("diagonal", ROBOT),),
        estimators=tuple(Choice(name, name) for name in ESTIMATORS),
        seeds=options.seeds,
        noise=NOISE,
        excitations=(options.excitation,),
        chunk=options.seeds,
    )
    trials = study_arrays(study)
    rows = [["noise [mm]", "estimator", "failed", *(f"{group} [%]" for group in GROUPS)]]
    for level in NOISE:
        for name in ESTIMATORS:
            own = trials.sel(noise=level, estimator=name).squeeze()
            good = own["reason"].values == FOUND
            error = (own["estimate"] / own["truth"]).values[good] - 1.0
            cells = []
            for members in GROUPS.values():
                rms, spread, median = sizes(100.0 * error[:, [DIFFERENCE_ORDER.index(member) for member in members]])
                cells.append(f"{short(rms, 3)} ± {short(spread, 1)} ({short(median, 2)})")
            rows.append([f"{1e3 * level:g}", name, f"{np.sum(~good)}", *cells])
            print(" | ".join(rows[-1]), flush=True)
    write_rows(options.out, rows)


if __name__ == "__main__":
    ji.start_jax()
    main()
