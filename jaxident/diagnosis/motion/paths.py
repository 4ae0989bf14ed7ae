"""Poses of windows under the nominal robot and any effects: one compiled program for all of them."""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, State, Wheels
from jaxident.diagnosis.motion.windows import Windows
from jaxident.effects.coordinates import by_effect
from jaxident.effects.discovered import with_laws
from jaxident.effects.fast_input import SUBSTEPS, Acts, Push, pushes
from jaxident.effects.fast_motion import Row, advance_row, drive_of, lags_of, report, rolling
from jaxident.effects.law_arrays import Laws
from jaxident.effects.past import Past, past_of
from jaxident.numerics import wrap
from jaxident.robot.drive import rim_motion


def residuals(vector: Array, starts: Array, push: Push, windows: Windows) -> Array:
    """Measured minus modelled poses (rows, windows, 3), 0 where unseen; starts (5, windows) of the robot itself, and
    what `push_of` says drives its wheels."""
    states = move(vector, starts, push, windows)
    return compare(report(with_laws(by_effect(vector), windows.laws), *states.pose), windows)


def compare(pose: Pose, windows: Windows) -> Array:
    """Measured minus modelled poses (rows, windows, 3), the heading wrapped, 0 where unseen."""
    x, y, theta = (windows.pose[..., k] - modelled for k, modelled in enumerate(pose))
    return jnp.where(windows.seen[..., None], jnp.stack([x, y, wrap(theta)], axis=-1), 0.0)


def track(vector: Array, starts: Array, windows: Windows) -> State:
    """True states (rows, windows) from starts (5, windows)."""
    return move(vector, starts, push_of(vector, windows), windows)


def push_of(vector: Array, windows: Windows, acts: Acts | None = None) -> Push:
    """What drives the wheels: pushes of whole runs cut into windows, (rows, substeps, 2, windows)."""
    runs = windows.t, windows.session, windows.command
    push = pushes(by_effect(vector), drive_of(vector), vector[6:8], *runs, acts)
    rows = windows.step.shape[0]
    places = jnp.minimum(windows.first + jnp.arange(rows)[:, None], push.mean.shape[0] - 1)
    return Push(*(part[places, windows.run].transpose(0, 2, 3, 1) for part in push))


def move(vector: Array, starts: Array, push: Push, windows: Windows) -> State:
    """True states (rows, windows) under pushes (rows, substeps, 2, windows)."""
    return _moved(vector, starts, push, windows)[0]


def rolled(vector: Array, starts: Array, push: Push, windows: Windows) -> tuple[Array, Array]:
    """Speed [m/s] and turn rate [rad/s] (rows, windows) that the rims of both wheels have: those of the robot, and what
    wheels that slide turn faster than the ground."""
    states, excess = _moved(vector, starts, push, windows)
    return rim_motion(drive_of(vector), states.v, states.w, Wheels(sum(excess[0::2]), sum(excess[1::2])))


def left_behind(windows: Windows) -> Past:
    """What the commands left behind at each row of the windows (rows, ..., windows)."""
    places = jnp.minimum(windows.first + jnp.arange(len(windows.step))[:, None], len(windows.t) - 1)
    past = past_of(windows.t, windows.command)
    return Past(*(jnp.moveaxis(part, -1, 1)[places, windows.run].transpose(0, 2, 3, 1) for part in past))


def _moved(vector: Array, starts: Array, push: Push, windows: Windows) -> tuple[State, list]:
    """True states, and by how much each wheel turns faster than the ground [unit]."""
    settings, drive, part = with_laws(by_effect(vector), windows.laws), drive_of(vector), windows.step / SUBSTEPS
    time = windows.session[windows.run] + windows.t[windows.first, windows.run]
    begin = time + jnp.cumsum(windows.step, axis=0) - windows.step

    def body(carry, row):
        state, wheels = carry
        return advance_row(settings, drive, state, wheels, row), (state, wheels.excess)

    past = None if windows.laws is None else left_behind(windows)
    rows = Row(push.mean, push.slope, part, lags_of(drive, part), begin, past)
    return jax.lax.scan(body, (State(*starts), rolling(starts[0], first_angles(windows))), rows)[1]


def first_angles(windows: Windows) -> Array | None:
    """The angles (laws, windows) of the wheels that laws go by in the first row of each window; None without laws."""
    if windows.laws is None:
        return None
    laws: Laws = windows.laws
    return laws.phase + laws.per_way @ windows.way
