"""Discovered laws beside black boxes: a Gaussian process and a small network that learn what the nominal model misses.

    pip install scikit-learn
    python -m experiments.peers.residual_learners --cases CASES --answers ANSWERS --names 008 019 023 028

CASES and ANSWERS are those of `experiments.withheld draw`. For each robot one diagnosis gives the nominal and the
corrected model. The black boxes learn on the runs for naming: from the start state and the commands of each second, by
how much the nominal model misses the pose at its end, in the robot's frame. Everything is then judged on four fresh
runs: mean squared error 1 s ahead over the camera's variances, as in `experiments/discovered.md`.
"""

import argparse
import json
import time

import numpy as np

import jaxident as ji
from jaxident.log import Log, join

from ..withheld.promise import fresh_logs

QUARTERS = 4
"""Parts of the second whose mean commands the black boxes see."""
STRIDE = 7
"""Rows between the starts that they learn from."""
MOST = 700
"""Starts that they learn from; a Gaussian process takes their number cubed."""


def missed(model, log: Log, stride: int) -> tuple[np.ndarray, np.ndarray]:
    """Of free runs over one second whose end was seen: features (n, 14) known at the start, and errors (n, 3) at the
    end, along and beside the heading of the start and in heading."""
    rows = round(1.0 / model.sample_period)
    found = ji.predict(model, log, rows, stride=stride)
    end = np.flatnonzero(found.step == rows)
    begin = np.flatnonzero(np.concatenate([[True], np.diff(log.run) != 0]))[found.run[end]] + found.start[end]
    pose, command = np.stack(log.pose, axis=1), np.stack(log.command, axis=1)
    predicted = np.stack([found.x, found.y, found.theta], axis=1)
    error, theta = pose[begin + rows] - predicted[end], pose[begin, 2]
    step = (predicted[end - rows + 2] - predicted[end - rows + 1]) / model.sample_period
    quarters = [[part.mean(axis=0) for part in np.array_split(command[b : b + rows], QUARTERS)] for b in begin]
    features = np.column_stack([
        _turned(step[:, 0], step[:, 1], theta)[0], step[:, 2], pose[begin, :2], np.sin(theta), np.cos(theta),
        np.reshape(quarters, (len(begin), -1)),
    ])  # fmt: skip
    turn = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    whole = np.column_stack([*_turned(error[:, 0], error[:, 1], theta), turn])
    seen = np.isfinite(whole).all(axis=1) & np.isfinite(features).all(axis=1)
    return features[seen], whole[seen]


def _turned(x, y, theta) -> tuple[np.ndarray, np.ndarray]:
    """A vector along a heading and to its left."""
    return x * np.cos(theta) + y * np.sin(theta), y * np.cos(theta) - x * np.sin(theta)


def learners() -> dict:
    """The black boxes, one for each channel."""
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    def process():
        kernel = ConstantKernel() * RBF(np.full(6 + 2 * QUARTERS, 3.0)) + WhiteKernel()
        return GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)

    def network():
        return MLPRegressor(hidden_layer_sizes=(64, 64), early_stopping=True, max_iter=2000, random_state=0)

    return {
        name: lambda make=make: TransformedTargetRegressor(make_pipeline(StandardScaler(), make()),
                                                           transformer=StandardScaler())
        for name, make in (("Gaussian process", process), ("network, 2 x 64", network))
    }  # fmt: skip


def compare(folder: str, answer: dict, name: str) -> list[tuple[str, float, float, float]]:
    """Rows of method, mean squared error over the camera's variances, standard error of it, seconds."""
    begin = time.perf_counter()
    gap = ji.diagnose(folder)
    rows = [("diagnosis", 0.0, 0.0, time.perf_counter() - begin)]
    logs = ji.read_log(folder).runs()
    naming = join([log for number, log in enumerate(logs) if number % 3 != 1])
    fresh = fresh_logs({name: answer})[name]
    noise = answer["noise"]
    unit = np.array([noise["position"], noise["position"], noise["heading"]]) ** 2
    for label, model in (("nominal", gap.nominal_model), ("corrected", gap.corrected_model)):
        rows.append((label, *_mean(missed(model, fresh, round(1.0 / model.sample_period))[1], unit), 0.0))
    features, target = missed(gap.nominal_model, naming, STRIDE)
    chosen = slice(None, None, max(1, len(target) // MOST))
    there, error = missed(gap.nominal_model, fresh, round(1.0 / gap.nominal_model.sample_period))
    for label, make in learners().items():
        begin = time.perf_counter()
        told = np.stack([make().fit(features[chosen], target[chosen, c]).predict(there) for c in range(3)], axis=1)
        rows.append((label, *_mean(error - told, unit), time.perf_counter() - begin))
    return rows


def _mean(error: np.ndarray, unit: np.ndarray) -> tuple[float, float]:
    square = np.mean(error**2 / unit, axis=1)
    return float(square.mean()), float(square.std() / len(square) ** 0.5)


def main() -> None:
    """One table for each robot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", required=True)
    parser.add_argument("--answers", required=True)
    parser.add_argument("--names", nargs="+", required=True)
    options = parser.parse_args()
    ji.start_jax()
    with open(options.answers) as stream:
        answers = json.load(stream)["cases"]
    for number in options.names:
        name = f"case_{number}"
        print(f"{name}\n| method | mean squared error | standard error | seconds |\n|---|---|---|---|")
        for label, value, error, seconds in compare(f"{options.cases}/{name}", answers[name], name):
            print(f"| {label} | {value:.2f} | {error:.2f} | {seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
