"""An independent robot with every effect: plain floats, small Runge-Kutta steps, events by bisection.

Shares no code with the package. `simulate_reference` takes the robot as a dict (rate, gain, coupling, dead_zone), the
effects as {name: {parameter: value}} and returns camera poses (samples, 3). It is slow and meant to be plainly right.
"""

import itertools
import math

import numpy as np

X, Y, THETA, V, W, Q_R, Q_L, P_R, P_L, E_R, E_L, S_R, S_L = range(13)
TINY = 1e-12


def simulate_reference(parameters, effects, t, u_r, u_l, start, *, session_time=0.0, rng=None, step=2e-4):
    """Poses (samples, 3) of one run.

    parameters: rate (2,), gain (2, 2), coupling (2,) or None, dead_zone (2,). t [s], u_r, u_l: (samples,). start:
    (x, y, theta, v, w). step [s]: longest integration step. rng: NumPy generator for the random effects, which do
    nothing without it. session_time [s]: that of the first row.
    """
    robot = Robot(parameters, effects, session_time - t[0])
    u = sent_commands(effects, np.array([u_r, u_l], float).T, rng)
    delay = effects.get("transport_delay", {}).get("delay", 0.0)
    arrivals = polled(effects, np.asarray(t, float) + delay, session_time - t[0])
    change = effects.get("payload_change", {}).get("instant", 0.0) - session_time + t[0]
    shown = np.asarray(t, float) - effects.get("camera_latency", {}).get("delay", 0.0)  # what the frames of t show
    stops = np.unique(np.concatenate([shown, arrivals, [change]]))
    stops = stops[(stops >= shown[0]) & (stops <= shown[-1])]
    state, rows = np.array([*start, *[0.0] * 8]), [start[:3]]
    for begin, end in itertools.pairwise(stops):
        middle = 0.5 * (begin + end)
        index = np.searchsorted(arrivals, middle) - 1
        robot.target = u[index] if index >= 0 else np.zeros(2)
        robot.changed = middle > change
        state = robot.run(state, begin, end, step)
        if np.any(shown == end):
            rows.append(state[:3])
    return camera(effects, np.asarray(t, float), np.array(rows), rng)


