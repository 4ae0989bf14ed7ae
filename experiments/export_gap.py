"""How many millimetres of the gap an export to MuJoCo closes, on held-out commands.

    python -m experiments.export_gap [--effects transport_delay,motor_lag] --out export_gap.md

First a robot without effects: a model is identified from noisy logs, exported, and run in MuJoCo on commands of another
log, beside `simulate` of the same model; both are compared with the true path. Then one robot for each effect of the
catalogue, of typical size: the export of the nominal model beside that of the model with the effect. Distances are root
mean squares 1 s ahead, over all stretches of a run of 9 s.
"""

import argparse
import pathlib

import jax
import mujoco
import numpy as np

import jaxident as ji
from jaxident.effects.apply import with_effects
from jaxident.effects.catalogue import CATALOGUE
from jaxident.export.export import TARGETS
from jaxident.export.gap import apart
from jaxident.export.split import split
from jaxident.robot.drive import Physical

PERIOD, ROWS, HOLD = 0.03, 300, 12
DRIVE = Physical(np.array([4.0, 6.0]), np.array([[1.2, 1.1], [9.0, -8.5]]), np.array([0.02, -1.0]))
ROBOT = ji.Model(PERIOD, DRIVE, np.array([0.1, 0.12]))
"""A small robot: a track of 395 mm, 0.57 m/s per unit of command at each wheel, time constants 0.25 and 0.17 s."""
NOISE = ji.Noise(position=5e-4, heading=2e-3)
SHORT = {"not carried": ""}
SETTLE = 0.3
"""Seconds in which the engine's robot comes to rest on its wheels before the log begins."""


def commands(seed: int) -> np.ndarray:
    """Commands (ROWS, 2) of a run."""
    wheels = ji.EXCITATIONS["multilevel"](jax.random.key(seed), ROWS, 1.0, HOLD)
    return np.stack([np.asarray(u) for u in wheels], axis=1)


def truth(model: ji.Model, u: np.ndarray, key: jax.Array | None = None) -> np.ndarray:
    """Poses (rows, 3) of a model by the package's own simulator."""
    log = ji.make_log(float(model.sample_period) * np.arange(len(u)), u[:, 0], u[:, 1])
    return np.stack([np.asarray(column) for column in ji.simulate(model, log, key=key).pose], axis=1)


def drive(made, u: np.ndarray, period: float) -> np.ndarray:
    """Poses (rows, 3) of an exported robot in MuJoCo, from rest; `made` is an `Export` to mjcf."""
    engine = mujoco.MjModel.from_xml_string(made.text)
    data, step = mujoco.MjData(engine), engine.opt.timestep
    own: dict = {}
    if made.commands is not None:
        exec(compile(made.commands, "commands", "exec"), own)
    wrapper = own["Robot"]() if own else None
    level = engine.opt.gravity.copy()
    engine.opt.gravity[:2] = 0.0
    for _ in range(round(SETTLE / step)):
        mujoco.mj_step(engine, data)
    engine.opt.gravity[:] = level
    data.qpos[:2], data.qpos[3:7], data.qvel[:] = 0.0, (1.0, 0.0, 0.0, 0.0), 0.0
    mujoco.mj_forward(engine, data)
    marker, poses = data.site("marker"), []
    for row in u:
        turn = marker.xmat.reshape(3, 3)
        poses.append([marker.xpos[0], marker.xpos[1], np.arctan2(turn[1, 0], turn[0, 0])])
        for _ in range(round(period / step)):
            if wrapper is not None:
                wrapper.step(*row, step)
            data.ctrl[:] = row if wrapper is None else (wrapper.m_r, wrapper.m_l)
            mujoco.mj_step(engine, data)
    return np.array(poses)


def away(path: np.ndarray, true: np.ndarray) -> float:
    """Root mean square distance 1 s ahead [mm]."""
    return 1e3 * apart(path, true, PERIOD)


def identified() -> tuple[float, float]:
    """How far `simulate` and the export of an identified model are from the true path [mm]."""
    noisy = ji.Model(PERIOD, ROBOT.dynamics, ROBOT.dead_zone, NOISE)
    logs = []
    for seed in (1, 2):
        u = commands(seed)
        t = PERIOD * np.arange(ROWS)
        logs.append(ji.simulate(noisy, ji.make_log(t, u[:, 0], u[:, 1]), key=jax.random.key(seed)))
    model = ji.identify(logs).model
    u = commands(7)
    true = truth(ROBOT, u)
    return away(truth(model, u), true), away(drive(ji.export(model, "mjcf"), u, PERIOD), true)


def one_effect(name: str) -> tuple[str, str, float, float]:
    """An effect, how it is carried, and how far the exports of the nominal and of the whole model are from it [mm]."""
    record = CATALOGUE[name]
    model = with_effects(ROBOT, [(name, record.typical(PERIOD * ROWS))])
    u = commands(7)
    true = truth(model, u, jax.random.key(0) if record.random else None)
    made, plain = ji.export(model, "mjcf"), ji.export(ROBOT, "mjcf")
    part = next(part for part in made.parts if part.name == name)
    how = part.where if part.how == "field" else part.how
    return name, how, away(drive(plain, u, PERIOD), true), away(drive(made, u, PERIOD), true)


def carried() -> list[str]:
    """Rows of a table: how each target carries each effect at its typical size."""
    lines = [f"| effect | {' | '.join(TARGETS)} |", "|---|" + "---|" * len(TARGETS)]
    for name, record in CATALOGUE.items():
        model = with_effects(ROBOT, [(name, record.typical(PERIOD * ROWS))])
        ways = [next(part.how for part in split(model, one) if part.name == name) for one in TARGETS.values()]
        lines.append(f"| {name} | {' | '.join(SHORT.get(way, way) for way in ways)} |")
    return lines


def main() -> None:
    """Print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--effects", default=",".join(CATALOGUE), help="names, with commas")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("export_gap.md"))
    options = parser.parse_args()
    own, exported = identified()
    lines = [
        "Without effects, identified from two noisy runs, root mean square 1 s ahead:",
        f"`simulate` {own:.3f} mm, the export in MuJoCo {exported:.3f} mm ({exported / own:.3f} times).",
        "",
        "| effect | carried by | nominal export [mm] | export with it [mm] | closed |",
        "|---|---|---|---|---|",
    ]
    print("\n".join(lines), flush=True)
    for name in filter(None, options.effects.split(",")):
        effect, how, before, after = one_effect(name)
        lines.append(f"| {effect} | {how} | {before:.2f} | {after:.2f} | {100.0 * (1.0 - after / before):.0f} % |")
        print(lines[-1], flush=True)
    lines += ["", "What each target carries in a field and in the commands' wrapper:", "", *carried()]
    options.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    ji.start_jax()
    main()
