"""Questions about robots: what an imperfection costs, and how small an effect can be found."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

import jaxident as ji
from experiments.gallery.answer import CAMERA, PERIOD, ROWS, Answer, picture, plain_robot
from jaxident.array_types import Pose, State
from jaxident.effects import CATALOGUE, run_full
from jaxident.effects.apply import sized
from jaxident.effects.catalogue import to_vector
from jaxident.effects.coordinates import POSES_ONLY, SEARCHED
from jaxident.plot import style
from jaxident.report.page import PHONE

SEEN_ROWS, WINDOW = 1800, 60
"""Rows of the run in which effects are looked for, a minute, and of each of its windows, 2 s."""
STRENGTHS = np.geomspace(1e-4, 30.0, 45)
"""Sizes that are tried, as multiples of the typical one."""
REST = State(0.0, 0.0, 0.0, 0.0, 0.0)
ALARMS = 0.01
"""Share of robots without effect on which any of the effects may be claimed."""


def asymmetry(_: int) -> Answer:
    """What does a weaker wheel cost?"""
    robot, shares = plain_robot(), np.array([0.0, 0.01, 0.02, 0.05, 0.1])
    log = ji.make_log(PERIOD * np.arange(ROWS), np.ones(ROWS), np.ones(ROWS))
    aside, turned = [], []
    for share in shares:
        gain = np.asarray(robot.physical.gain) * np.array([1.0, 1.0 - share])
        path = ji.simulate(dataclasses.replace(robot, dynamics=robot.physical._replace(gain=gain)), log)
        aside.append(float(path.y[-1]))
        turned.append(float(path.theta[-1]))
    turned = np.array(turned) - turned[0]
    figure, ax = ji.plot.figure(size=(PHONE, 3.0))
    ax.plot(100 * shares, turned, "o-")
    ax.set(xlabel="left wheel weaker by [%]", ylabel="turned after 10 s [rad]")
    return Answer(f"A left wheel that is 1 % weaker turns the robot by {turned[1]:.2f} rad in 10 s of equal commands.",
                  picture(figure, "Turn by asymmetry"))  # fmt: skip


def smallest_effect(_: int) -> Answer:
    """How small an effect can be found?"""
    inputs = ji.excite(jax.random.key(0), "multilevel", SEEN_ROWS, PERIOD, hold=15)
    names = [name for name in SEARCHED if name not in POSES_ONLY]
    gain = np.array([_gain(name, inputs) for name in names])  # (effects, strengths)
    power = stats.ncx2.sf(stats.chi2.isf(ALARMS / len(names), 1), 1, np.maximum(gain, 1e-12))
    sizes = np.array([[_crossing(row, level) for level in (0.1, 0.5, 0.9)] for row in power])
    order = np.argsort(sizes[:, 2])[::-1]  # largest first, those never found at the bottom
    figure, ax = ji.plot.figure(size=(6.3, 6.4))
    for place, k in enumerate(order):
        ax.plot(sizes[k, [0, 2]], [place, place], color=style.BLUE, linewidth=3)
        ax.plot(sizes[k, 1], place, "o", color=style.BLUE, markerfacecolor="white")
    ax.set(xscale="log", xlabel="size found, over the typical one", ylim=(-0.7, len(names) - 0.3))
    ax.set_yticks(range(len(names)), [_told(names[k], sizes[k, 2]) for k in order])
    ax.axvline(1.0, color=style.GREY, linewidth=1)
    easy = int(np.sum(sizes[:, 2] < 0.1))
    camera = f"a camera of {1e3 * CAMERA.position:g} mm and {1e3 * CAMERA.heading:g} mrad"
    return Answer(f"{easy} of {len(names)} effects are found nine times out of ten at a tenth of their typical size or "
                  f"less: from one minute of driving before {camera}, without slip, by the best test of each.",
                  picture(figure, "Sizes found once, five and nine times out of ten"))  # fmt: skip


def _crossing(power: np.ndarray, level: float) -> float:
    """The size at which the power passes a level for good, between the sizes tried by the logarithm; NaN where it is
    on one side of the level at all sizes."""
    below = np.flatnonzero(power < level)
    if not len(below) or below[-1] == len(power) - 1:
        return float("nan")
    k = below[-1] + 1
    return float(np.exp(np.interp(level, power[[k - 1, k]], np.log(STRENGTHS[[k - 1, k]]))))


def _told(name: str, strength: float) -> str:
    """An effect, and its first size at a strength."""
    if np.isnan(strength):
        return f"{name}: not found"
    parameter = next(one for one in CATALOGUE[name].parameters if not one.shape)
    return f"{name}: {parameter.name} {_sized(name, strength)[parameter.name]:.2g} {parameter.unit}"


def _gain(name: str, inputs: ji.Log) -> np.ndarray:
    """Squared distance (strengths,), in standard deviations of the camera, between the poses with an effect and the
    nearest ones of a nominal robot: the best test of this effect goes by it.

    As in `diagnose`, poses are compared within windows that start anew, so that a gap does not add up.
    """
    vectors = jnp.stack([to_vector([ji.Effect(name, _sized(name, float(s)))]) for s in STRENGTHS])
    robot = _nominal()
    starts, drives = (np.asarray(part) for part in _nominal_columns(robot, inputs))
    away = np.asarray(_with_effects(vectors, robot, inputs)) - np.asarray(_relative(robot, inputs))
    away, drives = (part - (part @ starts) @ starts.swapaxes(1, 2) for part in (away.swapaxes(0, 1), drives))
    basis = np.linalg.qr(np.concatenate(drives, axis=1).T)[0]
    away = np.concatenate(away, axis=1)  # (strengths, poses)
    return np.sum((away - (away @ basis) @ basis.T) ** 2, axis=1)


def _sized(name: str, strength: float) -> dict:
    """An effect's parameters at a strength; what happens at an instant happens in the middle of the run."""
    record = CATALOGUE[name]
    middle = {one.name: 0.5 * PERIOD * SEEN_ROWS for one in record.parameters if one.instant}
    return sized(record, strength) | middle


