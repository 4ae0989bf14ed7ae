"""How fast real robots drive in turns, of what was commanded: a look at the logs without any model.

    python -m experiments.withheld.real.turning_speed --data ../shared/data --robots create_1 create_2 create_3

Stretches of half a second count whose command has not changed for a second before. Speed is the arc's, from the first
pose and the last.
"""

import argparse
import pathlib

import numpy as np

from .logs import CREATE_TRACK, CREATES, PERIOD, read_robot

SETTLED, LONG = 20, 10
"""Rows before a stretch in which the command stays, and rows of it."""
SLOWEST = 0.02
"""Commanded speed [m/s] below which a ratio says nothing."""
TURNS = ((-np.inf, -0.3), (-0.02, 0.02), (0.3, np.inf))
"""Commanded turn rates [rad/s] that are told apart."""


def stretches(log) -> np.ndarray:
    """Of each steady stretch (stretches, 4): speed and turn rate as commanded, then as driven."""
    v = 0.5 * (np.asarray(log.u_r) + np.asarray(log.u_l))
    w = (np.asarray(log.u_r) - np.asarray(log.u_l)) / CREATE_TRACK
    x, y, theta = (np.asarray(column) for column in log.pose)
    rows = []
    for row in range(SETTLED, len(v) - LONG - 1, LONG // 2):
        steady = slice(row - SETTLED, row + LONG)
        if not (np.ptp(v[steady]) < 1e-6 and np.ptp(w[steady]) < 1e-6 and v[row] > SLOWEST):
            continue
        dx, dy = x[row + LONG] - x[row], y[row + LONG] - y[row]
        turn = np.mod(theta[row + LONG] - theta[row] + np.pi, 2.0 * np.pi) - np.pi
        along = dx * np.cos(theta[row] + 0.5 * turn) + dy * np.sin(theta[row] + 0.5 * turn)
        arc = along / np.sinc(0.5 * turn / np.pi)  # a chord is shorter than its arc
        rows.append((v[row], w[row], arc / (LONG * PERIOD), turn / (LONG * PERIOD)))
    found = np.array(rows).reshape(-1, 4)
    return found[np.isfinite(found).all(axis=1)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--robots", nargs="+", default=CREATES, help="create_1 to create_5")
    options = parser.parse_args()
    print("| robot | commanded turn [rad/s] | stretches | speed over commanded (quartiles) | turn over commanded |")
    print("|---|---|---|---|---|")
    for robot in options.robots:
        found = np.concatenate([stretches(run) for run in read_robot(options.data, robot)])
        for low, high in TURNS:
            own = found[(found[:, 1] >= low) & (found[:, 1] < high)]
            if len(own) < 5:
                continue
            speed = np.percentile(own[:, 2] / own[:, 0], (25, 50, 75))
            turn = f"{np.median(own[:, 3] / own[:, 1]):.2f}" if low > 0 or high < 0 else ""
            told = f"{speed[1]:.3f} ({speed[0]:.3f} to {speed[2]:.3f})"
            print(f"| {robot} | {np.median(own[:, 1]):.2f} | {len(own)} | {told} | {turn} |")


if __name__ == "__main__":
    main()
