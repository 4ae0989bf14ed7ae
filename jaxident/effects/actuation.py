"""Between the command that was logged and the force at the wheel.

A chain in this order: lost_commands, input_saturation, input_quantisation, transport_delay (the time grid of
`effects.full`), input_rate_limit, asymmetric_dead_zone, direction_gain, supply_sag, backlash, motor_lag. Everything is
per wheel and in the unit of the command unless it says otherwise.
"""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Wheels
from jaxident.effects.entry import BOTH, UNIT, Entry, Parameter
from jaxident.numerics import hold_integrals, safe_divide


def lost_commands(command: Array, lost: Array) -> Array:
    """The command (samples,) with every lost entry (boolean, samples) replaced by the last one that arrived; nothing
    arrived before the first row, which is never lost."""
    rows = jnp.arange(len(command))
    return command[jax.lax.cummax(jnp.where(lost, 0, rows))]


def input_saturation(u: Array, level: Array) -> Array:
    """clip(u, -s, s)."""
    return jnp.clip(u, -level, level)


def input_quantisation(u: Array, step: Array) -> Array:
    """round(u / q) q; a step of 0 passes u."""
    return jnp.where(step > 0.0, jnp.round(safe_divide(u, step, 0.0)) * step, u)


def input_rate_limit(u: Array, target: Array, time: Array, rate: Array) -> Array:
    """The command `time` [s] after `target` was asked for, when it moves by at most `rate` [unit/s] from u."""
    limited = jnp.isfinite(rate)
    reach = jnp.where(limited, rate, 0.0) * time
    return jnp.where(limited, u + jnp.clip(target - u, -reach, reach), target)


def asymmetric_dead_zone(u: Array, width: Array, difference: Array) -> Array:
    """Dead zone of width D + a forward and D - a backward, neither below 0; PAPER (10) at a = 0."""
    forward, backward = jnp.maximum(width + difference, 0.0), jnp.maximum(width - difference, 0.0)
    return jnp.where(u > forward, u - forward, jnp.where(u < -backward, u + backward, 0.0))


def direction_gain(m: Array, difference: Array) -> Array:
    """(1 + g sign m) m: slope 1 + g forward and 1 - g backward."""
    return m + difference * jnp.abs(m)


def supply_sag(m: Wheels, u: Wheels, resistance: Array) -> Wheels:
    """m / (1 + s (|u_r| + |u_l|)): both motors share one supply with an inner resistance."""
    share = 1.0 / (1.0 + resistance * (jnp.abs(u.right) + jnp.abs(u.left)))
    return Wheels(m.right * share, m.left * share)


def backlash(position: Array, turning: Array, step: Array, width: Array) -> tuple[Array, Array]:
    """New position in the play and the part of the step [0, 1] that passed before the gear drives again.

    position in [-width / 2, width / 2] moves with p' = turning = m - c n while the wheel is free; the motor drives
    where p touches the side towards which it turns. c = 0: the wheel brakes meanwhile, as if on the motor's side, and
    only a reversal of m opens the play. c = 1: the play lies between motor and wheel, n is the wheel's speed, and the
    free wheel coasts, pushed by c n. width in unit s: play in distance over the speed per unit of command.
    """
    half = 0.5 * width
    remaining = jnp.maximum(half - jnp.sign(turning) * position, 0.0)
    free = jnp.clip(safe_divide(remaining, jnp.abs(turning) * step, 0.0), 0.0, 1.0)
    loose = width > 0.0  # without play the bounds meet, and the derivative of a clip between them is arbitrary
    return jnp.where(loose, jnp.clip(position + turning * step, -half, half), 0.0), jnp.where(loose, free, 0.0)


def motor_lag(last: Array, m: Array, step: Array, time_constant: Array) -> tuple[Array, Array, Array, Array]:
    """q' = (m - q) / tau over a step of held m: q at its end, mean of q, its slope (12 times the first moment about
    the middle, so that mean + slope (s - 1/2) has both moments of q), and the part of q that kept its start."""
    lagging = time_constant > 0.0
    decay, once, twice = hold_integrals(1.0 / jnp.where(lagging, time_constant, 1.0), step)
    kept = safe_divide(once, step, 1.0)
    moment = safe_divide(step * once - twice, step * step, 0.5) - 0.5 * kept
    first = safe_divide(time_constant, step, 0.0)  # the limit of `kept`, which gives the derivative at no lag
    still = jnp.where(step > 0.0, 0.0, 1.0)  # no time, no change: else a step of length zero would hide a switch
    limits = (decay, still), (kept, first), (moment, -0.5 * first)
    decay, kept, moment = (jnp.where(lagging, value, limit) for value, limit in limits)
    gap = last - m
    return m + gap * decay, m + gap * kept, 12.0 * moment * gap, kept


