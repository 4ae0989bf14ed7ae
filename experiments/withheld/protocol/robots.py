"""What is drawn for a case of the batched generator: the robot, its inputs, its noise and its hidden effects.

`strength` F in (0, 1) says how large an effect is beside the robot's own forces, commands and times: 0.1 is faint,
0.6 is strong. Each law below turns it into parameters for one robot.
"""

import numpy as np

from .outside import LATER_LAWS

PERIODS = (0.02, 1.0 / 30.0, 0.04)
FAINT, STRONG = 0.12, 0.7


def draw_robot(rng) -> dict:
    """A robot with up to 15 % between its wheels; top speeds at full command in `speed`."""
    v, w = rng.uniform(0.15, 0.5), rng.uniform(3.0, 9.0)
    rate = np.array([rng.uniform(0.6, 5.0), rng.uniform(3.0, 9.0)])
    skew = rng.uniform(-0.15, 0.15, 2)
    gain = 0.5 * np.array([[1.0 + skew[0], 1.0 - skew[0]], [1.0 + skew[1], -1.0 + skew[1]]]) * (rate * [v, w])[:, None]
    coupling = rng.uniform(-0.1, 0.1, 2) * [rate[0] * v / w, rate[1] * w / v] if rng.random() < 0.5 else np.zeros(2)
    return {
        "rate": rate.tolist(),
        "gain": gain.tolist(),
        "coupling": coupling.tolist(),
        "dead_zone": rng.uniform(0.05, 0.25, 2).tolist(),
        "speed": [v, w],
    }


def near(robot: dict, rng) -> dict:
    """A robot whose gains and rates are up to 8 % off: the simulator of an owner who measured badly."""
    off = {key: np.array(robot[key]) * (1.0 + rng.uniform(-0.08, 0.08, np.shape(robot[key]))) for key in robot}
    return {key: value.tolist() for key, value in off.items()}


def draw_commands(rng, rows: int, kind: str = "multilevel") -> np.ndarray:
    """Commands (rows, 2) in [-1, 1]: signed levels held 4 to 25 rows, some of them at rest; or two forward levels."""
    if kind == "forward":
        low, high = np.sort(rng.uniform(0.4, 0.9, 2))
        return np.stack([hold(rng, rows, lambda: rng.choice([low, high])) for _ in range(2)], axis=1)
    wild = hold(rng, rows, lambda: rng.uniform(-1.0, 1.0, 2) * (rng.random() > 0.12))
    alike = hold(rng, rows, lambda: rng.random() < 0.35)
    wild[:, 1] = np.where(alike, wild[:, 0] + 0.1 * wild[:, 1], wild[:, 1])  # else the robot only spins
    return np.round(np.clip(wild, -1.0, 1.0), 3)


def hold(rng, rows, level) -> np.ndarray:
    """Levels drawn by `level()`, each held 4 to 25 rows."""
    held = []
    while len(held) < rows:
        held += [level()] * int(rng.integers(4, 26))
    return np.array(held[:rows])


def draw_noise(rng) -> dict:
    """White camera error: 0.2 to 1 mm, and the heading of a marker of 10 to 20 cm."""
    position = np.exp(rng.uniform(np.log(2e-4), np.log(1e-3)))
    return {"position": position, "heading": position / rng.uniform(0.1, 0.2)}


def draw_slip(rng, robot: dict) -> dict:
    """Random slip: acceleration of 0.2 to 1 % of full drive, correlated over a tenth of a second or so."""
    full = np.abs(np.array(robot["gain"])).sum(axis=1)
    along, heading = np.exp(rng.uniform(np.log(0.002), np.log(0.01), 2)) * full
    return {"along": along, "heading": heading, "correlation_time": rng.uniform(0.05, 0.3)}


def slip_series(rng, slip: dict | None, rows: int, period: float) -> np.ndarray:
    """Accelerations (rows, 2): first-order autoregressions."""
    if slip is None:
        return np.zeros((rows, 2))
    kept, series = np.exp(-period / slip["correlation_time"]), rng.normal(size=(rows, 2))
    for row in range(1, rows):
        series[row] = kept * series[row - 1] + np.sqrt(1.0 - kept**2) * series[row]
    return series * [slip["along"], slip["heading"]]


