"""Later effects that no catalogue lists, in plain NumPy, one column per run.

Each is in the parameters `p` only where some run has it: what has none of them is simulated as before.
"""

import numpy as np

from .commands import pair

LATER: dict[str, dict[str, float]] = {
    "castor_kick": {"kick": 0.0, "fade": 0.2},  # w' += c s exp(-t / fade), t since v turned to the sign s
    "bumps": {"rate": 0.0, "along": 0.0, "heading": 0.0},  # jumps of v and w, normal, `rate` a second by chance
    "cogging": {"right": 0.0, "left": 0.0, "turns": 0.0},  # each wheel's push loses c sin(its angle)
    "speed_dependent_delay": {"delay": 0.0},  # commands are late by d |v| / fastest v
    "weak_braking": {"loss": 0.0},  # a push against its wheel's speed is (1 - c) as large
    "gusts": {"acceleration": 0.0, "direction": 0.0, "every": 1.0, "phase": 0.0},  # a fan that swells and fades
}
MEMORY = ("cog", "castor")
"""Angles of both wheels; what is left of the castors' kick, and the last sign of v."""
MOVING = 0.01
"""Part of the fastest v below which v has no sign: a robot at rest does not turn round."""
CALM = 0.05
"""Part of the fastest wheel speed over which braking sets in."""


def bumped(p, period, shoves, rngs):
    """Random accelerations (rows, runs, 2) with bumps, each a jump of the speeds within one row."""
    if "bumps" not in p or rngs is None:
        return shoves
    shoves = np.array(shoves)
    law = p["bumps"]
    for run in np.flatnonzero(law["rate"]):
        hit = rngs[run].random(len(shoves)) < law["rate"][run] * period[run]
        jump = rngs[run].normal(size=(len(shoves), 2)) * [law["along"][run], law["heading"][run]]
        shoves[:, run] += hit[:, None] * jump / period[run]
    return shoves


def later(p, robot, state, period):
    """Further delay of the commands in rows (runs,)."""
    if "speed_dependent_delay" not in p:
        return 0.0
    return p["speed_dependent_delay"]["delay"] / period * np.abs(state[3]) / robot["top"][:, 0]


def braked(p, robot, state, drive):
    """The push (runs, 2) of motors that brake badly."""
    if "weak_braking" not in p:
        return drive
    n = np.einsum("nij,jn->ni", robot["to_n"], state[3:])
    against = np.clip(-np.sign(drive) * n / CALM, 0.0, 1.0)
    return drive * (1.0 - p["weak_braking"]["loss"][:, None] * against)


def shoved(p, robot, memory, state, light, time):
    """Further accelerations (runs, 2), held over a substep; light (runs,): inverse of the robot's inertia."""
    found = np.zeros((len(light), 2))
    if "castor_kick" in p:
        found[:, 1] += p["castor_kick"]["kick"] * memory["castor"][:, 0]
    if "cogging" in p:
        lost = pair(p["cogging"]) * np.sin(memory["cog"])
        found -= np.einsum("nij,nj->ni", robot["gain"], lost) * light[:, None]
    if "gusts" in p:
        law = p["gusts"]
        swell = law["acceleration"] * np.sin(2.0 * np.pi * time / law["every"] + law["phase"])
        found[:, 0] += swell * np.cos(state[2] - law["direction"])
    return found


def remember(p, robot, memory, new, h):
    """Angles and castors at the end of a substep, in the memory."""
    if "cogging" in p:
        n = np.einsum("nij,jn->ni", robot["to_n"], new[3:])
        memory["cog"] = memory["cog"] + p["cogging"]["turns"][:, None] * n * h[:, None]
    if "castor_kick" in p:
        left, sign = memory["castor"].T
        now = np.where(np.abs(new[3]) > MOVING * robot["top"][:, 0], np.sign(new[3]), sign)
        left = np.where(now * sign < 0, now, left * np.exp(-h / p["castor_kick"]["fade"]))
        memory["castor"] = np.stack([left, now], axis=1)