class Robot:
    """The robot between two moments at which its command changes."""

    def __init__(self, parameters, effects, offset):
        self.rate = np.asarray(parameters["rate"], float)
        self.gain = np.asarray(parameters["gain"], float)
        coupling = parameters.get("coupling")
        across = np.zeros(2) if coupling is None else np.asarray(coupling, float)
        self.system = np.array([[-self.rate[0], across[0]], [across[1], -self.rate[1]]])
        self.inverse = np.linalg.inv(self.gain)
        self.to_n = self.inverse * self.rate
        self.dead_zone = parameters["dead_zone"]
        self.effects, self.offset = effects, offset
        self.command, self.begin, self.target, self.changed = np.zeros(2), 0.0, np.zeros(2), False
        self.slides = [0, 0]
        self.lag = self.of("motor_lag", "time_constant")
        order = self.of("motor_lag", "second_order")  # of one pole and the other, over the whole
        self.second = min(abs(root) for root in np.roots([1.0, -1.0, 0.25 * order]))
        self.coulomb = [self.of("coulomb_friction", side) for side in ("right", "left")]
        self.static = [self.of("stiction", side) for side in ("right", "left")]
        self.rubs = any(self.coulomb) or any(self.static)

    def of(self, effect, parameter, neutral=0.0):
        return self.effects.get(effect, {}).get(parameter, neutral)

    def run(self, state, begin, end, longest):
        self.begin = begin
        now, steps = begin, max(1, math.ceil((end - begin) / longest))
        points = np.linspace(begin, end, steps + 1)[1:]
        for point in points:
            while now < point - TINY:
                now, state = self.step(state, now, point)
            now = point
        self.command = self.commanded(end)
        return state

    def step(self, state, now, end):
        """From now to `end`, or to the first event before."""
        engaged, event = self.play(state, now)
        end = min(end, event)
        if self.of("traction_limit", "dry"):
            return self.skid(state, now, end, engaged)
        if not self.rubs:
            return end, self.advance(state, now, end - now, engaged, (0, 0))
        modes = self.friction_modes(state, now, engaged)
        new = self.advance(state, now, end - now, engaged, modes)
        if not self.crossed(new, modes):
            return end, self.held(new, modes)
        low, high = 0.0, end - now
        for _ in range(50):
            middle = 0.5 * (low + high)
            if self.crossed(self.advance(state, now, middle, engaged, modes), modes):
                high = middle
            else:
                low = middle
        new = self.advance(state, now, high, engaged, modes)
        n = self.to_n @ new[[V, W]]
        for wheel in range(2):
            if modes[wheel] * n[wheel] < 0.0:
                n[wheel] = 0.0
        new[[V, W]] = np.linalg.solve(self.to_n, n)
        return now + max(high, TINY), new

    def commanded(self, time):
        limit = self.of("input_rate_limit", "rate", math.inf)
        if math.isinf(limit):
            return self.target
        falls = limit * self.of("input_rate_limit", "falling_ratio", 1.0)
        return np.array([ramped(*pair, time - self.begin, limit, falls)
                         for pair in zip(self.command, self.target, strict=True)])  # fmt: skip

    def pushes(self, time):
        """What each motor gives, before play and lag."""
        u, session = self.commanded(time), time + self.offset
        passed = []
        for wheel, side in enumerate(("right", "left")):
            width = max(self.dead_zone[wheel] + self.drifted("dead_zone_drift", session), 0.0)
            skew = self.of("asymmetric_dead_zone", side)
            ahead, back = max(width + skew, 0.0), max(width - skew, 0.0)
            m = u[wheel] - ahead if u[wheel] > ahead else u[wheel] + back if u[wheel] < -back else 0.0
            m *= 1.0 + self.of("direction_gain", side) * np.sign(m)
            passed.append(m * max(1.0 + self.drifted("gain_drift", session), 0.0))
        return np.array(passed) / (1.0 + self.of("supply_sag", "resistance") * (abs(u[0]) + abs(u[1])))

    def drifted(self, name, session):
        """How far a drift has come: the integral of rate exp(growth t), until growth t is 3."""
        rate, growth = self.of(name, "rate"), self.of(name, "growth")
        last = min(session, 3.0 / growth) if growth > 0.0 else session
        return rate * (last if growth == 0.0 else (math.exp(growth * last) - 1.0) / growth)

    def coasting(self, state):
        """What lets each wheel coast, in commands."""
        return self.of("backlash", "coasting") * (self.to_n @ state[[V, W]])

    def play(self, state, now):
        """Whether each gear drives, and when the next one will."""
        turning, event, engaged = self.pushes(now) - self.coasting(state), math.inf, [True, True]
        for wheel, side in enumerate(("right", "left")):
            half = 0.5 * self.of("backlash", side)
            left = half - np.sign(turning[wheel]) * state[P_R + wheel]
            if half > 0.0 and turning[wheel] != 0.0 and left > TINY:
                engaged[wheel] = False
                event = min(event, now + max(left / abs(turning[wheel]), TINY))
        return engaged, event

    def friction_modes(self, state, now, engaged):
        """1, -1: the wheel slides that way; 0: it is held."""
        n = self.to_n @ state[[V, W]]
        moving = [int(np.sign(n[wheel])) if abs(n[wheel]) > 1e-11 else 0 for wheel in range(2)]
        still = [wheel for wheel in range(2) if moving[wheel] == 0]
        held, modes = list(still), list(moving)
        for _ in range(2):
            needed = self.holding(state, now, engaged, modes, held)
            for wheel in list(held):
                limit = self.coulomb[wheel] + self.static[wheel]
                if abs(needed[wheel]) > limit:
                    modes[wheel] = int(np.sign(needed[wheel]))
                    held.remove(wheel)
        return tuple(modes)

    def crossed(self, state, modes):
        n = self.to_n @ state[[V, W]]
        return any(mode * value < -1e-13 for mode, value in zip(modes, n, strict=True))

    def held(self, state, modes):
        """No drift of held wheels by rounding."""
        if 0 in modes:
            n = self.to_n @ state[[V, W]]
            state[[V, W]] = np.linalg.solve(self.to_n, np.where(np.array(modes) == 0, 0.0, n))
        return state

    def lightness(self):
        return 1.0 / self.of("payload_change", "ratio", 1.0) if self.changed else 1.0

    def unrubbed(self, state, now, engaged):
        """Acceleration of v and w without friction, and the push before the lag."""
        theta, v, w = state[[THETA, V, W]]
        push = np.where(engaged, self.pushes(now), self.coasting(state))
        driving = push if self.lag == 0.0 else state[[Q_R, Q_L]]
        along = self.system @ [v, w] + self.gain @ driving
        limit = self.of("traction_limit", "limit", math.inf)
        if self.of("traction_limit", "dry"):
            asked, slides = self.inverse @ along, self.sliding(state, self.inverse @ along)
            along = self.gain @ np.where(slides == 0, asked, limit * slides)
        elif math.isfinite(limit):
            along = self.gain @ (limit * np.tanh(self.inverse @ along / limit))
        along = along * self.lightness()
        along[0] -= self.of("quadratic_drag", "along") * v * abs(v) + self.of("turn_loss", "loss") * abs(w) * v
        along[1] -= self.of("quadratic_drag", "heading") * w * abs(w)
        along[0] += self.of("mass_offset", "along") * w * w
        along[1] -= self.of("mass_offset", "heading") * v * w
        along[0] += self.of("slope", "acceleration") * math.cos(theta - self.of("slope", "direction"))
        return along, push

    def sliding(self, state, asked):
        """Where each dry wheel slides to; 0 for one that rolls."""
        limit, excess = self.of("traction_limit", "limit"), state[[E_R, E_L]]
        return np.where(excess != 0.0, np.sign(excess), np.where(np.abs(asked) > limit, np.sign(asked), 0.0))

    def asked(self, state, now, engaged):
        """The net push of each wheel that rolls."""
        driving = np.where(engaged, self.pushes(now), 0.0) if self.lag == 0.0 else state[[Q_R, Q_L]]
        return self.inverse @ (self.system @ state[[V, W]] + self.gain @ driving)

    def spin(self, state, now, h, engaged):
        """h [s] later, each wheel that slides turning as its inertia says, whether or not it was caught."""
        new = self.advance(state, now, h, engaged, (0, 0))
        asked = self.asked(state, now, engaged), self.asked(new, now + h, engaged)
        slides, spin = self.sliding(state, asked[0]), self.of("traction_limit", "spin")
        if spin > 0.0:
            middle = 0.5 * (asked[0] + asked[1]) - self.of("traction_limit", "limit") * slides
            after = middle + (state[[E_R, E_L]] - middle) * math.exp(-h / spin)
            new[[E_R, E_L]] = np.where(slides == 0, 0.0, after)
        return new

    def skid(self, state, now, end, engaged):
        """From now to `end`, or to where the first wheel is caught."""
        sign = np.sign(state[[E_R, E_L]])
        new, low, high = self.spin(state, now, end - now, engaged), 0.0, end - now
        if np.any(sign * new[[E_R, E_L]] < 0.0):
            for _ in range(30):
                middle = 0.5 * (low + high)
                new = self.spin(state, now, middle, engaged)
                low, high = (low, middle) if np.any(sign * new[[E_R, E_L]] < 0.0) else (middle, high)
            new = self.spin(state, now, high, engaged)
            new[[E_R, E_L]] = np.where(sign * new[[E_R, E_L]] < 0.0, 0.0, new[[E_R, E_L]])
        return now + max(high, TINY), new

    def rubbing(self, n, modes):
        fade = self.of("stiction", "fade", 0.05)
        level = [c + s * math.exp(-((x / fade) ** 2)) for c, s, x in zip(self.coulomb, self.static, n, strict=True)]
        return np.array(modes) * np.array(level)

    def holding(self, state, now, engaged, modes, held):
        """Friction of each wheel, that of the held ones such that they stay."""
        acceleration, _ = self.unrubbed(state, now, engaged)
        friction = self.rubbing(self.to_n @ state[[V, W]], modes)
        if held:
            effect = self.to_n @ (self.gain * self.lightness())
            rest = self.to_n @ acceleration - effect @ np.where(np.isin([0, 1], held), 0.0, friction)
            friction[held] = np.linalg.solve(effect[np.ix_(held, held)], rest[held])
        return friction

    def slopes(self, state, now, engaged, modes):
        acceleration, push = self.unrubbed(state, now, engaged)
        if self.rubs:
            held = [wheel for wheel in range(2) if modes[wheel] == 0]
            friction = self.holding(state, now, engaged, modes, held)
            acceleration = acceleration - self.lightness() * self.gain @ friction
        theta, v, w = state[THETA], state[V], state[W]
        side = -self.of("lateral_slip", "slip") * v * w
        ds = np.zeros(len(state))
        ds[X] = v * math.cos(theta) - side * math.sin(theta)
        ds[Y] = v * math.sin(theta) + side * math.cos(theta)
        ds[THETA] = w
        ds[[V, W]] = acceleration
        if self.lag > 0.0:
            between = push if self.second == 0.0 else state[[S_R, S_L]]
            ds[[Q_R, Q_L]] = (between - state[[Q_R, Q_L]]) / (self.lag * (1.0 - self.second))
            if self.second > 0.0:
                ds[[S_R, S_L]] = (push - state[[S_R, S_L]]) / (self.lag * self.second)
        ds[[P_R, P_L]] = self.pushes(now) - self.coasting(state)
        return ds

    def advance(self, state, now, h, engaged, modes):
        k1 = self.slopes(state, now, engaged, modes)
        k2 = self.slopes(state + 0.5 * h * k1, now + 0.5 * h, engaged, modes)
        k3 = self.slopes(state + 0.5 * h * k2, now + 0.5 * h, engaged, modes)
        k4 = self.slopes(state + h * k3, now + h, engaged, modes)
        new = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        for wheel, side in enumerate(("right", "left")):
            half = 0.5 * self.of("backlash", side)
            new[P_R + wheel] = min(max(new[P_R + wheel], -half), half)
        return new