def draw_strength(rng) -> float:
    """Log-uniform from faint to strong."""
    return float(np.exp(rng.uniform(np.log(FAINT), np.log(STRONG))))


def draw_effect(rng, name: str, strength: float, robot: dict, noise: dict, session: float) -> dict:
    """Parameters of an effect at this strength for this robot; session [s] is the duration of all runs."""
    law = LAWS[name](rng, strength, robot, noise, session)
    return {key: float(value) for key, value in law.items()}


def _wheels(size, low=0.6):
    def law(rng, f, *_):
        return {"right": size * f * rng.uniform(low, 1.0), "left": size * f * rng.uniform(low, 1.0)}

    return law


def _signed(size):
    def law(rng, f, *_):
        return {side: size * f * rng.choice([-1, 1]) * rng.uniform(0.4, 1.0) for side in ("right", "left")}

    return law


def _one(key, size, signed=False):
    return lambda rng, f, *_: {key: size * f * (rng.choice([-1, 1]) if signed else 1)}


def _full(robot):
    """Accelerations at full command, and top speeds."""
    (v, w), rate = robot["speed"], robot["rate"]
    return rate[0] * v, rate[1] * w, v, w


def _drag(rng, f, robot, *_):
    along, heading, v, w = _full(robot)
    return {"along": f * along / v**2, "heading": rng.uniform(0.3, 1.0) * f * heading / w**2}


def _mass(rng, f, robot, *_):
    along, heading, v, w = _full(robot)
    sign = rng.choice([-1, 1])
    return {"along": sign * 0.3 * f * along / w**2, "heading": sign * 0.5 * f * heading / (v * w)}


def _slope(rng, f, robot, *_):
    return {"acceleration": 0.4 * f * _full(robot)[0], "direction": rng.uniform(-np.pi, np.pi)}


def _payload(rng, f, robot, noise, session):
    ratio = 1.0 + 1.5 * f
    return {"ratio": ratio if rng.random() < 0.7 else 1.0 / ratio, "instant": rng.uniform(0.35, 0.65) * session}


def _marker(rng, f, *_):
    angle = rng.uniform(-np.pi, np.pi)
    return {"ahead": 0.06 * f * np.cos(angle), "left": 0.06 * f * np.sin(angle)}


def _lens(rng, f, *_):
    centre = rng.uniform(-0.2, 0.2, 2)
    return {"strength": 0.3 * f * rng.choice([-1, 1]), "centre_x": centre[0], "centre_y": centre[1]}


def _tilt(rng, f, *_):
    angle = rng.uniform(-np.pi, np.pi)
    return {"along_x": 0.2 * f * np.cos(angle), "along_y": 0.2 * f * np.sin(angle)}


def _outliers(rng, f, robot, noise, session):
    size = rng.uniform(10.0, 50.0)
    return {"probability": 0.002 + 0.04 * f} | {key: size * noise[key] for key in ("position", "heading")}


def _coloured(rng, f, robot, noise, session):
    size = {key: (0.5 + 4.0 * f) * noise[key] for key in ("position", "heading")}
    return size | {"correlation_time": rng.uniform(0.2, 1.0)}


