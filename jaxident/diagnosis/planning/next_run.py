"""The next run: of many inputs within a limit, the one whose answer best separates two effects.

Separation of A and B: with data of a robot that has A, by how much -log p of the best B exceeds that of A; or the other
way round, whichever is less. To first order it is half the squares, in units of the noise, of what the change that A
makes leaves when start states, nominal parameters and B are fitted to it (T-optimality: Atkinson and Fedorov 1975,
Biometrika 62). The first order overrates what changed parameters make good: full refits of a delay and a lag
were found to separate several times more. The same windows as in a diagnosis; NumPy around the compiled follower.
"""

from typing import NamedTuple

import jax
import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.motion.linear import START_STATES, follow, gram, left_over, linearise
from jaxident.diagnosis.motion.paths import track
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.motion.windows import Windows, cut, obeying_laws, uncut
from jaxident.diagnosis.noise.law import whitener_of
from jaxident.diagnosis.planning.question import Question, ask, check_names, expected_size, noise_of
from jaxident.diagnosis.planning.trial_inputs import ORDINARY, draw, make, vary
from jaxident.effects.coordinates import NOMINAL
from jaxident.effects.law_kinds import check_discovered
from jaxident.log import Log, make_log
from jaxident.numerics import require_float64
from jaxident.robot.model import Model
from jaxident.robot.noise import Noise

TOGETHER = 8
"""Inputs that one call follows: one shape of the compiled program for all."""
KEPT = 8
"""Best inputs from which new ones are made."""


class Plan(NamedTuple):
    """An input for the next run, and what it is worth.

    Attributes:
        log: the input, a log without poses.
        before: separation of ordinary inputs as long, their median [log-likelihood].
        after: separation of this input [log-likelihood].
        sizes: of both effects, by parameter.
        noise: that the separation is computed for.
        assumed: whether the camera noise is not all the model's.
        area: width and height of the path without the effects [m].
        ordinary: what ordinary inputs are.
    """

    log: Log
    before: float
    after: float
    sizes: dict[str, dict[str, float]]
    noise: Noise
    assumed: bool
    area: tuple[float, float]
    ordinary: str = f"median of {TOGETHER} inputs `{ORDINARY[0]}` held {ORDINARY[1]} samples, as long"


def plan(
    model: Model, effects: tuple[str, str], *, samples: int = 600, limit: float = 1.0, seed: int = 0, batches: int = 40
) -> Plan:
    """Plan the input for the next run: the one that best separates two effects, from rest.

    Separation of A and B: with data of a robot that has A, by how much -log p of the best B exceeds that of A, or the
    other way round, whichever is less (T-optimality: Atkinson and Fedorov 1975, Biometrika 62). It is computed to first
    order, which overrates it where changed parameters make up for an effect. In the first half of the batches inputs
    are drawn, then new ones are made from the best. The same seed gives the same plan. Needs double precision.

    Args:
        model: the robot. Its other effects and its discovered laws act throughout.
        effects: names of the two effects. Each has the size that the model gives it, otherwise the catalogue's typical
            one, with the limit as the unit of the command.
        samples: rows of the input.
        limit: largest command, |u| <= limit [unit of the command].
        seed: of the draws.
        batches: how many times 8 inputs are tried.

    Returns:
        Plan: the input as a log without poses, the separation of ordinary inputs and of this one, the room it needs
            [m].

    Raises:
        InputError: names that cannot be separated, a model of free numerators, a limit inside the dead zones, too few
            samples.

    Examples:
        >>> import jaxident as ji
        >>> ji.start_jax()
        >>> found = ji.plan(ji.load_model("published"), ("transport_delay", "motor_lag"), samples=300, batches=2)
        >>> len(found.log.t), bool(found.after > found.before)
        (300, True)
    """
    require_float64("plan")
    check_names(effects)
    check_discovered(model.discovered)
    noise, assumed = noise_of(model)
    sizes = {name: expected_size(model, name, limit, samples) for name in effects}
    question = ask(model, effects, sizes, noise, samples, limit)
    rng = np.random.default_rng(seed)
    kind, hold = ORDINARY
    pool = [make(rng, kind, samples, hold) for _ in range(TOGETHER)]
    values = separations(question, np.stack(pool))
    before = float(np.median(values))
    for batch in range(batches):
        period = question.period
        if 2 * batch < batches:
            tried = [draw(rng, samples, period) for _ in range(TOGETHER)]
        else:
            tried = [vary(rng, pool[k], pool[rng.integers(len(pool))], period) for k in range(len(pool))]
        both, found = [*pool, *tried], np.concatenate([values, separations(question, np.stack(tried))])
        best = np.argsort(-found, kind="stable")[:KEPT]
        pool, values = [both[k] for k in best], found[best]
    command = limit * pool[0]
    path = _paths(question, uncut(np.stack(pool), question.period))
    area = (float(np.ptp(path[0, :, 0])), float(np.ptp(path[1, :, 0])))
    log = make_log(question.period * np.arange(samples), command[:, 0], command[:, 1])
    return Plan(log, before, float(values[0]), sizes, noise, assumed, area)


def separations(question: Question, commands: Array) -> np.ndarray:
    """The separation (inputs,) that each of some commands (inputs, samples, 2) over the limit would give."""
    count, samples, _ = commands.shape
    states = _paths(question, uncut(commands, question.period))
    x, y, theta = (states[k].T.ravel() for k in range(3))
    t, run = np.tile(question.period * np.arange(samples), count), np.repeat(np.arange(count), samples)
    right, left = commands.reshape(-1, 2).T
    log = make_log(t, right, left, x, y, theta, run)
    windows = obeying_laws(cut(log, question.rows)._replace(session=np.zeros(count)), question.laws)
    starts = states[:, windows.first, windows.run]
    linear = linearise(question.base, starts, windows, list(range(len(NOMINAL))))
    lanes = np.broadcast_to(starts, (len(question.vectors), *starts.shape))
    moved = follow(question.vectors, lanes, windows)
    columns = np.concatenate([linear.slopes, np.moveaxis(linear.residual - moved, 0, -1)], axis=2)
    products = gram(_whitener(question, linear.residual, windows), columns, linear.starts).products
    return np.array([_separation(question, products[windows.run == run].sum(axis=0)) for run in range(count)])


def _separation(question: Question, products: Array) -> float:
    """The less of both: what B leaves of A, and A of B."""
    nominal = list(range(len(NOMINAL)))
    left = []
    for expected, rays in zip(question.expected, question.rays[::-1], strict=True):
        for ray in rays:
            order = [*nominal, *(len(nominal) + place for place in (*ray, expected))]
            left.append(left_over(products[np.ix_(order, order)], list(range(len(order) - 1))))
    return max(min(left), 0.0)


def _whitener(question: Question, residual: Array, windows: Windows) -> np.ndarray:
    """Of the noise law; the same for all windows where it is white."""
    law = question.law
    if law.slip is None and law.coloured is None:
        camera = np.array([law.position, law.position, law.heading])
        return np.diag(np.tile(1.0 / camera, question.rows))[None]
    return whitener_of(law, windows, respond(np.exp(question.base[:2]), residual, windows))


_track = jax.jit(track)


def _paths(question: Question, whole: Windows) -> np.ndarray:
    """States (5, samples, inputs) of the robot without the two effects, from rest at the origin."""
    return np.stack(_track(question.base, np.zeros((START_STATES, len(whole.run))), obeying_laws(whole, question.laws)))