def ramped(command, target, time, rises, falls):
    """Where a command is that moves away from 0 by `rises` a second, and towards 0 by `falls`."""
    if command < 0.0:
        return -ramped(-command, -target, time, rises, falls)
    if target >= command:
        return min(command + rises * time, target)
    lowest = max(target, 0.0)
    left = time - (command - lowest) / falls
    return command - falls * time if left < 0.0 else max(lowest - rises * left, target)


def polled(effects, arrivals, offset):
    """Times at which commands act that arrive at a base which reads them now and then; `offset` makes session times."""
    polling = effects.get("command_polling", {"period": 0.0})
    if polling["period"] == 0.0:
        return arrivals
    found = []
    for arrival in arrivals + offset:
        poll = (math.floor(arrival / polling["period"]) - 2.0 + polling["phase"]) * polling["period"]
        while poll < arrival - 1e-9:
            poll += polling["period"]
        found.append(poll - offset)
    return np.array(found)


def sent_commands(effects, u, rng):
    """Commands (samples, 2) that leave for the robot."""
    level = effects.get("input_saturation", {}).get("level", math.inf)
    if effects.get("input_saturation", {}).get("soft", 0.0):
        u = level * np.tanh(u / level)
    u = np.minimum(np.maximum(u, -level), level)
    for row, (right, left) in enumerate(u if "twist_quantisation" in effects else []):
        steps = effects["twist_quantisation"]
        mean, difference = (right + left) / 2.0, right - left
        if steps["mean"] > 0.0:
            mean = np.round(mean / steps["mean"]) * steps["mean"]
        if steps["difference"] > 0.0:
            difference = np.round(difference / steps["difference"]) * steps["difference"]
        u[row] = mean + difference / 2.0, mean - difference / 2.0
    step = effects.get("input_quantisation", {}).get("step", 0.0)
    if step > 0.0:
        towards_zero = effects["input_quantisation"].get("towards_zero", 0.0)
        u = (np.fix(u / step) if towards_zero else np.round(u / step)) * step
    lost = effects.get("lost_commands", {}).get("probability", 0.0)
    for row in range(1, len(u)):
        if rng is not None and lost > 0.0 and rng.random() < lost:
            u[row] = u[row - 1]
    u[-1] = 0.0 if np.isnan(u[-1]).any() else u[-1]
    return u


