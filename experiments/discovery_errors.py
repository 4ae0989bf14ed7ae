"""How often does the search for curves find one where there is none, or take a signal that has nothing to do with it?

    python -m experiments.discovery_errors --robots 60 --out ERRORS.json

Robots of the batched generator without any effect, every second one with slip, six runs each. Counted are curves that
the search takes on the runs for naming; the judging runs would have to confirm them as well, so that users see fewer.
Beside the search each robot is offered PLACEBOS signals of nothing: each as a force along and as one in heading, under
the same price and the same rules. `experiments/discovered.md` tells what came out.
"""

import argparse
import json
import multiprocessing
import time

import numpy as np

PLACEBOS = ("random walk", "sine", "steps", "noise over a second", "ramps")


def placebo(kind: str, rng, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and values of a signal that knows nothing of the robot, from -1 to 1."""
    t = np.arange(0.0, duration + 1.0, 0.05)
    if kind == "sine":
        value = np.sin(2.0 * np.pi * (t / rng.uniform(1.0, 20.0) + rng.uniform()))
    elif kind == "steps":
        value = np.repeat(rng.uniform(-1.0, 1.0, len(t) // 20 + 1), 20)[: len(t)]
    elif kind == "ramps":
        value = (t / rng.uniform(2.0, 30.0) + rng.uniform()) % 1.0
    else:
        value = rng.normal(size=len(t))
        value = np.cumsum(value) if kind == "random walk" else np.convolve(value, np.ones(20), "same")
    return t, 2.0 * (value - value.min()) / np.ptp(value) - 1.0


def one(seed: int) -> dict:
    """What the search says of one robot."""
    import jaxident as ji

    ji.start_jax()
    from jaxident.diagnosis.causes.finding import find_effects
    from jaxident.diagnosis.discovery.search import discover
    from jaxident.diagnosis.preparation.prepare import prepare
    from jaxident.log import make_log

    from .withheld.protocol import cases

    case = cases.describe(seed, "none", [], slip=bool(seed % 2), sim=None)
    runs = cases.simulate_cases([case])[0]
    logs = [make_log(log[:, 0], *np.nan_to_num(log[:, 1:3]).T, *log[:, 3:6].T) for log in runs[: cases.RUNS]]
    begin = time.perf_counter()
    finding = find_effects(prepare(logs, None))[1]
    between = time.perf_counter()
    found = discover(finding)
    return {
        "seed": seed, "named": list(finding.selected),
        "curves": [list(curve.kind) for curve in found[-1].curves] if found else [],
        "placebos": offered(finding, np.random.default_rng([seed, 9])),
        "seconds": [between - begin, time.perf_counter() - between],
    }  # fmt: skip


def offered(finding, rng) -> dict[str, float]:
    """What each placebo is worth, in log evidence, the better of both forces; above SURE it would be taken."""
    from jaxident.diagnosis.causes.settled import whiten
    from jaxident.diagnosis.discovery.curves import precision
    from jaxident.diagnosis.discovery.search import _base, _beside
    from jaxident.diagnosis.laws.candidates import INSIDE, KNOTS, hats, path_of
    from jaxident.diagnosis.laws.kinds import KINDS
    from jaxident.diagnosis.motion.responses import respond

    windows = finding.data.windows._replace(wheels=None, turning=None)
    fit = finding.fit
    data, _ = whiten(fit, windows, finding.law)
    base, prior = _base(data, fit, ())
    responses = respond(np.exp(fit.vector[:2]), fit.linear.residual, windows)
    now = path_of(fit, windows).signals["time"]
    worth = {}
    for kind in PLACEBOS:
        signal = np.interp(now, *placebo(kind, rng, float(now.max())))
        at = np.linspace(*np.quantile(signal, INSIDE), KNOTS)
        parts = (part @ hats(signal, at) for part in (responses.along, responses.heading))
        bent = [_beside(data, fit, base, prior, columns, precision((at,), np.zeros((KNOTS, 0)))) for columns in parts]
        price = np.log(len(KINDS) + 2 * len(PLACEBOS))
        worth[kind] = max(min(each.evidence - price, each.held_out) for each in bent)
    return worth


def error(hits: int, whole: int) -> float:
    """Standard error of a share [%]."""
    return 100.0 * (hits / whole * (1.0 - hits / whole) / whole) ** 0.5


def told(rows: list[dict]) -> str:
    """The counts, with the standard error of each share."""
    from jaxident.diagnosis.causes.search_rounds import SURE

    count, tries = len(rows), len(rows) * len(PLACEBOS)
    curves = sum(bool(row["curves"]) for row in rows)
    taken = sum(value > SURE for row in rows for value in row["placebos"].values())
    lines = [
        f"{name}: {hits} of {whole}, {100 * hits / whole:.1f} +- {error(hits, whole):.1f} %"
        for name, hits, whole in (("robots with a curve", curves, count), ("placebos taken", taken, tries))
    ]
    best = max(value for row in rows for value in row["placebos"].values())
    seconds = np.median([row["seconds"] for row in rows], axis=0)
    return "\n".join([*lines, f"best placebo: {best:.1f} (taken from {SURE:g} on)",
                      f"seconds, median: {seconds[0]:.0f} for names, {seconds[1]:.0f} for curves"])  # fmt: skip


def main() -> None:
    """Robots of consecutive seeds, some at a time; the rows are written as they come."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=60)
    parser.add_argument("--seed", type=int, default=2026112801)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", required=True)
    options = parser.parse_args()
    rows = []
    with multiprocessing.get_context("spawn").Pool(options.jobs) as pool:
        for row in pool.imap_unordered(one, range(options.seed, options.seed + options.robots)):
            rows.append(row)
            with open(options.out, "w") as stream:
                json.dump(rows, stream, indent=1)
    print(told(rows))


if __name__ == "__main__":
    main()
