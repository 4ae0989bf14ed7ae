"""Many robots at once, each with its own effects: plain NumPy, small fixed steps, one column per run.

Shares no code with the package. The forms are those of `jaxident effects`; the integrator is another: Runge-Kutta
over substeps of held drive, and dry friction as an implicit projection (Moreau's time stepping) instead of events.
`OUTSIDE` are effects that no catalogue lists.
"""

import numpy as np

from .batch_camera import report

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


def columns(effects: list[dict]) -> dict[str, dict[str, np.ndarray]]:
    """Every parameter of every effect as an array (runs,), neutral where a run has not that effect."""
    return {
        name: {
            key: np.array([run.get(name, {}).get(key, neutral) for run in effects], float)
            for key, neutral in parameters.items()
        }
        for name, parameters in (NEUTRAL | OUTSIDE).items()
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
    rows, runs = sent.shape[:2]
    h = np.asarray(period, float) / substeps
    state = np.concatenate([np.asarray(start, float).T, np.zeros((2, runs))])
    memory = {key: np.zeros((runs, 2)) for key in ("command", "play", "lag", "friction", "angle", "heat")}
    poses = np.zeros((rows, runs, 3))
    poses[0] = state[:3].T
    for row in range(rows - 1):
        shove = np.zeros((runs, 2)) if slip is None else slip[row]
        targets = arriving(sent, row, p["transport_delay"]["delay"] / period, substeps)
        for j in range(substeps):
            time = session_time + row * period + (j + 0.5) * h
            drive = pushed(p, robot, memory, targets[j], time, h)
            state = substep(p, robot, memory, state, drive, shove, time, h)
        poses[row + 1] = state[:3].T
    return report(effects, period, poses, rngs)


def stack(robots) -> dict[str, np.ndarray]:
    """Parameters as arrays with a leading axis of runs, and the map from [v, w] to wheel speeds in command units."""
    robot = {key: np.array([each[key] for each in robots], float) for key in ("rate", "gain", "coupling", "dead_zone")}
    robot["inverse"] = np.linalg.inv(robot["gain"])
    robot["to_n"] = robot["inverse"] * robot["rate"][:, None, :]
    robot["from_n"] = np.linalg.inv(robot["to_n"])
    robot["mobility"] = robot["to_n"] @ robot["gain"]
    return robot


def sent_commands(p, u, rngs):
    """Commands (rows, runs, 2) that leave for the robot; an empty last row holds the one before."""
    u[-1] = np.where(np.isnan(u[-1]), u[-2], u[-1])
    level = p["input_saturation"]["level"][:, None]
    u = np.clip(u, -level, level)
    step = p["input_quantisation"]["step"][:, None]
    u = np.where(step > 0, np.round(u / np.where(step > 0, step, 1.0)) * step, u)
    for run in np.flatnonzero(p["lost_commands"]["probability"]) if rngs is not None else ():
        lost = rngs[run].random(len(u)) < p["lost_commands"]["probability"][run]
        u[:, run] = u[np.maximum.accumulate(np.where(lost, 0, np.arange(len(u)))), run]
    return u


def arriving(sent, row, delay, substeps):
    """Mean of the delayed command over each substep of a row: (substeps, runs, 2); delay in rows (runs,)."""
    if not np.any(delay > 0):
        return np.broadcast_to(sent[row], (substeps, *sent[row].shape))
    edges = row + np.arange(substeps + 1)[:, None] / substeps - delay
    runs = np.arange(sent.shape[1])
    first, last = np.floor(edges[:-1] + 1e-9).astype(int), np.floor(edges[1:] - 1e-9).astype(int)
    early = np.where(first == last, 1.0, (last - edges[:-1]) * substeps)[..., None]

    def at(index):
        return np.where((index >= 0)[..., None], sent[np.maximum(index, 0), runs], 0.0)

    return early * at(first) + (1.0 - early) * at(last)


def pair(parameters):
    """The two wheels' values as (runs, 2)."""
    return np.stack([parameters["right"], parameters["left"]], axis=1)


def pushed(p, robot, memory, target, time, h):
    """What the motors give, mean over a substep: (runs, 2)."""
    reach = (p["input_rate_limit"]["rate"] * h)[:, None]
    before = memory["command"]
    memory["command"] = np.where(np.isfinite(reach), before + np.clip(target - before, -reach, reach), target)
    u = np.where(np.isfinite(reach), 0.5 * (before + memory["command"]), target)
    width = np.maximum(robot["dead_zone"] + (p["dead_zone_drift"]["rate"] * time)[:, None], 0.0)
    skew = pair(p["asymmetric_dead_zone"])
    ahead, back = np.maximum(width + skew, 0.0), np.maximum(width - skew, 0.0)
    m = np.where(u > ahead, u - ahead, np.where(u < -back, u + back, 0.0))
    m = m + p["cubic_input"]["cube"][:, None] * m**3
    m = m * (1.0 + pair(p["direction_gain"]) * np.sign(m))
    m = m * np.maximum(1.0 + p["gain_drift"]["rate"] * time, 0.0)[:, None]
    m = m / (1.0 + p["supply_sag"]["resistance"] * np.abs(u).sum(axis=1))[:, None]
    m = m / (1.0 + p["motor_heating"]["loss"][:, None] * memory["heat"])
    memory["heat"] = memory["heat"] + (m**2 - memory["heat"]) * (h / p["motor_heating"]["time_constant"])[:, None]
    return lagged(p, memory, played(p, memory, m, h), h)


def played(p, memory, m, h):
    """What of the push arrives behind the play of the gears."""
    half, h = 0.5 * pair(p["backlash"]), h[:, None]
    left = np.maximum(half - np.sign(m) * memory["play"], 0.0)
    free = np.clip(left / np.where(m == 0.0, 1.0, np.abs(m) * h), 0.0, 1.0)
    memory["play"] = np.clip(memory["play"] + m * h, -half, half)
    return np.where(half > 0.0, m * (1.0 - free), m)


def lagged(p, memory, m, h):
    """Mean over the substep of the first-order lag, whose end is kept."""
    tau = p["motor_lag"]["time_constant"][:, None]
    ratio = h[:, None] / np.where(tau > 0.0, tau, 1.0)
    gap = memory["lag"] - m
    mean = m + gap * -np.expm1(-ratio) / ratio
    memory["lag"] = np.where(tau > 0.0, m + gap * np.exp(-ratio), m)
    return np.where(tau > 0.0, mean, m)


def substep(p, robot, memory, state, drive, shove, time, h):
    """State (5, runs) one substep later; the friction of the substep before is held, then corrected."""
    light = np.where(time < p["payload_change"]["instant"], 1.0, 1.0 / p["payload_change"]["ratio"])
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
    return new


def rubbed(p, robot, memory, state, new, light, h):
    """Speeds (2, runs) after dry friction: each wheel's force is within its level, and at the level where it slides."""
    coulomb, static = pair(p["coulomb_friction"]), pair(p["stiction"])
    if not np.any(coulomb + static > 0.0):
        return new[3:]
    mobility = robot["mobility"] * (light * h)[:, None, None]
    before = np.einsum("nij,jn->ni", robot["to_n"], state[3:])
    free = np.einsum("nij,jn->ni", robot["to_n"], new[3:]) + np.einsum("nij,nj->ni", mobility, memory["friction"])
    force, n = memory["friction"].copy(), before
    for _ in range(2):  # the level at the speed before, then at the mean speed
        level = coulomb + static * np.exp(-((0.5 * (before + n) / p["stiction"]["fade"][:, None]) ** 2))
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
        tyre = bound * np.tanh(np.einsum("nij,nj->ni", robot["inverse"], pull) / bound)
        pull = np.where(np.isfinite(limit), np.einsum("nij,nj->ni", robot["gain"], tyre), pull)
    n = np.einsum("nij,jn->ni", robot["to_n"], state[3:])
    pull = pull - np.einsum("nij,nj->ni", robot["gain"], p["cross_drag"]["drag"][:, None] * np.abs(n[:, ::-1]) * n)
    pull = pull * light[:, None] + push
    fall, patch = p["slope"], p["rough_patch"]
    along = pull[:, 0] - p["quadratic_drag"]["along"] * v * np.abs(v) - p["turn_loss"]["loss"] * np.abs(w) * v
    along = along + p["mass_offset"]["along"] * w * w + fall["acceleration"] * np.cos(theta - fall["direction"])
    along = along - patch["drag"] * v / (1.0 + np.exp(np.clip((patch["edge"] - x) / 0.01, -50, 50)))
    along = along - p["tether"]["pull"] * (x * cosine + y * sine)
    heading = pull[:, 1] - p["quadratic_drag"]["heading"] * w * np.abs(w) - p["mass_offset"]["heading"] * v * w
    side = -p["lateral_slip"]["slip"] * v * w
    wobble = np.einsum("nij,nj->in", robot["from_n"], pair(p["wheel_eccentricity"]) * np.sin(memory["angle"]) * n)
    v, w = v + wobble[0], w + wobble[1]
    return np.stack([v * cosine - side * sine, v * sine + side * cosine, w, along, heading])
