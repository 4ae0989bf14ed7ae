"""How far ahead do identified models see on real robots?

    python -m experiments.real_robots --data ../shared/data --out real_robots [--robots 1 2]

Five iRobot Create robots (UTIAS MRCLAM dataset 6, Leung et al. 2011; motion capture): identified on the first half of
each log, predicted 10 s ahead on the second. A Husky (norlab-ulaval DRIVE; lidar): identified on the windows of two in
three commands, predicted 1 s ahead on those of the third. The paper's method; maximum likelihood under the noise law
that it finds; the nominal and the corrected model of `jaxident diagnose` on the same rows (with `--diagnose`, some
minutes a robot); and a robot that does what it is told: the last measured pose, moved on with the commanded speeds. One
picture per robot, of the last model, and a table: errors as medians and root mean squares over the starts.
"""

import argparse
import json
import pathlib
import time
from collections.abc import Iterator

import numpy as np

import jaxident as ji
from jaxident.estimation.predict import prediction_error
from jaxident.files.streams import merge, read_commands, read_poses
from jaxident.log import Log, between, join
from jaxident.robot.model import Model

CREATE_TRACK = 0.258
PERIOD = 0.05
HUSKY_TRACK, HUSKY_WHEEL = 0.5708, 0.165
WINDOWS = 3
"""Windows of 2 s that the Husky has for each command. The first shows how its speeds settle, the others hardly do."""
METHODS = ("paper", "maximum-likelihood")


def commanded(log: Log, prediction, track: float, wheel: float = 1.0):
    """The prediction of a unicycle that moves at the commanded speeds from the last pose seen at each start."""
    runs = {int(run.run[0]): run for run in log.runs()}
    columns = {name: np.array(getattr(prediction, name), float) for name in ("x", "y", "theta")}
    keys = np.stack([prediction.run, prediction.start])
    for run_number, start in np.unique(keys, axis=1).T:
        run, rows = runs[int(run_number)], np.flatnonzero((keys[0] == run_number) & (keys[1] == start))
        seen = np.flatnonzero(np.isfinite(run.x[: start + 1]))[-1]
        stop = start + len(rows)
        step = np.diff(run.t[seen : stop + 1])
        v, w = (run.u_r + run.u_l)[seen:stop] * wheel / 2, (run.u_r - run.u_l)[seen:stop] * wheel / track
        theta = run.theta[seen] + np.concatenate([[0.0], np.cumsum(w * step)])
        middle = 0.5 * (theta[1:] + theta[:-1])
        late = slice(start - seen, None)
        columns["x"][rows] = (run.x[seen] + np.cumsum(v * step * np.cos(middle)))[late]
        columns["y"][rows] = (run.y[seen] + np.cumsum(v * step * np.sin(middle)))[late]
        columns["theta"][rows] = theta[1:][late]
    return prediction._replace(**columns)


def models(known: Log, diagnosed: bool) -> Iterator[tuple[str, bool, Model]]:
    """Models that each method makes of a log, and whether it says that it succeeded. Behind the name of each effect
    stands the probability that it takes part."""
    for method in METHODS:
        found = ji.identify(known, method)
        yield method, bool(found.ok), found.model
    if diagnosed:
        gap = ji.diagnose(known)
        ok = gap.verdict != "undecided"
        sure = {cause.effect: cause.probability for cause in gap.judgement.causes}
        names = ", ".join(f"{each.name} {sure[each.name]:.2f}" for each in gap.corrected_model.effects)
        yield "diagnose, nominal", ok, gap.nominal_model
        yield f"diagnose, corrected ({names})", ok, gap.corrected_model


