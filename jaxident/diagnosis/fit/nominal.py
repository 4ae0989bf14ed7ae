"""The nominal fit that a search for effects begins from.

Where an effect is large, the first fit may end in a wrong valley. On half a log of a Create, whose speed falls by 40 %
in turns, the starter found a robot that hardly answers its commands. Under noise that has slip, 60 steps did not leave
that valley. So a second fit begins at a robot that follows its commands. The lower valley is taken. That was
measured on gains as they are. On those of a typical robot (`coordinates.pace`) both fits end alike on nine of ten
halves of Creates' logs. On the tenth the second ends 244 lower.

The lower valley may be a robot that coasts. A Husky's poses asked for a rate of 0.08 1/s: this fits the log better by
23 in log p, and misses the next log by 1.2 m in 1 s. With the rates held it misses it by 0.25 m.
"""

import jax
import jax.numpy as jnp
import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.prior import HOLDS, MIDDLE
from jaxident.diagnosis.fit.refit import Data, Solution, refit
from jaxident.diagnosis.motion.linear import START_STATES
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.motion.windows import Piece, Windows
from jaxident.diagnosis.noise.law import Law, first_law, white_whitener, whitener_of
from jaxident.diagnosis.noise.sizing import size_noise
from jaxident.effects.coordinates import NOMINAL, natural, natural_deviations, neutral_vector, nominal_vector
from jaxident.errors import InputError
from jaxident.estimation.poses.maximum_likelihood import begin
from jaxident.estimation.poses.noise_law import CLEAR
from jaxident.estimation.poses.prior import SIGNS, coasting
from jaxident.estimation.poses.runs import stack_runs, with_room
from jaxident.log import Log, join
from jaxident.robot.drive import Physical

SETTLES = 4.0
"""Time constants within a window of the robot that follows its commands: it has settled at the end of one. No other
number was tried."""
STEPS = 60
"""Of each of the two fits: of twenty to halves of Creates' logs the longest needed 28."""
BETTER = 1.0
"""Fall of -log p beyond which another valley is taken: less is no difference: a refit ends where a
step promises less than 0.05."""


def starting_point(log: Log, pieces: list[Piece]) -> np.ndarray:
    """The nominal coordinates (10,) that the starter of the likelihood finds in some pieces."""
    runs = log.runs()
    own = join([runs[piece.run].rows(piece.first, piece.last) for piece in pieces])
    found = begin(jax.tree.map(jnp.asarray, with_room(stack_runs(own))), jnp.asarray(0.9)).estimate
    drive = Physical(np.asarray(found.rate), np.asarray(found.gain))
    point = nominal_vector(drive, np.asarray(found.dead_zone))
    if not np.all(np.isfinite(point)) or abs(np.linalg.det(np.asarray(found.gain))) < 1e-9:
        raise InputError("the log does not determine a nominal model: drive both wheels, at several levels")
    return point


def rough_fit(windows: Windows, vector: Array, law: Law | None = None) -> Solution:
    """The nominal fit for white camera noise, of a law or as fourth differences size it."""
    law = first_law(windows) if law is None else law
    return refit(Data(windows, white_whitener(law, windows)), vector, first_starts(windows), (), most=6)


def steady_point(windows: Windows) -> np.ndarray:
    """The nominal coordinates (10,) of a robot whose steady speeds answer the commands as the windows' mean speeds do,
    without dead zones."""
    speeds, commands = [], []
    for window in range(len(windows.run)):
        rows = np.flatnonzero(windows.seen[:, window])
        x, y, theta = windows.pose[rows, window].T
        theta, inside = np.unwrap(theta), slice(rows[0], rows[-1])
        middle = 0.5 * (theta[1:] + theta[:-1])
        along = np.sum(np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle))
        step = windows.step[inside, window]
        sent = windows.command[windows.first[window] :, windows.run[window]][inside]
        speeds.append(np.array([along, theta[-1] - theta[0]]) / step.sum())
        commands.append(step @ np.nan_to_num(sent) / step.sum())
    answers = np.linalg.lstsq(np.array(commands), np.array(speeds), rcond=None)[0].T
    held, free = windows.held[:2], SETTLES / float(np.median(windows.step.sum(axis=0)))
    rate = np.where(np.isfinite(held), np.exp(np.nan_to_num(held)), free)
    return nominal_vector(Physical(rate, rate[:, None] * answers), np.zeros(2))


