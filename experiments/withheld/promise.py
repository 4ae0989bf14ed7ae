"""Does `predict` keep what `diagnose` promises? On the judging runs of every case, and on fresh runs of its robot.

    python -m experiments.withheld.promise --cases CASES --answers ANSWERS --found FOUND --out PROMISE.json

`gap.discovered` is the mean squared pose error of the corrected model over the camera's variance on runs that served
nothing else. The same is taken of `jaxident predict corrected_model.json` on those runs (2 and 5 of six), and on four
fresh runs of the hidden robot with noise, slip and chance, whose session goes on where the logs ended. Answers must be
plain.
"""

import argparse
import json
import pathlib

import numpy as np

import jaxident as ji
from jaxident.estimation.predict import predict
from jaxident.log import Log, join, make_log

from .protocol import robots
from .protocol.cases import ROWS, hidden, simulate_runs
from .scoring.rows import FAR, HIGH, LOW

FRESH = 4
"""Fresh runs of each robot."""
JUDGING = (2, 5)
"""Numbers of the runs that served no fit."""


def fresh_plan(answer: dict) -> list[dict]:
    """Runs of the hidden robot that follow the logs of its session."""
    rng, runs = np.random.default_rng([answer["seed"], 5]), []
    for number in range(FRESH):
        runs.append({
            "robot": answer["robot"], "effects": hidden(answer) if answer["generator"] == "batch" else {},
            "period": answer["period"], "u": robots.draw_commands(rng, ROWS, answer["inputs"]),
            "start": [*rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi)],
            "session_time": answer["session"] + number * (ROWS - 1) * answer["period"],
            "slip": robots.slip_series(rng, answer["slip"], ROWS, answer["period"]), "noise": answer["noise"],
            "rng": np.random.default_rng([answer["seed"], 6, number]),
        })  # fmt: skip
    return runs


def fresh_logs(answers: dict[str, dict]) -> dict[str, Log]:
    """The fresh runs of each case as one log."""
    plans = {name: fresh_plan(answer) for name, answer in answers.items()}
    rubs = {name: bool(hidden(a).keys() & {"coulomb_friction", "stiction"}) for name, a in answers.items()}
    found: dict[str, list] = {name: [] for name in answers}
    for group in (True, False):
        names = [n for n, a in answers.items() if a["generator"] == "batch" and rubs[n] is group]
        runs = [(name, run) for name in names for run in plans[name]]
        if runs:
            for (name, _), log in zip(runs, simulate_runs([run for _, run in runs]), strict=True):
                found[name].append(log)
    for name, answer in answers.items():
        if answer["generator"] != "batch":
            from .engine_robot.cases import drive_run

            found[name] = [drive_run(answer, run) for run in plans[name]]
    return {name: join([as_log(one) for one in logs]) for name, logs in found.items()}


def as_log(rows: np.ndarray) -> Log:
    """A log from rows as `cases.as_log` makes them, to the digits that files hold."""
    return make_log(np.round(rows[:, 0], 6), *np.nan_to_num(rows[:, 1:3]).T, *np.round(rows[:, 3:], 6).T)


def mean_square(model, log: Log, rows: int, unit: np.ndarray) -> float:
    """Mean square of the errors at the horizon over the camera's variances; infinite where one is not finite."""
    found = predict(model, log, rows)
    ends = np.flatnonzero(found.step == rows)
    begins = np.flatnonzero(np.concatenate([[True], log.run[1:] != log.run[:-1]]))
    places = begins[found.run[ends]] + found.start[ends] + rows
    measured = np.stack(log.pose, axis=1)[places]
    error = measured - np.stack([found.x, found.y, found.theta], axis=1)[ends]
    error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    value = float(np.mean(error[np.isfinite(measured).all(axis=1)] ** 2 / unit))
    return value if np.isfinite(value) else float("inf")


def unit_of(model) -> np.ndarray:
    """The camera's variances of a model (3,)."""
    variance = np.array([model.noise.position, model.noise.position, model.noise.heading]) ** 2
    for effect in model.effects:
        if effect.name == "coloured_noise":
            own = effect.parameters
            variance = variance + np.array([own["position"], own["position"], own["heading"]]) ** 2
    return variance


def one(folder: pathlib.Path, case: pathlib.Path, fresh: Log) -> dict:
    """What a case promises and what comes of it."""
    gap = json.loads((folder / "diagnosis.json").read_text())["gap"]
    models = {name: ji.load_model(folder / f"{name}_model.json") for name in ("corrected", "nominal")}
    rows, unit = round(gap["horizon"] / models["corrected"].sample_period), unit_of(models["corrected"])
    same = [ji.read_log(path) for k in JUDGING for path in case.glob(f"real_{k}.*")]
    again = [mean_square(models["corrected"], log, rows, unit) for log in same]
    return {
        "promised": gap["discovered"],
        "same": float(np.mean(again)),
        "fresh": mean_square(models["corrected"], fresh, rows, unit),
        "nominal": mean_square(models["nominal"], fresh, rows, unit),
    }


def main() -> None:
    """Compare promise and prediction for every case that has a diagnosis; write and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("cases", "answers", "found", "out"):
        parser.add_argument(f"--{name}", required=True, type=pathlib.Path)
    options = parser.parse_args()
    ji.start_jax()
    answers = json.loads(options.answers.read_text())["cases"]
    answers = {name: a for name, a in answers.items() if (options.found / name / "diagnosis.json").exists()}
    fresh, rows = fresh_logs(answers), {}
    for name, answer in answers.items():
        rows[name] = one(options.found / name, options.cases / name, fresh[name])
        rows[name] |= {"kind": answer["kind"], "hidden": [effect["name"] for effect in answer["effects"]]}
    options.out.write_text(json.dumps(rows, indent=1) + "\n")
    print(summary(rows))


def summary(rows: dict[str, dict]) -> str:
    """Counts over all cases, and the ratio by effect."""
    ratio = np.array([row["fresh"] / row["promised"] for row in rows.values()])
    same = np.array([row["same"] / row["promised"] for row in rows.values()])
    inside = (ratio > LOW) & (ratio < HIGH)
    lines = [
        f"{len(rows)} cases; same runs within 10 %: {np.mean(np.abs(same - 1.0) <= 0.1):.3f}",
        f"fresh runs, mean square over promised, {LOW:g} to {HIGH:.2f}: {np.mean(inside):.3f} ({inside.sum()}); "
        f"above {FAR:g}: {np.sum(~(ratio <= FAR))}; median {np.median(ratio):.3f}",
    ]
    names = sorted({name for row in rows.values() for name in row["hidden"] or ["none"]})
    lines += ["", "| hidden | cases | inside | median | least | most |", "|---|---|---|---|---|---|"]
    for name in names:
        own = np.array([name in (row["hidden"] or ["none"]) for row in rows.values()])
        of = ratio[own]
        lines.append(
            f"| {name} | {own.sum()} | {inside[own].sum()} | {np.median(of):.2f} | {of.min():.2f} | {of.max():.2f} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
