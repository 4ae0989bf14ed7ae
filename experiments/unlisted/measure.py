"""One robot: its diagnosis, what that brings on fresh runs, and both in words."""

import time

import numpy as np

from .robots import FRESH, KINDS, NOISE, ROWS, RUNS, SLIP, STEP, Robot, draw_robot, drive

HORIZON = round(1.0 / STEP)
"""Rows that predictions go ahead."""
SESSION = STEP * ROWS * RUNS
"""Session time [s] at which fresh runs begin: after those that are diagnosed."""


def as_logs(runs: np.ndarray) -> list:
    """Runs (runs, ROWS, 6) as logs."""
    from jaxident.log import make_log

    return [make_log(rows[:, 0], rows[:, 1], rows[:, 2], *rows[:, 3:].T) for rows in runs]


def ahead(model, logs: list) -> float:
    """The mean squared error at the horizon over the camera's variances, of free runs from every horizon on. The logs
    begin one after the other, after those that are diagnosed."""
    import jaxident as ji
    from jaxident.numerics import wrap

    found = []
    for begin, log in zip(SESSION + STEP * ROWS * np.arange(len(logs)), logs, strict=True):
        run = ji.predict(model, log, HORIZON, session_time=begin)
        last = np.flatnonzero(run.step == HORIZON)
        row = run.start[last] + HORIZON
        apart = [
            np.asarray(getattr(run, name))[last] - np.asarray(getattr(log, name))[row] for name in ("x", "y", "theta")
        ]
        apart[2] = np.asarray(wrap(apart[2]))
        found.append((np.stack(apart, axis=1) / np.array([NOISE[0], *NOISE])) ** 2)
    return float(np.mean(np.concatenate(found)))


def true_model(robot: Robot):
    """The robot without its effect."""
    from jaxident.robot.drive import Physical
    from jaxident.robot.model import Model
    from jaxident.robot.noise import Noise

    noise = Noise(*NOISE, None, slip_along=SLIP[0], slip_heading=SLIP[1])
    return Model(STEP, Physical(robot.rate, robot.gain, np.zeros(2)), robot.zone, noise)


def one(job: tuple[str, int, float]) -> dict:
    """What a diagnosis of one robot finds, and what that brings on fresh runs."""
    import jaxident as ji
    from jaxident.files.diagnosis import diagnosis_to_dict

    kind, seed, size = job
    ji.start_jax()
    robot = draw_robot(np.random.default_rng([seed, 1]))
    begin = time.perf_counter()
    found = ji.diagnose(as_logs(drive(robot, kind, size, RUNS, 1000 * seed + 2)))
    seconds = time.perf_counter() - begin

    def fresh(kind: str) -> list:
        return as_logs(drive(robot, kind, size, FRESH, 1000 * seed + 3, SESSION))

    told = diagnosis_to_dict(found)
    return {
        "kind": kind, "seed": seed, "size": size, "seconds": round(seconds, 1), "verdict": found.verdict,
        "named": list(found.selected), "laws": told["discovered"] or [],
        "nominal": ahead(found.nominal_model, fresh(kind)), "corrected": ahead(found.corrected_model, fresh(kind)),
        "known": ahead(true_model(robot), fresh("nothing")), "promised": told["gap"],
    }  # fmt: skip


def achieved(row: dict) -> float:
    """The part of the error beyond the known robot's that the corrected model takes away; NaN where there is none."""
    whole = row["nominal"] - row["known"]
    return (row["nominal"] - row["corrected"]) / whole if whole > 0.5 * row["known"] else float("nan")


def table(rows: list[dict]) -> str:
    """A Markdown table, a row for each robot."""
    lines = ["| kind | seed | named | nominal | corrected | known | achieved | discovered | s |", "|---" * 9 + "|"]
    for row in sorted(rows, key=lambda row: (list(KINDS).index(row["kind"]), row["seed"])):
        laws = "; ".join(_law(law) for law in row["laws"]) or "none"
        errors = " | ".join(f"{row[name]:.3g}" for name in ("nominal", "corrected", "known"))
        lines.append(f"| {row['kind']} | {row['seed']} | {', '.join(row['named'])} | {errors} | {achieved(row):.2f} | "
                     f"{laws} | {row['seconds']:.0f} |")  # fmt: skip
    return "\n".join(lines)


def _law(law: dict) -> str:
    times = "" if law["times"] == "1" else f"{law['times']} times "
    like = law["looks_like"]
    signals = [name for name in law["inputs"] if name != law["times"]]
    form = "" if like is None else f" ({like['form']}, {100 * like['part_explained']:.0f} %)"
    return f"{law['acts_on']}: {times}{' and '.join(signals)}{form}"


def line(row: dict) -> str:
    """What came out of one robot."""
    return f"{row['kind']} {row['seed']}: achieved {achieved(row):.2f}, {'; '.join(map(_law, row['laws'])) or 'no law'}"
