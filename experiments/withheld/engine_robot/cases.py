"""Cases of the engine's robot: what is drawn, and the logs."""

import numpy as np

from jaxident.effects import CATALOGUE

from ..protocol import robots
from ..protocol.cases import ROWS, RUNS, SIM_RUNS, as_log
from .drive import Driver, simulate
from .world import Body

PERIODS = (0.02, 0.03, 0.04)


def draw_body(rng) -> tuple[Body, Driver]:
    """A plain robot: its motors differ by up to 10 %."""
    radius, track, mass = rng.uniform(0.02, 0.04), rng.uniform(0.12, 0.22), rng.uniform(0.4, 1.0)
    rate, v = rng.uniform(1.5, 4.0), rng.uniform(0.2, 0.45)
    braking, torque = 0.5 * rate * mass * radius**2, 0.5 * rate * mass * radius * v
    skew = rng.uniform(-0.05, 0.05, 2)
    body = Body(
        radius=radius, track=track, mass=mass, gyration=track * rng.uniform(0.28, 0.36),
        torque=(torque * (1 + skew[0]), torque * (1 - skew[0])),
        braking=(braking * (1 + skew[1]), braking * (1 - skew[1])),
    )  # fmt: skip
    return body, Driver(dead_zone=tuple(rng.uniform(0.05, 0.2, 2).tolist()))


def _push(body: Body) -> float:
    """Force of both wheels at full command [N]."""
    return 2.0 * body.torque[0] / body.radius


def _slope(rng, f, body, session):
    angle, sine = rng.uniform(-np.pi, np.pi), 0.2 * f * _push(body) / (9.81 * body.mass)
    return {"tilt": (sine * np.cos(angle), sine * np.sin(angle))}, {}


def _marker(rng, f, body, session):
    angle = rng.uniform(-np.pi, np.pi)
    return {"marker": (0.06 * f * np.cos(angle), 0.06 * f * np.sin(angle))}, {}


def _turned(rng, f, body, session):
    return {"turned": 0.25 * f * rng.choice([-1, 1])}, {}


def _payload(rng, f, body, session):
    return {}, {"payload": 1.0 + 1.5 * f, "instant": rng.uniform(0.35, 0.65) * session}


def _wheels(rng, f, size):
    return tuple(size * f * rng.uniform(0.6, 1.0, 2))


LAWS = {
    "tilted_floor": (_slope, ("slope",)),
    "low_grip": (
        lambda rng, f, body, _: ({"grip": 0.12 / f * _push(body) / (9.81 * body.mass)}, {}),
        ("traction_limit", "lateral_slip"),
    ),
    "payload": (_payload, ("payload_change",)),
    "gear_play": (lambda rng, f, *_: ({"play": _wheels(rng, f, 0.6)}, {}), ("backlash",)),
    "joint_friction": (
        lambda rng, f, body, _: ({"dry": _wheels(rng, f, 0.15 * body.torque[0])}, {}),
        ("coulomb_friction",),
    ),
    "late_commands": (lambda rng, f, *_: ({}, {"delay": 0.15 * f}), ("transport_delay",)),
    "slow_current": (lambda rng, f, *_: ({"lag": 0.15 * f}, {}), ("motor_lag",)),
    "current_limit": (
        lambda rng, f, body, _: ({"limit": min(0.35 / f, 1.5) * body.torque[0]}, {}),
        ("traction_limit", "input_saturation"),
    ),
    "voltage_limit": (lambda rng, f, *_: ({}, {"ceiling": 1.0 - 0.7 * f}), ("input_saturation",)),
    "weak_battery": (lambda rng, f, *_: ({}, {"resistance": 0.35 * f}), ("supply_sag",)),
    "slow_battery": (lambda rng, f, body, session: ({}, {"discharge": -0.7 * f / session}), ("gain_drift",)),
    "mass_ahead": (lambda rng, f, *_: ({"ahead": 0.03 * f * rng.choice([-1, 1])}, {}), ("mass_offset",)),
    "thick_air": (
        lambda rng, f, body, _: ({"air": 1200.0 * f * body.mass / 0.6}, {}),
        ("quadratic_drag",),
    ),
    "marker_aside": (_marker, ("marker_offset",)),
    "marker_turned": (_turned, ("heading_offset",)),
}
"""Each change of the engine's world: its law (changes of Body, of Driver), and the names that are right for it."""


