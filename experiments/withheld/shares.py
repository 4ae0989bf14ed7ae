"""Is the account true? The share of every effect against what the hidden robot loses when the effect is switched off.

    python -m experiments.withheld.shares --answers ANSWERS --found FOUND --out SHARES.json

The robot of a case is driven again, same commands, starts and draws, with every subset of its hidden effects. The
nominal model is refitted to each robot on the runs that fit, and judged on those that judge: w(S). The true share of an
effect is its Shapley value in w over w of all. Every robot is filtered by the law of noise that the case's corrected
model has. What is told of noise (camera, start state and slip together) is held
against w of none. Cases with the right names count. Answers must be plain.
"""

import argparse
import itertools
import json
import pathlib

import numpy as np

import jaxident as ji
from jaxident.diagnosis.account.shapley import shapley
from jaxident.diagnosis.fit.refit import Data, refit
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.noise.law import Law, whitener_of
from jaxident.diagnosis.preparation.judging import judge_model
from jaxident.diagnosis.preparation.prepare import Prepared, prepare
from jaxident.diagnosis.preparation.translate import to_model
from jaxident.log import make_log
from jaxident.robot.noise import Noise

from .promise import unit_of
from .protocol.cases import RUNS, simulate_cases
from .scoring.intervals import wilson
from .scoring.marks import mark

NOISE = ("camera", "start", "slip")


def robots_of(case: dict) -> dict[frozenset[str], list]:
    """The real runs of a case with each subset of its effects."""
    effects = {effect["name"]: effect for effect in case["effects"]}
    subsets = [frozenset(s) for n in range(len(effects) + 1) for s in itertools.combinations(effects, n)]
    variants = [{**case, "effects": [effects[name] for name in effects if name in subset]} for subset in subsets]
    if case["generator"] == "batch":
        logs = simulate_cases(variants)
    else:
        from .engine_robot.cases import simulate_case

        logs = [simulate_case(variant) for variant in variants]
    return {
        subset: [make_log(one[:, 0], *one[:, 1:3].T, *np.round(one[:, 3:], 6).T) for one in own[:RUNS]]
        for subset, own in zip(subsets, logs, strict=True)
    }


def law_of(noise: Noise, effects) -> Law:
    """The law of noise behind a model of a diagnosis."""
    slip, time = None, noise.slip_time
    if time is not None:
        slip = tuple(float(d) / np.sqrt(2.0 * time) for d in (noise.slip_along, noise.slip_heading))
    memory = next((effect.parameters for effect in effects if effect.name == "coloured_noise"), None)
    if memory is not None:
        coloured = memory["position"], memory["heading"]
        return Law(noise.position, noise.heading, slip, time, coloured, memory["correlation_time"])
    if noise.correlation_time is None:
        return Law(noise.position, noise.heading, slip, time)
    white = noise.white_position or 0.0, noise.white_heading or 0.0
    rest = [float(np.sqrt(max(a**2 - b**2, 0.0))) for a, b in zip((noise.position, noise.heading), white, strict=True)]
    return Law(*white, slip, time, (rest[0], rest[1]), noise.correlation_time)


def missed(logs: list, law: Law, horizon: float, unit: np.ndarray) -> float:
    """Mean square of the errors of the nominal model refitted to a robot, over the camera's variances, on the runs that
    judge."""
    prepared: Prepared = prepare(logs, horizon)
    fit = prepared.nominal
    responses = respond(np.exp(fit.vector[:2]), fit.linear.residual, prepared.windows)
    data = Data(prepared.windows, whitener_of(law, prepared.windows, responses))
    fit = refit(data, fit.vector, fit.starts, ())
    judged = judge_model(to_model(prepared, fit.vector, law, ()), prepared)
    return float(np.nanmean(judged.error**2 / unit))


def one(case: dict, folder: pathlib.Path) -> dict:
    """Told and true shares of a case."""
    found = json.loads((folder / "diagnosis.json").read_text())
    corrected = ji.load_model(folder / "corrected_model.json")
    law, unit = law_of(corrected.noise, corrected.effects), unit_of(corrected)
    worth = {s: missed(logs, law, found["gap"]["horizon"], unit) for s, logs in robots_of(case).items()}
    names = tuple(effect["name"] for effect in case["effects"])
    values = shapley(names, lambda joined: -worth[joined])
    whole = worth[frozenset(names)]
    rows = {row["part"]: row for row in found["account"]["rows"]}
    told = []
    for name in names:
        accepted = next((a for a in case["accepted"] if name in a or len(case["accepted"]) == 1), [name])
        row = next((rows[a] for a in (name, *accepted) if a in rows), None)
        if row is not None:
            told.append({"part": name, "told": row["share"], "interval": row["share_interval"],
                         "true": float(values[name]) / whole})  # fmt: skip
    noise = sum(rows[name]["share"] for name in NOISE)
    floor = found["gap"]["floor"]
    return {
        "rows": told, "noise": {"told": noise, "true": worth[frozenset()] / whole},
        "floor_above": bool(floor["interval"][0] > found["gap"]["after"]), "after": found["gap"]["after"],
        "floor": floor,
    }  # fmt: skip


def main() -> None:
    """Hold the account of every case with the right names against the truth; write and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("answers", "found", "out"):
        parser.add_argument(f"--{name}", required=True, type=pathlib.Path)
    parser.add_argument("--part", type=int, nargs=2, default=(0, 1), help="K N: every N-th case from the K-th")
    options = parser.parse_args()
    ji.start_jax()
    cases, rows = json.loads(options.answers.read_text())["cases"], {}
    first, step = options.part
    for name in list(cases)[first::step]:
        path, case = options.found / name / "diagnosis.json", cases[name]
        if not path.exists() or case["kind"] not in ("single", "pair", "many"):
            continue
        if not mark(case, json.loads(path.read_text()))["right"]:
            continue
        rows[name] = one(case, options.found / name) | {"kind": case["kind"]}
        options.out.write_text(json.dumps(rows, indent=1) + "\n")
        print(name, rows[name]["rows"], flush=True)
    print(summary(rows))


def summary(rows: dict[str, dict]) -> str:
    """How many true shares lie in their intervals, by effect."""
    each = [row for case in rows.values() for row in case["rows"]]
    inside = [row["interval"][0] <= row["true"] <= row["interval"][1] for row in each]
    low, high = wilson(sum(inside), len(inside))
    above = [case["floor_above"] for case in rows.values()]
    lines = [
        f"true share in its 90 % interval: {sum(inside)} of {len(inside)} (95 % interval {low:.3f} to {high:.3f})",
        f"floor above the error beyond its interval: {sum(above)} of {len(above)}",
        "",
        "| effect | shares | inside | told less true, mean | least | most |",
        "|---|---|---|---|---|---|",
    ]
    for name in sorted({row["part"] for row in each}):
        own = [k for k, row in enumerate(each) if row["part"] == name]
        off = np.array([each[k]["told"] - each[k]["true"] for k in own])
        hit = sum(inside[k] for k in own)
        lines.append(f"| {name} | {len(own)} | {hit} | {off.mean():+.3f} | {off.min():+.3f} | {off.max():+.3f} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
