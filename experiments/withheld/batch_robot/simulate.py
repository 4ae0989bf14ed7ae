"""Many robots at once, each with its own effects: plain NumPy, small fixed steps, one column per run.

Shares no code with the package. The forms are those of `jaxident effects`; the integrator is another: Runge-Kutta
over substeps of held drive, and dry friction as an implicit projection (Moreau's time stepping) instead of events.
Most effects have a second form, for robots whose drag, say, is not quadratic: it acts where the parameter `form` is not
zero (`protocol/robots.FORMS`). `OUTSIDE` are effects that no catalogue lists; later ones are in `outside.py`.
"""

import numpy as np

from . import outside
from .camera import report
from .commands import arriving, delays, pair, polled, pushed, sent_commands

SUBSTEPS, RUBBING, SWEEPS = 16, 64, 8
"""Substeps per row, those of runs with dry friction, and sweeps over the two wheels' frictions."""

NEUTRAL: dict[str, dict[str, float]] = {
    "asymmetric_dead_zone": {"right": 0.0, "left": 0.0},
    "direction_gain": {"right": 0.0, "left": 0.0},
    "input_saturation": {"level": np.inf},
    "input_quantisation": {"step": 0.0},
    "input_rate_limit": {"rate": np.inf},
    "transport_delay": {"delay": 0.0},
    "motor_lag": {"time_constant": 0.0},
    "backlash": {"right": 0.0, "left": 0.0},
    "supply_sag": {"resistance": 0.0},
    "lost_commands": {"probability": 0.0},
    "command_polling": {"period": 0.0, "phase": 0.0},
    "twist_quantisation": {"mean": 0.0, "difference": 0.0},
    "coulomb_friction": {"right": 0.0, "left": 0.0},
    "stiction": {"right": 0.0, "left": 0.0, "fade": 0.05},
    "quadratic_drag": {"along": 0.0, "heading": 0.0},
    "mass_offset": {"along": 0.0, "heading": 0.0},
    "turn_loss": {"loss": 0.0},
    "traction_limit": {"limit": np.inf},
    "lateral_slip": {"slip": 0.0},
    "slope": {"acceleration": 0.0, "direction": 0.0},
    "gain_drift": {"rate": 0.0},
    "dead_zone_drift": {"rate": 0.0},
    "payload_change": {"ratio": 1.0, "instant": np.inf},
}
OUTSIDE: dict[str, dict[str, float]] = {
    "cubic_input": {"cube": 0.0},  # m + c m^3: a driver that is not linear above its dead zone
    "cross_drag": {"drag": 0.0},  # each wheel loses c |n of the other| n: one gear train brakes the other
    "wheel_eccentricity": {"right": 0.0, "left": 0.0, "turns": 0.0},  # rolling radius r (1 + e sin(angle))
    "rough_patch": {"drag": 0.0, "edge": 0.0},  # v' -= c v where x > edge: a carpet
    "motor_heating": {"loss": 0.0, "time_constant": 10.0},  # m / (1 + c h), h' = (m^2 - h) / tau
    "tether": {"pull": 0.0},  # v' -= k (x cos + y sin): a cable towards the origin
}


MEMORY = ("command", "play", "lag", "second lag", "friction", "angle", "heat", *outside.MEMORY)
"""What a robot remembers of both wheels."""


def columns(effects: list[dict]) -> dict[str, dict[str, np.ndarray]]:
    """Every parameter of every effect as an array (runs,), neutral where a run has not that effect. Later effects of no
    catalogue are left out where no run has them."""
    had = {name for run in effects for name in run}
    late = {name: law for name, law in outside.LATER.items() if name in had}
    return {
        name: {
            key: np.array([run.get(name, {}).get(key, neutral) for run in effects], float)
            for key, neutral in {"form": 0.0, **parameters}.items()
        }
        for name, parameters in (NEUTRAL | OUTSIDE | late).items()
    }