def describe(seed: int, names: list[str], *, slip: bool, sim: bool) -> dict:
    """One case; the keys are those of `cases.FORMAT`."""
    rng = np.random.default_rng([seed, 1])
    body, driver = draw_body(rng)
    period, noise = float(rng.choice(PERIODS)), robots.draw_noise(rng)
    session, effects, strengths = RUNS * (ROWS - 1) * period, [], []
    for name in names:
        strengths.append(robots.draw_strength(rng))
        law, accepted = LAWS[name]
        shape, electric = law(rng, strengths[-1], body, session)
        sites = sorted({CATALOGUE[each].site for each in accepted} | ({"drive"} if name == "current_limit" else set()))
        parameters = {"body": plain(shape), "driver": plain(electric)}
        effects.append({"name": name, "parameters": parameters, "sites": sites})
    rate = body.braking[0] * 2.0 / (body.mass * body.radius**2)
    full = rate * body.radius * body.torque[0] / body.braking[0] * np.array([1.0, 2.0 / body.track])
    gain = {"gain": [[0.5 * full[0]] * 2, [0.5 * full[1]] * 2]}
    return {
        "generator": "engine",
        "seed": seed,
        "kind": ("none", "single", "pair")[len(names)],
        "effects": effects,
        "accepted": [list(LAWS[name][1]) for name in names],
        "channels": sorted({c for name in names for each in LAWS[name][1] for c in CATALOGUE[each].channels}),
        "strength": strengths,
        "slip": robots.draw_slip(rng, gain) if slip else None,
        "noise": noise,
        "robot": {"body": plain(body._asdict()), "driver": plain(driver._asdict())},
        "sim": "plain" if sim else None,
        "inputs": "multilevel",
        "period": period,
        "session": session,
    }


def plain(values: dict) -> dict:
    """The same as numbers and lists that JSON knows; infinite entries, which are defaults, left out."""
    listed = {k: [float(x) for x in v] if isinstance(v, tuple) else float(v) for k, v in values.items()}
    return {k: v for k, v in listed.items() if isinstance(v, list) or np.isfinite(v)}


def robot_of(case: dict, changed: bool) -> tuple[Body, Driver]:
    """The robot of a case, plain or with its hidden effects."""
    parts = []
    for kind, key in ((Body, "body"), (Driver, "driver")):
        values = dict(case["robot"][key])
        for effect in case["effects"] if changed else ():
            values |= effect["parameters"][key]
        parts.append(kind(**{k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}))
    return parts[0], parts[1]


def simulate_case(case: dict) -> list[np.ndarray]:
    """Logs (rows, 6): real runs, then those of the plain robot without noise."""
    rng, logs = np.random.default_rng([case["seed"], 2]), []
    for number in range(RUNS + (SIM_RUNS if case["sim"] else 0)):
        real = number < RUNS
        run = {
            "period": case["period"],
            "u": robots.draw_commands(rng, ROWS),
            "noise": case["noise"] if real else None,
            "effects": {},
            "rng": np.random.default_rng([case["seed"], 3, number]),
            "start": [*rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi)],
            "slip": robots.slip_series(rng, case["slip"] if real else None, ROWS, case["period"]),
            "session_time": case["session"] / RUNS * number if real else 0.0,
        }
        logs.append(drive_run(case, run, changed=real))
    return logs


def drive_run(case: dict, run: dict, changed: bool = True) -> np.ndarray:
    """The log (rows, 6) of one run of the robot of a case."""
    body, driver = robot_of(case, changed)
    poses = simulate(body, driver, run["period"], run["u"], run["start"], run["session_time"], run["slip"])
    return as_log(run, poses)