def judge(
    name: str, known: Log, unseen: Log, horizon: int, burn_in: int, baseline, out: pathlib.Path, diagnosed: bool
) -> list[dict]:
    """Identify on one part, predict the other, draw, and return the rows of the table."""
    rows, begin = [], time.monotonic()
    for method, ok, model in models(known, diagnosed):
        prediction = ji.predict(model, unseen, horizon, burn_in=burn_in)
        seconds, noise = time.monotonic() - begin, model.noise._asdict() if model.noise else {}
        error = prediction_error(prediction, unseen)
        rows.append({"robot": name, "method": method, "ok": ok, "took": seconds, **error, **noise})
        begin = time.monotonic()
    draw(name, unseen, prediction, f"{error['position_median']:.2g} m off after {error['seconds']:.2g} s (median)", out)
    rows.append({"robot": name, "method": "commanded", **prediction_error(baseline(unseen, prediction), unseen)})
    for row in rows:
        print(row, flush=True)
    return rows


def draw(name: str, log: Log, prediction, verdict: str, out: pathlib.Path) -> None:
    """One picture of a log with its predictions; of many short runs the six that move most."""
    runs = sorted(log.runs(), key=lambda run: -np.hypot(np.nanstd(run.x), np.nanstd(run.y)))[:6]
    shape = (1, 1, (6.3, 5.2)) if len(runs) == 1 else (2, 3, (8.0, 5.6))
    figure, axes = ji.plot.figure(*shape[:2], size=shape[2])
    for run, ax in zip(runs, np.ravel(axes), strict=True):
        own = prediction.run == run.run[0]
        ji.plot.path(run, type(prediction)(*(column[own] for column in prediction)), ax=ax)
        if ax is not np.ravel(axes)[0]:
            ax.get_legend().remove()
    figure.supxlabel(f"{name}: {verdict}", fontsize=9)
    ji.plot.save(figure, out / f"{name}.png")


def creates(data: pathlib.Path, robots: list[int], out: pathlib.Path, diagnosed: bool) -> list[dict]:
    """The five Creates, each on its own halves."""
    rows = []
    for robot in robots:
        stem = data / "mrclam" / f"D6_R{robot}"
        streams = read_commands(f"{stem}_commands.csv.gz"), read_poses(f"{stem}_poses.csv.gz")
        log = merge(*streams, track=CREATE_TRACK, period=PERIOD)
        middle = float(log.t[0] + log.t[-1]) / 2
        halves = between(log, None, middle), between(log, middle, None)
        rows += judge(f"create_{robot}", *halves, 200, 20, lambda u, p: commanded(u, p, CREATE_TRACK), out, diagnosed)
    return rows


def husky(data: pathlib.Path, out: pathlib.Path, diagnosed: bool) -> list[dict]:
    """The Husky: the windows of two in three commands for identification, those of the third for prediction."""
    runs = ji.read_log(data / "drive_husky" / "husky.csv.gz").runs()
    known = join([run for k, run in enumerate(runs) if k // WINDOWS % 3])
    unseen = join([run for k, run in enumerate(runs) if k // WINDOWS % 3 == 0])
    return judge("husky", known, unseen, 20, 19, lambda u, p: commanded(u, p, HUSKY_TRACK, HUSKY_WHEEL), out, diagnosed)


def table(rows: list[dict]) -> str:
    """The rows as a Markdown table."""
    names = ("position_median", "position_rms", "heading_median", "heading_rms")
    lines = [
        "| robot | method | starts | position, median [m] | rms [m] | heading, median [rad] | rms [rad] | noise law |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        slips, memory = row.get("slip_along"), row.get("correlation_time")
        law = " and ".join(
            words for words, there in (("slip", slips), (f"memory {memory or 0:.2g} s", memory)) if there
        )
        cells = [row["robot"], row["method"], str(row["compared"]), *(f"{row[name]:.3f}" for name in names), law]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run all and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("real_robots"))
    parser.add_argument("--robots", type=int, nargs="*", default=[1, 2, 3, 4, 5])
    parser.add_argument("--diagnose", action="store_true", help="the models of a diagnosis as well")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = creates(options.data, options.robots, options.out, options.diagnose)
    rows += husky(options.data, options.out, options.diagnose)
    (options.out / "table.json").write_text(json.dumps(rows, indent=2) + "\n")
    (options.out / "table.md").write_text(table(rows))


if __name__ == "__main__":
    ji.start_jax()
    main()