def _row(name, equation, parameters, confused_with, source, **more) -> Entry:
    return Entry(name, "actuation", equation, parameters, BOTH, confused_with, source, **more)


def _pair(unit: str, size: float, typical: float, **more) -> tuple[Parameter, Parameter]:
    low = 0.0 if more.get("least") == 0.0 else -size
    return Parameter("right", unit, 0.0, (low, size), typical, **more), Parameter(
        "left", unit, 0.0, (low, size), 0.8 * typical, **more
    )


ENTRIES = (
    _row("asymmetric_dead_zone", "D = D0 + a for u > 0, D0 - a for u < 0", _pair(UNIT, 0.15, 0.06),
         ("coulomb_friction",), "Tao, Kokotovic 1996, Adaptive Control of Systems with Actuator Nonlinearities, ch. 2"),
    _row("direction_gain", "m -> (1 + g sign m) m", _pair("", 0.2, 0.08, least=-1.0, most=1.0), (),
         "brush timing of motors; Borenstein, Everett, Feng 1996, Where am I?"),
    _row("input_saturation", "u -> clip(u, -s, s)",
         (Parameter("level", UNIT, float("inf"), (0.3, 1.0), 0.6, least=0.0, above=True),), (),
         "Franklin, Powell, Emami-Naeini, Feedback Control, ch. 9", smooth=False, grid=(0.95, 0.9, 0.8, 0.7, 0.6, 0.5)),
    _row("input_quantisation", "u -> q round(u / q)", (Parameter("step", UNIT, 0.0, (0.01, 0.25), 0.15, least=0.0),),
         (), "Widrow, Kollar 2008, Quantization Noise", smooth=False, grid=(0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25)),
    _row("input_rate_limit", "|u'| <= R",
         (Parameter("rate", f"{UNIT}/s", float("inf"), (1.0, 50.0), 5.0, least=0.0, above=True),), ("motor_lag",),
         "slew limit of motor drivers; Franklin, Powell, Emami-Naeini, ch. 9", smooth=False,
         grid=(50.0, 20.0, 10.0, 5.0, 2.0, 1.0)),
    _row("transport_delay", "u(t) -> u(t - T)", (Parameter("delay", "s", 0.0, (0.0, 0.3), 0.05, least=0.0),),
         ("motor_lag",), "radio, computing and camera latency; Astrom, Murray, Feedback Systems, ch. 10"),
    _row("motor_lag", "q' = (m - q) / tau, gain q in place of gain m",
         (Parameter("time_constant", "s", 0.0, (0.0, 0.3), 0.06, least=0.0),), ("transport_delay",),
         "inductance and speed loop; Franklin, Powell, Emami-Naeini, ch. 2"),
    _row("backlash", "p' = m - c n, |p| <= b / 2: where it touches neither side, c n in place of m",
         (*_pair(f"{UNIT} s", 0.2, 0.05, least=0.0),
          Parameter("coasting", "", 0.0, (0.0, 1.0), 0.0, least=0.0, most=1.0, shape=True)), ("transport_delay",),
         "Nordin, Gutman 2002, Controlling mechanical systems with backlash, Automatica 38", smooth=False,
         grid=(0.005, 0.01, 0.02, 0.05, 0.1, 0.2)),
    _row("supply_sag", "m -> m / (1 + s (|u_r| + |u_l|))",
         (Parameter("resistance", f"1/{UNIT}", 0.0, (0.0, 0.3), 0.1, least=0.0),), ("input_saturation",),
         "inner resistance of batteries; Plett 2015, Battery Management Systems, ch. 2"),
    _row("lost_commands", "u_k -> u_{k-1} with probability p",
         (Parameter("probability", "", 0.0, (0.0, 0.5), 0.3, least=0.0, most=1.0),), ("transport_delay",),
         "radio links; Schenato et al. 2007, Foundations of control over lossy networks, Proc. IEEE 95",
         smooth=False, grid=(0.01, 0.02, 0.05, 0.1, 0.2), random=True, extension=True),
)  # fmt: skip
"""Rows of the catalogue for this site."""
