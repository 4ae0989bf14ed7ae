"""The slow way to (21): SciPy's Nelder-Mead on all twelve numbers, in NumPy alone, and random records to try it on."""

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter

POLE_LIMIT = 1.0 - 1e-6


def unpack(vector, d_max):
    """Twelve numbers as alpha, delta, epsilon, dead zones; the dead zones and nothing else moved into their box."""
    return vector[:2], vector[2:6].reshape(2, 2), vector[6:10].reshape(2, 2), np.clip(vector[10:], 0.0, d_max)


def passed(u, width):
    return np.sign(u) * np.maximum(np.abs(u) - width, 0.0)


def one_step_cost(observations, weight, d_max):
    """(21) with the measured increment on the right, as a function of the twelve numbers."""
    o = observations
    seen_before = np.concatenate([[False], o.seen[:-1]])
    single = o.measured & (o.first | seen_before)
    use = np.flatnonzero(single[1:] & single[:-1] & ~o.first[1:]) + 1
    target = np.stack(o.increment)[:, use]
    past = np.stack(o.increment)[:, use - 1]
    now, before = np.stack(o.command)[:, use], np.stack(o.command)[:, use - 1]
    scale = np.array(weight)[:, None]

    def cost(vector):
        alpha, delta, epsilon, width = unpack(vector, d_max)
        model = alpha[:, None] * past + delta @ passed(now, width[:, None]) - epsilon @ passed(before, width[:, None])
        return np.sum(((target - model) / scale) ** 2)

    return cost


def free_run_cost(observations, weight, d_max):
    """(21) with the model's own last increment on the right, each run's start increment solved for."""
    o = observations
    firsts = np.flatnonzero(o.first)
    pieces = [_run_cost(o, a, b, weight) for a, b in zip(firsts, [*firsts[1:], len(o.first)], strict=True)]

    def cost(vector):
        alpha, delta, epsilon, width = unpack(vector, d_max)
        return sum(piece(np.clip(alpha, -POLE_LIMIT, POLE_LIMIT), delta, epsilon, width) for piece in pieces)

    return cost


def _run_cost(o, begin, end, weight):
    inside = np.asarray(o.inside[begin:end])
    command = np.stack(o.command)[:, begin:end][:, inside]
    measured = np.flatnonzero(o.measured[begin:end][inside])
    target = np.stack(o.increment)[:, begin:end][:, inside][:, measured]
    poses = np.concatenate([[begin == 0 or o.seen[begin - 1]], o.seen[begin:end][inside]])
    if begin == 0:
        poses[0] = o.measured[0] or not o.seen[0]
    rows = np.flatnonzero(poses)
    edges = np.searchsorted(rows, measured + 1)

    def cost(alpha, delta, epsilon, width):
        m = passed(command, width[:, None])
        forced = delta @ m
        forced[:, 1:] -= epsilon @ m[:, :-1]
        forced[:, 0] = 0.0
        impulse = np.zeros(command.shape[1])
        impulse[0] = 1.0
        total = 0.0
        for c in range(2):
            responses = lfilter([1.0], [1.0, -alpha[c]], np.stack([forced[c], impulse]))
            sums = np.concatenate([np.zeros((2, 1)), np.cumsum(responses, axis=1)], axis=1)
            model, start = sums[:, rows[edges]] - sums[:, rows[edges - 1]]
            left = target[c] - model
            energy = start @ start
            if energy > 0.0:
                left = left - start * (start @ left / energy)
            total += left @ left / weight[c] ** 2
        return total

    return cost


COSTS = {"one_step": one_step_cost, "free_run": free_run_cost}


def nelder_mead(cost, start, evaluations):
    """The lowest cost that Nelder-Mead finds on the twelve numbers, each in units of its start value."""
    scale = np.where(start != 0.0, start, 1.0)
    found = minimize(
        lambda x: cost(x * scale), start / scale, method="Nelder-Mead",
        options={"maxfev": evaluations, "maxiter": evaluations, "xatol": 1e-10, "fatol": 1e-10, "adaptive": True},
    )  # fmt: skip
    return found.fun, found.x * scale
