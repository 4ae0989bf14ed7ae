"""Cases: what is hidden in each, as plain numbers that repeat it, and the logs that show it."""

import gzip
import json
import pathlib

import numpy as np

from jaxident.effects import CATALOGUE

from ..batch_robot.camera import frozen
from ..batch_robot.simulate import simulate
from . import outside, robots

SCHEMA = "withheld.answers/1"
RUNS, SIM_RUNS, ROWS = 6, 3, 1001
FORMAT = {
    "kind": "none, single, pair or outside (an effect that no catalogue lists, alone)",
    "effects": "[{name, parameters, sites}]: what is hidden; sites: where it acts, any of which is right",
    "accepted": "for each effect of the catalogue the names that count as it: [[names], ...]",
    "channels": "along, lateral, heading: those that the effects move first hand",
    "strength": "of each effect beside the robot's own forces: 0.1 faint, 0.6 strong",
    "slip": "standard deviations [m/s^2, rad/s^2] and correlation time [s] of a random acceleration, or null",
    "noise": "standard deviations of the white camera error [m], [rad]",
    "sim": "null, or the parameters of the owner's simulator, whose logs are sim_*",
    "inputs": "multilevel, or forward: two forward levels, which cannot show every effect",
    "session": "[s], the duration of all six runs",
    "generator": "batch (equations) or engine (MuJoCo)",
    "seed": "of this case: generator and this entry repeat the logs",
}
LATER_FORMAT = {
    "kind": "none, single, pair, many (four or five effects of the catalogue), outside (an effect that no catalogue "
    "lists, alone) or mixed (one of the catalogue beside one that none lists)",
    "outside": "of a mixed case: names of the effects that no catalogue lists",
}
"""What further kinds change in FORMAT. The first kinds keep theirs, which is part of what was sealed."""


def describe(
    seed: int, kind: str, names: list[str], *, slip: bool, sim: str | None, inputs="multilevel", other=False
) -> dict:
    """One case of the batched generator; sim: None, `same` or `near`; other: effects in another form, where they have
    one, than the catalogue's."""
    rng = np.random.default_rng([seed, 1])
    robot, noise, period = robots.draw_robot(rng), robots.draw_noise(rng), float(rng.choice(robots.PERIODS))
    session, effects, strengths = RUNS * (ROWS - 1) * period, [], []
    for name in names:
        strengths.append(robots.draw_strength(rng))
        parameters = robots.draw_effect(rng, name, strengths[-1], robot, noise, session)
        if other and name in robots.FORMS:
            parameters["form"] = robots.form(name, parameters, session)
        effects.append({"name": name, "parameters": parameters, "sites": sites(name)})
    unlisted = {"outside": [name for name in names if name not in CATALOGUE]} if kind == "mixed" else {}
    return unlisted | {
        "generator": "batch",
        "seed": seed,
        "kind": kind,
        "effects": effects,
        "accepted": [[name] for name in names if name in CATALOGUE],
        "channels": sorted({c for name in names for c in channels(name)}),
        "strength": strengths,
        "slip": robots.draw_slip(rng, robot) if slip else None,
        "noise": noise,
        "robot": robot,
        "sim": {None: None, "same": robot, "near": robots.near(robot, rng)}[sim],
        "inputs": inputs,
        "period": period,
        "session": session,
    }


def sites(name: str) -> list[str]:
    """Where an effect acts, in or outside the catalogue."""
    return [CATALOGUE[name].site] if name in CATALOGUE else list((outside.SITES | outside.LATER_SITES)[name])


def channels(name: str) -> tuple[str, ...]:
    """What it moves first hand; effects outside the catalogue are not scored by channel."""
    return CATALOGUE[name].channels if name in CATALOGUE else ()


def hidden(case: dict) -> dict[str, dict[str, float]]:
    """{name: parameters} of a case."""
    return {effect["name"]: effect["parameters"] for effect in case["effects"]}