def _nominal() -> jax.Array:
    """Rates, gains and dead zones (8,) of the robot."""
    robot = plain_robot()
    return jnp.concatenate([jnp.ravel(jnp.asarray(part)) for part in (*robot.physical[:2], robot.dead_zone)])


@jax.jit
def _nominal_columns(robot: jax.Array, inputs: ji.Log) -> tuple[jax.Array, jax.Array]:
    """How the white poses of each window change with its start state: orthonormal (windows, poses, 5); and with rates,
    gains and dead zones (windows, 8, poses)."""
    t, u_r, u_l = (jnp.reshape(column, (-1, WINDOW)) for column in (inputs.t, inputs.u_r, inputs.u_l))

    def window(start, t, u_r, u_l):
        return _white(_run(robot, inputs._replace(t=t, u_r=u_r, u_l=u_l), None, State(*start)))

    pose = _run(robot, inputs, None)
    x, y, turn = (jnp.gradient(column, PERIOD)[::WINDOW] for column in pose)
    speed = x * jnp.cos(pose.theta[::WINDOW]) + y * jnp.sin(pose.theta[::WINDOW])
    starts = jnp.stack([*3 * (0.0 * speed,), speed, turn], axis=1)
    columns = jax.vmap(jax.jacfwd(window))(starts, t, u_r, u_l)
    drives = jax.jacfwd(_relative)(robot, inputs)
    return jnp.linalg.qr(columns)[0], drives.swapaxes(1, 2)


def _run(robot: jax.Array, inputs: ji.Log, vector: jax.Array | None, start: State = REST) -> Pose:
    """Poses of a robot with the effects of a vector, or without any."""
    drive = ji.Physical(robot[:2], robot[2:6].reshape(2, 2), None)
    parts = frozenset() if vector is None else frozenset(CATALOGUE)
    vector = to_vector([]) if vector is None else vector
    return run_full(drive, robot[6:8], vector, jnp.asarray(inputs.t), inputs.command, start, parts=parts)


def _relative(robot: jax.Array, inputs: ji.Log, vector: jax.Array | None = None) -> jax.Array:
    """White poses (windows, 3 rows) of each window, as seen from its first pose."""
    x, y, theta = (jnp.reshape(column, (-1, WINDOW)) for column in _run(robot, inputs, vector))
    c, s = jnp.cos(theta[:, :1]), jnp.sin(theta[:, :1])
    x, y = x - x[:, :1], y - y[:, :1]
    return jax.vmap(_white)(Pose(c * x + s * y, c * y - s * x, theta - theta[:, :1]))


def _white(pose: Pose) -> jax.Array:
    """Poses (3 rows,) over the standard deviations of the camera's noise."""
    return jnp.concatenate([pose.x / CAMERA.position, pose.y / CAMERA.position, pose.theta / CAMERA.heading])


@jax.jit
def _with_effects(vectors: jax.Array, robot: jax.Array, inputs: ji.Log) -> jax.Array:
    """White poses (vectors, windows, 3 rows) for each vector of effects."""
    return jax.vmap(lambda vector: _relative(robot, inputs, vector))(vectors)
