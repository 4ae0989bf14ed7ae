"""How long do commands take to reach the wheels of real robots, and is it always as long?

    python -m experiments.withheld.real.command_delay --data ../shared/data

Stretches of three seconds in which the commanded turn rate changes. In each, the delay (5 ms apart) and gain whose
commanded heading lies nearest the measured one. Beside it the same of a made-up robot that gets the same commands
always 0.12 s late, with a lag of 0.08 s, seen at the same instants with 0.15 mrad of noise: how far readings scatter
where nothing does.
"""

import argparse
import pathlib

import numpy as np

from .logs import CREATES, read_streams

LONG, DELAYS = 3.0, np.arange(0.0, 0.6, 0.005)  # [s]
LEAST_CHANGE, LEAST_POSES, LARGEST_JUMP = 0.25, 120, 0.2
"""Of the commanded turn rate in a stretch [rad/s]; poses in it; heading between two poses [rad], more is a fault."""
FIXED_DELAY, FIXED_LAG, FINE, NOISE = 0.12, 0.08, 0.005, 1.5e-4  # [s], [s], [s], [rad]


def readings(t: np.ndarray, w: np.ndarray, seen: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Delay [s] and gain (stretches, 2) of every stretch that tells them, from turn rates w commanded at t and headings
    seen."""
    turned = np.append(0.0, np.cumsum(w[:-1] * np.diff(t)))
    found = []
    first, last = max(t[0], seen[0]) + 1.0, min(t[-1], seen[-1]) - LONG
    for begin in np.arange(first, last, LONG):
        rows = (seen >= begin) & (seen < begin + LONG)
        told = w[(t >= begin - 0.5) & (t < begin + LONG)]
        if (
            rows.sum() < LEAST_POSES
            or np.ptp(told) < LEAST_CHANGE
            or np.max(np.abs(np.diff(heading[rows]))) > LARGEST_JUMP
        ):
            continue
        expected = np.interp(seen[rows] - DELAYS[:, None], t, turned)
        expected -= expected.mean(axis=1, keepdims=True)
        power, measured = np.sum(expected**2, axis=1), heading[rows] - heading[rows].mean()
        gain = expected @ measured / np.maximum(power, 1e-9)
        best = np.argmin(np.sum((measured - gain[:, None] * expected) ** 2, axis=1))
        if 0 < best < len(DELAYS) - 1:
            found.append((DELAYS[best], gain[best]))
    return np.array(found)


def made_up(t: np.ndarray, w: np.ndarray, seen: np.ndarray, rng) -> np.ndarray:
    """Heading at the instants seen of a robot that turns as commanded, always as late."""
    fine = np.arange(t[0], t[-1], FINE)
    late = w[np.clip(np.searchsorted(t, fine - FIXED_DELAY, side="right") - 1, 0, None)]
    age = np.arange(0.0, 8.0 * FIXED_LAG, FINE)
    response = np.exp(-age / FIXED_LAG)
    rate = np.convolve(late, response / response.sum())[: len(fine)]
    return np.interp(seen, fine, np.cumsum(rate) * FINE) + NOISE * rng.normal(size=len(seen))


def quartiles(values: np.ndarray) -> str:
    """Median, quartiles in brackets."""
    low, middle, high = np.percentile(values, (25, 50, 75))
    return f"{middle:.3f} ({low:.3f} to {high:.3f})"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--robots", nargs="+", default=CREATES, help="create_1 to create_5")
    options = parser.parse_args()
    print("| robot | stretches | delay [s] (quartiles) | gain | delay of the made-up robot [s] |")
    print("|---|---|---|---|---|")
    for robot in options.robots:
        commands, poses = read_streams(options.data, robot)
        told, seen = (commands.t, commands.value.w), poses.t
        real = readings(*told, seen, np.unwrap(poses.pose.theta))
        even = readings(*told, seen, made_up(*told, seen, np.random.default_rng(0)))
        cells = [quartiles(real[:, 0]), quartiles(real[:, 1]), quartiles(even[:, 0])]
        print(" | ".join([f"| {robot}", f"{len(real)}", *cells]), "|")


if __name__ == "__main__":
    main()
