"""Pairs of effects that poses tell apart badly: how many rivals are left once wheel speeds are used as well.

    python experiments/wheel_pairs.py --seeds 2

Robots have one faint effect each. Every log is searched twice, with its wheel speeds and without. A row: the effect;
what the search names, what it cannot tell from that, and the log evidence by which the nearest other set is behind; by
the poses alone, then by both sensors.
"""

import argparse
import dataclasses

import jax

import jaxident as ji
from jaxident.diagnosis.causes.finding import find_effects
from jaxident.diagnosis.posterior import alike
from jaxident.diagnosis.preparation.prepare import prepare
from jaxident.effects.catalogue import CATALOGUE
from jaxident.estimation.increments.observations import poses_only
from jaxident.robot.noise import Noise
from jaxident.robot.wheel_sensor import WheelSensor

CASES = {
    "motor_lag": {"time_constant": 0.012}, "traction_limit": {"limit": 5.0},
    "transport_delay": {"delay": 0.008}, "camera_latency": {"delay": 0.008},
    "command_polling": {"period": 0.03, "phase": 0.4},
    "coulomb_friction": {"right": 0.02, "left": 0.02}, "quadratic_drag": {"along": 0.1, "heading": 0.03},
    "lateral_slip": {"slip": 0.01}, "marker_offset": {"ahead": 0.002},
    "asymmetric_dead_zone": {"right": 0.01, "left": 0.01}, "turn_loss": {"loss": 0.02},
}  # fmt: skip
"""One effect of each pair after the other, so small that poses alone often leave rivals."""
SENSOR = WheelSensor(0.03, 0.1, 0.1)
ROWS = 900


def searched(log):
    """Names, what each cannot be told from, and by how much log evidence the next set is behind."""
    _, finding = find_effects(prepare(log, None))
    named = frozenset(finding.selected)
    others = [worth for each, worth in finding.values.items() if len(each) == len(named) and each != named]
    rivals = tuple(sorted({rival for name in named for rival in alike(finding, name)}))
    return finding.selected, rivals, -max(others, default=0.0)


def compare(name: str, seed: int, size: float = 1.0):
    """The search of one robot's log by poses alone, and by both sensors."""
    nominal = ji.load_model("published")
    key = jax.random.key(seed)
    inputs = ji.excite(key, "multilevel", ROWS, nominal.sample_period)
    effects, noise = (ji.Effect(name, {key: size * value for key, value in CASES[name].items()}),), Noise(0.001, 0.005)
    robot = dataclasses.replace(nominal, effects=effects, noise=noise, wheels=SENSOR)
    log = ji.simulate(robot, inputs, key=jax.random.fold_in(key, 1))
    log = type(log)(*(None if column is None else jax.device_get(column) for column in log))
    return searched(poses_only(log)), searched(log)


def right(name: str, found) -> bool:
    """Whether all that is named lies at the effect's site."""
    return bool(found[0]) and all(CATALOGUE[each].site == CATALOGUE[name].site for each in found[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--size", type=float, default=1.0, help="times the sizes of CASES")
    parser.add_argument("--effects", default=",".join(CASES))
    options = parser.parse_args()
    ji.start_jax()
    rows = []
    for name in options.effects.split(","):
        for seed in range(options.seeds):
            found = compare(name, seed, options.size)
            rows.append((name, *found))
            print(
                name,
                seed,
                *(f"| {','.join(n) or 'none'} ~ {','.join(r) or '-'} {m:.1f}" for n, r, m in found),
                flush=True,
            )
    fewer = sum(len(both[1]) < len(poses[1]) for _, poses, both in rows)
    open_sets = sum(bool(poses[1]) for _, poses, _ in rows)
    sites = [sum(right(row[0], row[k]) for row in rows) for k in (1, 2)]
    print(f"{len(rows)} robots: {open_sets} with rivals by poses, {fewer} with fewer by both sensors; "
          f"site right {sites[0]} by poses, {sites[1]} by both")  # fmt: skip


if __name__ == "__main__":
    main()
