"""Effects that no catalogue lists: where each acts, and the parameters of the later ones from a strength."""

import numpy as np

SITES = {
    "cubic_input": ("actuation",),
    "cross_drag": ("drive",),
    "wheel_eccentricity": ("drive", "contact"),
    "rough_patch": ("drive", "contact"),
    "motor_heating": ("actuation", "drive", "time"),
    "tether": ("drive", "contact"),
    "heading_bias": ("camera",),
}
"""Where each of the first effects acts; several where the word is a matter of taste. Sets are drawn from this list in
this order, so it stays as it is."""
LATER_SITES = {
    "castor_kick": ("drive", "contact"),
    "bumps": ("drive", "contact"),
    "cogging": ("actuation", "drive"),
    "speed_dependent_delay": ("actuation",),
    "weak_braking": ("actuation", "drive"),
    "gusts": ("drive", "contact", "time"),
}
"""The same of effects that no set before `sealed_second` has."""


def _along(robot: dict) -> float:
    """Acceleration at full command [m/s^2]."""
    return robot["rate"][0] * robot["speed"][0]


def _heading(robot: dict) -> float:
    """The same in heading [rad/s^2]."""
    return robot["rate"][1] * robot["speed"][1]


def _bumps(rng, f, robot, *_):
    v, w = robot["speed"]
    return {"rate": rng.uniform(0.3, 1.0), "along": 0.4 * f * v, "heading": 0.4 * f * w}


def _gusts(rng, f, robot, *_):
    angles = dict(zip(("direction", "phase"), rng.uniform(-np.pi, np.pi, 2), strict=True))
    return {"acceleration": 0.4 * f * _along(robot), "every": rng.uniform(2.0, 8.0)} | angles


LATER_LAWS = {
    "castor_kick": lambda rng, f, robot, *_: {
        "kick": 0.5 * f * _heading(robot) * rng.choice([-1, 1]),
        "fade": rng.uniform(0.1, 0.3),
    },
    "bumps": _bumps,
    "cogging": lambda rng, f, *_: {
        "right": 0.3 * f * rng.uniform(0.6, 1.0),
        "left": 0.3 * f * rng.uniform(0.6, 1.0),
        "turns": rng.uniform(6.0, 20.0),
    },
    "speed_dependent_delay": lambda rng, f, *_: {"delay": 0.25 * f},
    "weak_braking": lambda rng, f, *_: {"loss": f},
    "gusts": _gusts,
}
"""As `robots.LAWS`."""