def simulate_cases(cases: list[dict]) -> list[list[np.ndarray]]:
    """Logs of each case of the batched generator: real runs, then those of its simulator; arrays (rows, 6)."""
    logs: list[list[np.ndarray]] = [[] for _ in cases]
    rubbing = [bool(hidden(case).keys() & {"coulomb_friction", "stiction"}) for case in cases]
    for group in (True, False):
        members = [k for k, rubs in enumerate(rubbing) if rubs is group]
        runs = [(k, run) for k in members for run in plan(cases[k])]
        if runs:
            for (k, _), log in zip(runs, simulate_runs([run for _, run in runs]), strict=True):
                logs[k].append(log)
    return logs


def plan(case: dict) -> list[dict]:
    """The runs of a case, each with its own commands, start and random draws."""
    rng = np.random.default_rng([case["seed"], 2])
    runs = []
    for number in range(RUNS + (SIM_RUNS if case["sim"] else 0)):
        real = number < RUNS
        runs.append({
            "robot": case["robot"] if real else case["sim"],
            "effects": hidden(case) if real else {},
            "period": case["period"],
            "u": robots.draw_commands(rng, ROWS, case["inputs"] if real else "multilevel"),
            "start": [*rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi)],
            "session_time": case["session"] / RUNS * number if real else 0.0,
            "slip": robots.slip_series(rng, case["slip"] if real else None, ROWS, case["period"]),
            "noise": case["noise"] if real else None,
            "rng": np.random.default_rng([case["seed"], 3, number]),
        })  # fmt: skip
    return runs


def simulate_runs(runs: list[dict]) -> list[np.ndarray]:
    """Logs (rows, 6) of runs of equal length, in one batch; without generators nothing in it happens by chance."""
    rngs = [run["rng"] for run in runs]
    period = np.array([run["period"] for run in runs])
    poses = simulate(
        [run["robot"] for run in runs],
        [run["effects"] for run in runs],
        period,
        np.stack([run["u"] for run in runs], axis=1),
        np.array([run["start"] for run in runs]),
        np.array([run["session_time"] for run in runs]),
        slip=np.stack([run["slip"] for run in runs], axis=1),
        rngs=rngs if any(rngs) else None,
    )
    return [as_log(run, poses[:, k]) for k, run in enumerate(runs)]


def as_log(run: dict, seen: np.ndarray) -> np.ndarray:
    """t, u_r, u_l, x, y, theta of one run: white camera error, late frames, headings wrapped, no last command."""
    t = run["period"] * np.arange(len(seen))
    if run["noise"] is not None:
        size = [run["noise"]["position"]] * 2 + [run["noise"]["heading"]]
        seen = frozen(run["effects"], seen + run["rng"].normal(size=seen.shape) * size, run["rng"])
    theta = np.mod(seen[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    u = np.array(run["u"])
    u[-1] = np.nan
    return np.column_stack([t, u, seen[:, :2], theta])


def write_log(path: pathlib.Path, log: np.ndarray) -> None:
    """One run as CSV."""
    rows = ["t,u_r,u_l,x,y,theta"]
    for t, u_r, u_l, *pose in log:
        command = "," if np.isnan(u_r) else f"{u_r:.4f},{u_l:.4f}"
        rows.append(f"{t:.6f},{command}," + ",".join(f"{value:.6f}" for value in pose))
    with gzip.GzipFile(path, "wb", mtime=0) as file:
        file.write(("\n".join(rows) + "\n").encode())


def write_case(folder: pathlib.Path, logs: list[np.ndarray]) -> None:
    """real_1.. and sim_1.. of one case."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, log in enumerate(logs):
        real = number < RUNS
        write_log(folder / f"{'real' if real else 'sim'}_{number + 1 - (0 if real else RUNS)}.csv.gz", log)


def write_answers(path: pathlib.Path, cases: dict[str, dict]) -> None:
    """The answers of all cases, with what their keys mean."""
    later = any(case["kind"] in ("many", "mixed") for case in cases.values())
    meanings = FORMAT | LATER_FORMAT if later else FORMAT
    text = json.dumps({"schema": SCHEMA, "format": meanings, "cases": cases}, indent=1, sort_keys=True)
    path.write_text(text + "\n")