def camera(effects, t, rows, rng):
    """What is reported of true poses (samples, 3)."""
    x, y, theta = rows.T.copy()
    marker = effects.get("marker_offset", {"ahead": 0.0, "left": 0.0})
    x = x + marker["ahead"] * np.cos(theta) - marker["left"] * np.sin(theta)
    y = y + marker["ahead"] * np.sin(theta) + marker["left"] * np.cos(theta)
    theta = theta + effects.get("heading_offset", {}).get("offset", 0.0)
    lens = {"strength": 0.0, "centre_x": 0.0, "centre_y": 0.0, "edge": 0.0} | effects.get("lens_distortion", {})
    out_x, out_y = x - lens["centre_x"], y - lens["centre_y"]
    away = np.hypot(out_x, out_y)
    factor = 1.0 + lens["strength"] * (away**2 + lens["edge"] * away**4)
    x, y = lens["centre_x"] + factor * out_x, lens["centre_y"] + factor * out_y
    tilt = {"along_x": 0.0, "along_y": 0.0} | effects.get("camera_tilt", {})
    depth = 1.0 + tilt["along_x"] * x + tilt["along_y"] * y
    x, y = x / depth, y / depth
    half = 0.5 * effects.get("camera_scale", {}).get("difference", 0.0)
    seen = np.stack([x * (1.0 + half), y * (1.0 - half), theta], axis=1)
    return seen if rng is None else disturbed(effects, t, seen, rng)


def disturbed(effects, t, seen, rng):
    """Poses with the random errors of the camera."""
    if "coloured_noise" in effects:
        law = {"correlation_time": 0.5} | effects["coloured_noise"]
        error = rng.normal(size=3)
        for row in range(len(t)):
            if row:
                kept = math.exp(-(t[row] - t[row - 1]) / law["correlation_time"])
                error = kept * error + math.sqrt(1.0 - kept**2) * rng.normal(size=3)
            seen[row] += error * [law["position"], law["position"], law["heading"]]
    if "outliers" in effects:
        law = {"position": 0.05, "heading": 0.2} | effects["outliers"]
        for row in range(len(t)):
            if rng.random() < law["probability"]:
                seen[row] += rng.normal(size=3) * [law["position"], law["position"], law["heading"]]
    for row in range(1, len(t)):
        if "frozen_frames" in effects and rng.random() < effects["frozen_frames"]["probability"]:
            seen[row] = seen[row - 1]
    return seen