def coasts(fit: Solution, windows: Windows, unexplained: bool) -> np.ndarray:
    """Which speeds (2,) of a fit coast: at a rate below that of nearly all robots, too slow to settle within a window,
    and either beside something that has no name or by gains whose signs are not clearly a differential drive's. Wheel
    speeds show how a robot answers: beside them no rate is doubted."""
    if windows.wheels is not None:
        return np.zeros(2, bool)
    rate, gain = np.exp(fit.vector[:2]), natural(fit.vector)[2:6].reshape(2, 2)
    deviation = natural_deviations(fit.vector, fit.covariance)[2:6].reshape(2, 2)
    signs = np.sign(gain[:, 0] * gain[:, 1]) == np.prod(SIGNS, axis=1)
    driven = signs & np.all(np.abs(gain) > CLEAR * deviation, axis=1)
    return coasting(rate, float(np.max(windows.step.sum(axis=0))), driven, unexplained)


def fit_without_effects(data: Data, nominal: Solution, fit: Solution, unexplained: bool) -> Solution:
    """The fit without effects, from where another one without stands. Where it coasts for want of the effects, and the
    `fit` with these does not, it has the rates and couplings of that: a robot that coasts predicts nothing."""
    bare = refit(data, nominal.vector, nominal.starts, ())
    which = coasts(bare, data.windows, unexplained) & ~coasts(fit, data.windows, unexplained)
    if not np.any(which):
        return bare
    vector = neutral_vector(fit.vector[: len(NOMINAL)])
    held = data._replace(windows=_held_at(vector[HOLDS], which, data.windows))
    return refit(held, vector, nominal.starts, ())


def hold_rates(windows: Windows, which: Array, told: Array | None) -> tuple[Windows, Solution]:
    """The windows with some rates (2,) and both couplings held, and the nominal fit to them. told (10,): coordinates of
    a given nominal model, where they are held then."""
    windows = _held_at(MIDDLE if told is None else np.asarray(told)[HOLDS], which, windows)
    return windows, lower_valley(rough_fit(windows, neutral_vector(steady_point(windows))), windows)


def _held_at(middle: Array, which: Array, windows: Windows) -> Windows:
    """The windows with some rates (2,) and both couplings held where `middle` (4,) has them."""
    return windows._replace(held=np.where([*which, True, True], middle, windows.held))


def lower_valley(fit: Solution, windows: Windows) -> Solution:
    """The nominal fit under noise that has slip, from where another fit stands, or from a robot that follows its
    commands if that ends in a lower valley. Under white noise two halves of Creates' logs ended in the wrong one."""
    responses = respond(np.exp(fit.vector[:2]), fit.linear.residual, windows)
    law = size_noise(fit.linear.residual, fit.linear.starts, windows, responses)
    data = Data(windows, whitener_of(law, windows, responses))
    here = refit(data, fit.vector, fit.starts, (), most=STEPS)
    other = refit(data, neutral_vector(steady_point(windows)), first_starts(windows), (), most=STEPS)
    return other if other.cost < here.cost - BETTER else fit


def first_starts(windows: Windows) -> np.ndarray:
    """Start states (5, windows) from the first poses seen in each window."""
    pose, seen = np.asarray(windows.pose), np.asarray(windows.seen)
    starts = np.zeros((START_STATES, pose.shape[1]))
    time = np.cumsum(windows.step, axis=0) - windows.step
    for window in range(pose.shape[1]):
        rows = np.flatnonzero(seen[:, window])[:8]
        x, y, theta = pose[rows, window].T
        theta = np.unwrap(theta)
        passed = time[rows[-1], window] - time[rows[0], window]
        middle = theta[len(rows) // 2]
        v = ((x[-1] - x[0]) * np.cos(middle) + (y[-1] - y[0]) * np.sin(middle)) / passed
        w = (theta[-1] - theta[0]) / passed
        starts[:, window] = x[0], y[0], theta[0], v, w
    return starts
