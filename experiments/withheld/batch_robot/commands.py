"""From commands to what the motors give, in plain NumPy: the input half of the simulator.

Each effect has two forms: that of `jaxident effects`, and where `form` is not 0 another that robots might have too.
"""

import numpy as np

BURST = 3
"""Rows that losses last in their other form."""
STIFF = 0.7
"""Part of the push that play of the other form takes: gears that touch softly."""


def sent_commands(p, u, rngs):
    """Commands (rows, runs, 2) that leave for the robot; an empty last row holds the one before."""
    u[-1] = np.where(np.isnan(u[-1]), u[-2], u[-1])
    level, smooth = (p["input_saturation"][key][:, None] for key in ("level", "form"))
    bound = np.where(np.isfinite(level), level, 1.0)
    u = np.where(smooth > 0, bound * np.tanh(u / bound), np.clip(u, -level, level))
    u = twisted(u, *(p["twist_quantisation"][key][:, None] for key in ("mean", "difference")))
    step, toward_zero = (p["input_quantisation"][key][:, None] for key in ("step", "form"))
    count = u / np.where(step > 0, step, 1.0)
    u = np.where(step > 0, np.where(toward_zero > 0, np.trunc(count), np.round(count)) * step, u)
    for run in np.flatnonzero(p["lost_commands"]["probability"]) if rngs is not None else ():
        chance, bursts = (p["lost_commands"][key][run] for key in ("probability", "form"))
        lost = happens(rngs[run], len(u), chance, bursts)
        u[:, run] = u[np.maximum.accumulate(np.where(lost, 0, np.arange(len(u)))), run]
    return u


def twisted(u, mean, difference):
    """Commands (rows, runs, 2) whose mean and difference come in whole steps (runs, 1), 0 for none."""
    parts = np.stack([u.mean(axis=2), u[..., 0] - u[..., 1]], axis=-1)
    steps = np.concatenate([mean, difference], axis=1)
    parts = np.where(steps > 0, np.round(parts / np.where(steps > 0, steps, 1.0)) * steps, parts)
    told = np.stack([parts[..., 0] + 0.5 * parts[..., 1], parts[..., 0] - 0.5 * parts[..., 1]], axis=-1)
    return np.where(np.any(steps > 0, axis=1)[:, None], told, u)


def happens(rng, rows, chance, bursts):
    """Rows (boolean) where something of some chance happens: each by itself, or in bursts."""
    if not bursts:
        return rng.random(rows) < chance
    begins = rng.random(rows) < chance / BURST
    return np.convolve(begins, np.ones(BURST))[:rows] > 0


def delays(p, period, rows, rngs):
    """Delay of the commands in rows, (rows, runs): a fixed one, or of the other form drawn anew every row."""
    delay = np.tile(p["transport_delay"]["delay"] / period, (rows, 1))
    for run in np.flatnonzero(p["transport_delay"]["form"]) if rngs is not None else ():
        delay[:, run] *= rngs[run].uniform(0.5, 1.5, rows)
    return delay


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


def polled(p, sent, row, delay, targets, period, session_time):
    """The means `targets` over the substeps of a row, but of what the base read last where it reads now and then. No
    substep holds more than one reading."""
    reads, phase = p["command_polling"]["period"], p["command_polling"]["phase"]
    every = np.where(reads > 0, reads, 1.0)
    edges = session_time + period * (row + np.arange(len(targets) + 1)[:, None] / len(targets))
    number = np.floor(edges / every - phase + 1e-9)
    last = (number + phase) * every
    index = np.floor((last - session_time) / period - delay + 1e-6).astype(int)
    u = np.where((index >= 0)[..., None], sent[np.maximum(index, 0), np.arange(sent.shape[1])], 0.0)
    early = np.where(number[1:] > number[:-1], (last[1:] - edges[:-1]) / np.diff(edges, axis=0), 1.0)[..., None]
    return np.where((reads > 0)[:, None], early * u[:-1] + (1.0 - early) * u[1:], targets)


def pair(parameters):
    """The two wheels' values as (runs, 2)."""
    return np.stack([parameters["right"], parameters["left"]], axis=1)


def pushed(p, robot, memory, target, time, h):
    """What the motors give, mean over a substep: (runs, 2)."""
    before = memory["command"]
    falls = (p["input_rate_limit"]["form"][:, None] > 0) & (np.abs(target) < np.abs(before))
    reach = (p["input_rate_limit"]["rate"] * h)[:, None] * np.where(falls, 2.0, 1.0)
    memory["command"] = np.where(np.isfinite(reach), before + np.clip(target - before, -reach, reach), target)
    u = np.where(np.isfinite(reach), 0.5 * (before + memory["command"]), target)
    wear, session = p["dead_zone_drift"]["rate"], p["dead_zone_drift"]["form"]
    worn = wear * np.where(session > 0, np.sqrt(time * session), time)
    width = np.maximum(robot["dead_zone"] + worn[:, None], 0.0)
    skew = pair(p["asymmetric_dead_zone"])
    ahead, back = np.maximum(width + skew, 0.0), np.maximum(width - skew, 0.0)
    m = np.where(u > ahead, u - ahead, np.where(u < -back, u + back, 0.0))
    m = m + p["cubic_input"]["cube"][:, None] * m**3
    growing = p["direction_gain"]["form"][:, None] > 0
    m = m * (1.0 + pair(p["direction_gain"]) * np.where(growing, 2.0 * np.clip(m, -0.8, 0.8), np.sign(m)))
    session = p["gain_drift"]["form"]
    drifted = p["gain_drift"]["rate"] * time * np.where(session > 0, time / np.where(session > 0, session, 1.0), 1.0)
    m = m * np.maximum(1.0 + drifted, 0.0)[:, None]
    current = np.where(p["supply_sag"]["form"][:, None] > 0, u * u, np.abs(u)).sum(axis=1)
    m = m / (1.0 + p["supply_sag"]["resistance"] * current)[:, None]
    m = m / (1.0 + p["motor_heating"]["loss"][:, None] * memory["heat"])
    memory["heat"] = memory["heat"] + (m**2 - memory["heat"]) * (h / p["motor_heating"]["time_constant"])[:, None]
    tau, twice = p["motor_lag"]["time_constant"], p["motor_lag"]["form"] > 0
    m = lagged(memory, "lag", played(p, memory, m, h), np.where(twice, 0.5 * tau, tau), h)
    return lagged(memory, "second lag", m, np.where(twice, 0.5 * tau, 0.0), h)


def played(p, memory, m, h):
    """What of the push arrives behind the play of the gears."""
    half, h = 0.5 * pair(p["backlash"]), h[:, None]
    left = np.maximum(half - np.sign(m) * memory["play"], 0.0)
    free = np.clip(left / np.where(m == 0.0, 1.0, np.abs(m) * h), 0.0, 1.0)
    memory["play"] = np.clip(memory["play"] + m * h, -half, half)
    taken = np.where(p["backlash"]["form"][:, None] > 0, STIFF, 1.0)
    return np.where(half > 0.0, m * (1.0 - taken * free), m)


def lagged(memory, key, m, tau, h):
    """Mean over the substep of a first-order lag, whose end is kept."""
    tau = tau[:, None]
    ratio = h[:, None] / np.where(tau > 0.0, tau, 1.0)
    gap = memory[key] - m
    mean = m + gap * -np.expm1(-ratio) / ratio
    memory[key] = np.where(tau > 0.0, m + gap * np.exp(-ratio), m)
    return np.where(tau > 0.0, mean, m)