def simulate(robots, effects, period, u, start, session_time, slip=None, rngs=None, substeps=None):
    """Reported poses (rows, runs, 3) without the camera's white error.

    robots: dicts of rate (2,), gain (2, 2), coupling (2,), dead_zone (2,). effects: one {name: {parameter: value}}
    per run. period [s]: (runs,). u: (rows, runs, 2). start: (runs, 3), at rest. session_time [s]: that of the first
    row, (runs,). slip: random acceleration (rows, runs, 2), held over a row. rngs: a generator per run for its random
    effects. Runs with dry friction need the finer steps: keep them in a batch of their own.
    """
    rubs = any(run.keys() & {"coulomb_friction", "stiction"} for run in effects)
    substeps = substeps or (RUBBING if rubs else SUBSTEPS)
    p, robot = columns(effects), stack(robots)
    sent = sent_commands(p, np.array(u, float), rngs)
    delay = delays(p, period, len(sent), rngs)
    rows, runs = sent.shape[:2]
    h = np.asarray(period, float) / substeps
    state = np.concatenate([np.asarray(start, float).T, np.zeros((2, runs))])
    memory = {key: np.zeros((runs, 2)) for key in MEMORY}
    poses = np.zeros((rows, runs, 3))
    poses[0] = state[:3].T
    shoves = outside.bumped(p, period, np.zeros((rows, runs, 2)) if slip is None else slip, rngs)
    for row in range(rows - 1):
        shove = shoves[row]
        late = delay[row] + outside.later(p, robot, state, period)
        targets = arriving(sent, row, late, substeps)
        targets = polled(p, sent, row, late, targets, period, session_time)
        for j in range(substeps):
            time = session_time + row * period + (j + 0.5) * h
            drive = outside.braked(p, robot, state, pushed(p, robot, memory, targets[j], time, h))
            state = substep(p, robot, memory, state, drive, shove, time, h)
        poses[row + 1] = state[:3].T
    return report(effects, period, poses, rngs)


def stack(robots) -> dict[str, np.ndarray]:
    """Parameters as arrays with a leading axis of runs, and the map from [v, w] to wheel speeds in command units."""
    robot = {key: np.array([each[key] for each in robots], float) for key in ("rate", "gain", "coupling", "dead_zone")}
    robot["top"] = np.abs(robot["gain"]).sum(axis=2) / robot["rate"]
    robot["inverse"] = np.linalg.inv(robot["gain"])
    robot["to_n"] = robot["inverse"] * robot["rate"][:, None, :]
    robot["from_n"] = np.linalg.inv(robot["to_n"])
    robot["mobility"] = robot["to_n"] @ robot["gain"]
    return robot


def substep(p, robot, memory, state, drive, shove, time, h):
    """State (5, runs) one substep later; the friction of the substep before is held, then corrected."""
    light = lightness(p["payload_change"], time)
    shove = shove + outside.shoved(p, robot, memory, state, light, time)
    rub = np.einsum("nij,nj->ni", robot["gain"], memory["friction"]) * light[:, None]

    def slope(s):
        return slopes(p, robot, memory, s, drive, light, shove - rub)

    k1 = slope(state)
    k2 = slope(state + 0.5 * h * k1)
    k3 = slope(state + 0.5 * h * k2)
    k4 = slope(state + h * k3)
    new = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    corrected = rubbed(p, robot, memory, state, new, light, h)
    gained = 0.5 * h * (corrected - new[3:])  # the correction grows over the step
    new[:3] += np.stack([gained[0] * np.cos(new[2]), gained[0] * np.sin(new[2]), gained[1]])
    new[3:] = corrected
    n = np.einsum("nij,jn->ni", robot["to_n"], new[3:])
    memory["angle"] = memory["angle"] + p["wheel_eccentricity"]["turns"][:, None] * n * h[:, None]
    outside.remember(p, robot, memory, new, h)
    return new


def lightness(payload, time):
    """Inverse of the robot's inertia (runs,), 1 at first; in the other form it changes at two instants."""
    half = np.where(payload["form"] > 0, 0.5, 1.0)
    loaded = half * (time >= payload["instant"]) + (1.0 - half) * (time >= payload["form"])
    return payload["ratio"] ** -loaded


