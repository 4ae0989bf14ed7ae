"""Which camera noise makes the paper's printed errors a typical draw of its own method?

    python -m experiments.typical_noise --out typical_noise

At each level of experiments/typical_noise.toml a trial's size of error is the geometric mean of its relative errors
over a set of parameters, which gives a dead zone and a numerator the same say. The paper's one draw is as large as that
of some share of the trials: where the share is one half it is a typical draw, from 5 to 95 % it is a possible one.
Writes typical_noise.csv and typical_noise.png, and prints the answer. The same folder goes on where it stopped.
"""

import argparse
import csv
import pathlib

import numpy as np

import jaxident as ji
from jaxident.robot.model import DIFFERENCE_ORDER, difference_vector
from jaxident.study.reproduction import PAPER

HERE = pathlib.Path(__file__).parent
SETS = {
    "both equations": DIFFERENCE_ORDER,
    "path length": ("alpha_1", "delta_11", "delta_12", "epsilon_11", "epsilon_12"),
    "heading": ("alpha_2", "delta_21", "delta_22", "epsilon_21", "epsilon_22", "dead_zone_r", "dead_zone_l"),
}
POSSIBLE = (0.05, 0.95)


def size(error, truth, names) -> np.ndarray:
    """Geometric mean of the relative errors (..., 12) over the named parameters."""
    columns = [DIFFERENCE_ORDER.index(name) for name in names]
    share = np.abs(np.asarray(error) / truth)[..., columns]
    return np.exp(np.mean(np.log(np.maximum(share, 1e-12)), axis=-1))


def shares(trials, printed: np.ndarray) -> dict[tuple[str, str], np.ndarray]:
    """Share of the trials (levels,) with errors smaller than the paper's, by excitation and set; a failed trial counts
    as larger."""
    found = {}
    error = trials["estimate"].values[:, 0, 0, 0, 0, :, :, 0] - printed  # (excitations, levels, seeds, 12)
    for number, kind in enumerate(trials["excitation"].values):
        for name, members in SETS.items():
            theirs = size(np.array(PAPER) - printed, printed, members)
            ours = size(np.nan_to_num(error[number], nan=np.inf), printed, members)
            found[str(kind), name] = np.mean(ours < theirs, axis=-1)
    return found


def crossing(noise: np.ndarray, share: np.ndarray, at: float) -> float:
    """The noise at which the falling share passes `at`, between the levels by the logarithm; NaN where it does not."""
    below = np.flatnonzero(share < at)
    if not len(below) or below[0] == 0:
        return float("nan")
    k = below[0]
    part = (share[k - 1] - at) / (share[k - 1] - share[k])
    return float(noise[k - 1] * (noise[k] / noise[k - 1]) ** part)


def draw(noise: np.ndarray, found: dict, path: pathlib.Path) -> None:
    """Share of smaller errors against noise, a panel for each excitation."""
    kinds = list(dict.fromkeys(kind for kind, _ in found))
    figure, axes = ji.plot.figure(1, len(kinds), size=(9.0, 3.4))
    for ax, kind in zip(axes, kinds, strict=True):
        for name in SETS:
            ax.semilogx(1e3 * noise, 100.0 * found[kind, name], marker="o", markersize=3.5, label=name)
        ax.axhspan(*(100.0 * level for level in POSSIBLE), color="0.93", zorder=0)
        ax.axhline(50.0, color="0.5", linewidth=0.8, linestyle="--")
        ax.set(title=kind, xlabel="camera noise in position [mm]", ylim=(-4.0, 104.0))
    axes[0].set_ylabel("trials with smaller errors than the paper's [%]")
    axes[-1].legend(frameon=False)
    ji.plot.save(figure, path)


def main() -> None:
    """Run what is missing of the study; table, picture, answer."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("typical_noise"))
    parser.add_argument("--seeds", type=int, help="instead of the file's")
    options = parser.parse_args()
    study = ji.read_study(HERE / "typical_noise.toml")
    study = study._replace(seeds=options.seeds or study.seeds)
    trials = ji.study(study, out=options.out)
    simplified = ji.load_model("published-simplified")
    printed = np.asarray(difference_vector(simplified.difference, simplified.dead_zone))
    noise, found = np.asarray(study.noise), shares(trials, printed)
    with open(options.out / "typical_noise.csv", "w", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["excitation", "parameters", *(f"{1e3 * level:g} mm" for level in noise)])
        table.writerows([*key, *(f"{value:.2f}" for value in row)] for key, row in found.items())
    draw(noise, found, options.out / "typical_noise.png")
    for (kind, name), share in found.items():
        low, middle, high = (1e3 * crossing(noise, share, at) for at in (POSSIBLE[1], 0.5, POSSIBLE[0]))
        print(f"{kind}, {name}: typical at {middle:.2g} mm, possible from {low:.2g} to {high:.2g} mm")


if __name__ == "__main__":
    ji.start_jax()
    main()
