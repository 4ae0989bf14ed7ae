"""How does each effect of the catalogue show?

    python -m experiments.effects_sheet --out effects_sheet

The published robot at each effect's typical size and the nominal one under the same commands: what a tenth of a second
takes the one further than the other, each in the frame of its own pose at the start, against command, speed, heading,
position and time. Along and lateral stand against the mean command and v, heading against half the difference of the
commands and w: labels give both, for along and lateral | for heading. One picture per effect, and one sheet of all.
"""

import argparse
import pathlib

import jax
import jax.numpy as jnp
import numpy as np

import jaxident as ji
from jaxident.effects import CATALOGUE, NEUTRAL, SITES, run_full, to_vector
from jaxident.robot.model import Effect
from jaxident.study.synthetic import excite

ROWS, HOLD, HORIZON = 601, 15, 3
AMPLITUDE = 1.0


@jax.jit
def poses(drive, width, vector, t, command, start, key):
    """Reported poses (samples, 3)."""
    return jnp.stack(run_full(drive, width, vector, t, command, start, key=key), axis=1)


def departures(path: np.ndarray, nominal: np.ndarray) -> dict[str, np.ndarray]:
    """Motion over HORIZON rows, in the frame of its own first pose, less that of the nominal robot [mm], [mrad]."""
    moved = [local_motion(each) for each in (path, nominal)]
    difference = 1e3 * (moved[0] - moved[1])
    return {"along": difference[:, 0], "lateral": difference[:, 1], "heading": difference[:, 2]}


def channels(along: np.ndarray, heading: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """What the channels are drawn against: the same for all, or another for the heading."""
    return {"along": along, "lateral": along, "heading": along if heading is None else heading}


def local_motion(path: np.ndarray) -> np.ndarray:
    """Along, to the left, and the turn, from each row to the one HORIZON rows later: (samples - HORIZON, 3)."""
    step = path[HORIZON:] - path[:-HORIZON]
    sine, cosine = np.sin(path[:-HORIZON, 2]), np.cos(path[:-HORIZON, 2])
    along, left = step[:, 0] * cosine + step[:, 1] * sine, step[:, 1] * cosine - step[:, 0] * sine
    return np.stack([along, left, step[:, 2]], axis=1)


def main() -> None:
    """Simulate, and draw every picture and the sheet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("effects_sheet"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    robot = ji.load_model("published")
    log = excite(jax.random.key(2), "multilevel", ROWS, robot.sample_period, amplitude=AMPLITUDE, hold=HOLD)
    key, start = jax.random.key(1), ji.State(0.0, 0.0, 0.0, 0.0, 0.0)
    body = robot.physical, jnp.asarray(robot.dead_zone)

    def run(vector):
        return poses(*body, vector, jnp.asarray(log.t), log.command, start, key)

    nominal = np.asarray(run(jnp.asarray(NEUTRAL)))
    motion = local_motion(nominal)
    rows = slice(0, ROWS - HORIZON)
    u_r, u_l = (np.asarray(u)[rows] for u in log.command)
    v, w = (motion[:, k] / np.abs(motion[:, k]).max() for k in (0, 2))
    regressors = {
        "mean | half-difference command [unit]": channels((u_r + u_l) / 2, (u_r - u_l) / 2),
        "speed | turn rate, over its largest": channels(v, w),
        "heading [rad]": channels(np.mod(nominal[rows, 2], 2 * np.pi)),
        "position $x$ [m]": channels(nominal[rows, 0]),
        "time [s]": channels(np.asarray(log.t)[rows]),
    }
    found = {}
    for name, entry in CATALOGUE.items():
        path = np.asarray(run(to_vector([Effect(name, entry.typical())])))
        found[name] = departures(path, nominal)
        figure, axes = ji.plot.figure(1, len(regressors), size=(13.0, 1.9))
        ji.plot.effect_signature(name, found[name], regressors, axes=axes)
        ji.plot.save(figure, options.out / f"{name}.png")
    figure, axes = ji.plot.figure(len(found), len(regressors), size=(13.0, 1.15 * len(found)), share_x=True)
    in_order = sorted(found, key=lambda name: SITES.index(CATALOGUE[name].site))
    for name, row in zip(in_order, axes, strict=True):
        ji.plot.effect_signature(f"{name} ({CATALOGUE[name].site})", found[name], regressors, axes=row)
        if name != in_order[-1]:
            for ax in row:
                ax.set_xlabel("")
    ji.plot.save(figure, options.out / "sheet.png")


if __name__ == "__main__":
    ji.start_jax()
    main()