def rubbed(p, robot, memory, state, new, light, h):
    """Speeds (2, runs) after dry friction: each wheel's force is within its level, and at the level where it slides."""
    hard = p["coulomb_friction"]["form"][:, None] == 0.0
    coulomb, static = np.where(hard, pair(p["coulomb_friction"]), 0.0), pair(p["stiction"])
    if not np.any(coulomb + static > 0.0):
        return new[3:]
    mobility = robot["mobility"] * (light * h)[:, None, None]
    before = np.einsum("nij,jn->ni", robot["to_n"], state[3:])
    free = np.einsum("nij,jn->ni", robot["to_n"], new[3:]) + np.einsum("nij,nj->ni", mobility, memory["friction"])
    force, n = memory["friction"].copy(), before
    for _ in range(2):  # the level at the speed before, then at the mean speed
        part = np.abs(0.5 * (before + n)) / p["stiction"]["fade"][:, None]
        straight = p["stiction"]["form"][:, None] > 0
        level = coulomb + static * np.where(straight, np.maximum(1.0 - part, 0.0), np.exp(-(part**2)))
        for _ in range(SWEEPS):
            for wheel in range(2):
                other = free[:, wheel] - mobility[:, wheel, 1 - wheel] * force[:, 1 - wheel]
                force[:, wheel] = np.clip(other / mobility[:, wheel, wheel], -level[:, wheel], level[:, wheel])
        n = free - np.einsum("nij,nj->ni", mobility, force)
    memory["friction"] = force
    turned = before * n < 0.0  # it slides one way until it stops, then the other
    share = np.abs(before) / np.where(turned, np.abs(before) + np.abs(n), 1.0)
    force = np.where(turned, (1.0 - 2.0 * share) * force, force)
    n = free - np.einsum("nij,nj->ni", mobility, force)
    return np.einsum("nij,nj->in", robot["from_n"], n)


def slopes(p, robot, memory, state, drive, light, push):
    """Derivatives (5, runs) of x, y, theta, v, w under held drive; push: further accelerations (runs, 2)."""
    x, y, theta, v, w = state
    cosine, sine = np.cos(theta), np.sin(theta)
    pull = np.einsum("nij,nj->ni", robot["gain"], drive)
    pull = pull - robot["rate"] * state[3:].T + robot["coupling"] * state[:2:-1].T
    limit = p["traction_limit"]["limit"][:, None]
    if np.any(np.isfinite(limit)):
        bound = np.where(np.isfinite(limit), limit, 1.0)
        force = np.einsum("nij,nj->ni", robot["inverse"], pull)
        sudden = p["traction_limit"]["form"][:, None] > 0
        tyre = np.where(sudden, np.clip(force, -bound, bound), bound * np.tanh(force / bound))
        pull = np.where(np.isfinite(limit), np.einsum("nij,nj->ni", robot["gain"], tyre), pull)
    n = np.einsum("nij,jn->ni", robot["to_n"], state[3:])
    soft = p["coulomb_friction"]["form"][:, None]
    rub = np.where(soft > 0, pair(p["coulomb_friction"]) * np.tanh(n / np.where(soft > 0, soft, 1.0)), 0.0)
    rub = rub + p["cross_drag"]["drag"][:, None] * np.abs(n[:, ::-1]) * n
    pull = pull - np.einsum("nij,nj->ni", robot["gain"], rub)
    pull = pull * light[:, None] + push
    fall, patch = p["slope"], p["rough_patch"]
    drag, loss, top = p["quadratic_drag"], p["turn_loss"], robot["top"].T
    weak = np.where(drag["form"] > 0, np.sqrt(top / (np.abs(state[3:]) + 1e-9)), 1.0)  # a power of 1.5
    turning = np.where(loss["form"] > 0, w * w / top[1], np.abs(w))
    dished = 1.0 + fall["form"] * x
    along = pull[:, 0] - drag["along"] * v * np.abs(v) * weak[0] - loss["loss"] * turning * v
    along = along + p["mass_offset"]["along"] * w * w
    along = along + fall["acceleration"] * dished * np.cos(theta - fall["direction"])
    along = along - patch["drag"] * v / (1.0 + np.exp(np.clip((patch["edge"] - x) / 0.01, -50, 50)))
    along = along - p["tether"]["pull"] * (x * cosine + y * sine)
    heading = pull[:, 1] - drag["heading"] * w * np.abs(w) * weak[1] - p["mass_offset"]["heading"] * v * w
    most = 0.3 * top[0] * top[1]
    side = np.where(p["lateral_slip"]["form"] > 0, most * np.tanh(v * w / most), v * w) * -p["lateral_slip"]["slip"]
    wobble = np.einsum("nij,nj->in", robot["from_n"], pair(p["wheel_eccentricity"]) * np.sin(memory["angle"]) * n)
    v, w = v + wobble[0], w + wobble[1]
    return np.stack([v * cosine - side * sine, v * sine + side * cosine, w, along, heading])