LAWS = {
    "asymmetric_dead_zone": _signed(0.15),
    "direction_gain": _signed(0.25),
    "input_saturation": lambda rng, f, *_: {"level": 1.0 - 0.7 * f},
    "input_quantisation": _one("step", 0.4),
    "input_rate_limit": lambda rng, f, *_: {"rate": 1.0 / f},
    "transport_delay": _one("delay", 0.15),
    "motor_lag": _one("time_constant", 0.15),
    "backlash": _wheels(0.15),
    "supply_sag": _one("resistance", 0.35),
    "lost_commands": _one("probability", 0.5),
    "command_polling": lambda rng, f, *_: {"period": 0.3 * f, "phase": rng.uniform()},
    "twist_quantisation": lambda rng, f, *_: {"mean": 0.4 * f, "difference": 0.4 * f * rng.uniform(0.5, 2.0)},
    "coulomb_friction": _wheels(0.15),
    "stiction": lambda rng, f, *_: _wheels(0.25)(rng, f) | {"fade": rng.uniform(0.02, 0.1)},
    "quadratic_drag": _drag,
    "mass_offset": _mass,
    "turn_loss": lambda rng, f, robot, *_: {"loss": f * robot["rate"][0] / robot["speed"][1]},
    "traction_limit": lambda rng, f, *_: {"limit": 0.15 / f},
    "lateral_slip": lambda rng, f, robot, *_: {"slip": 0.5 * f / robot["speed"][1]},
    "slope": _slope,
    "gain_drift": lambda rng, f, r, n, session: {"rate": rng.choice([-1, -1, 1]) * 0.7 * f / session},
    "dead_zone_drift": lambda rng, f, r, n, session: {"rate": 0.2 * f / session},
    "payload_change": _payload,
    "marker_offset": _marker,
    "heading_offset": _one("offset", 0.25, signed=True),
    "camera_scale": _one("difference", 0.12, signed=True),
    "lens_distortion": _lens,
    "coloured_noise": _coloured,
    "outliers": _outliers,
    "frozen_frames": lambda rng, f, *_: {"probability": 0.005 + 0.12 * f},
    "camera_tilt": _tilt,
    "cubic_input": _one("cube", 0.8, signed=True),
    "cross_drag": _one("drag", 0.8),
    "wheel_eccentricity": lambda rng, f, *_: _wheels(0.2)(rng, f) | {"turns": rng.uniform(5.0, 12.0)},
    "rough_patch": lambda rng, f, robot, *_: {"drag": 2.0 * f * robot["rate"][0], "edge": rng.uniform(-0.1, 0.1)},
    "motor_heating": lambda rng, f, *_: {"loss": 3.0 * f, "time_constant": rng.uniform(3.0, 12.0)},
    "tether": lambda rng, f, robot, *_: {"pull": 1.5 * f * _full(robot)[0]},
    "heading_bias": lambda rng, f, *_: {"amplitude": 0.25 * f, "phase": rng.uniform(-np.pi, np.pi)},
    **LATER_LAWS,
}
"""Of every effect, in and outside the catalogue: (generator, strength, robot, noise, session) to parameters."""

FORMS = {
    "direction_gain": "the difference grows with the push",
    "input_saturation": "tanh in place of a clip",
    "input_quantisation": "rounded towards zero",
    "input_rate_limit": "falls twice as fast as it rises",
    "transport_delay": "every command waits 0.5 to 1.5 times as long",
    "motor_lag": "two poles of half the time constant",
    "backlash": "takes 70 % of the push",
    "supply_sag": "with the squares of the commands",
    "lost_commands": "three in a row",
    "coulomb_friction": "tanh of the speed over 5 % of the fastest",
    "stiction": "fades in a straight line",
    "quadratic_drag": "with the power 1.5",
    "turn_loss": "with the square of the turning",
    "traction_limit": "clip in place of a tanh",
    "lateral_slip": "levels off at 30 % of the largest v w",
    "slope": "a floor that bends: twice as steep half a metre on",
    "gain_drift": "with the square of the time",
    "dead_zone_drift": "with the root of the time",
    "payload_change": "in two halves, a tenth of the session apart",
    "lens_distortion": "with the fourth power of the radius",
    "coloured_noise": "rings at 0.5 Hz",
    "outliers": "log-normal sizes",
    "frozen_frames": "three in a row",
}
"""Effects that had another form than the catalogue's when the set was drawn, and which."""


def form(name: str, parameters: dict, session: float) -> float:
    """The parameter `form` of an effect's other form, which holds its scale where it needs one."""
    scales = {
        "coulomb_friction": 0.05, "slope": 2.0, "gain_drift": session, "dead_zone_drift": session,
        "payload_change": parameters.get("instant", 0.0) + 0.1 * session, "lens_distortion": 0.16,
        "coloured_noise": 0.5,
    }  # fmt: skip
    return float(scales.get(name, 1.0))
