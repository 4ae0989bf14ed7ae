"""Between the command that was logged and the push at the wheel. Laws of the command itself are in `commands`, those
of the push in `motors`, and those that remember it in `gears`."""

import numpy as np

from jaxident.effects import statements
from jaxident.effects.commands import (
    command_polling,
    input_quantisation,
    input_rate_limit,
    input_saturation,
    lost_commands,
    rate_limit_by_inverse,
    transport_delay,
    twist_quantisation,
)
from jaxident.effects.effect import (
    BOTH,
    UNIT,
    Chance,
    Coordinate,
    EffectRecord,
    Parameter,
    Search,
    Suggested,
    Transform,
    Values,
    positive,
    signed,
)
from jaxident.effects.gears import lag, lag_of_runs, play, play_of_runs
from jaxident.effects.law_kinds import CHANGES, WHEELS
from jaxident.effects.motors import asymmetric_dead_zone, direction_gain, supply_sag

AT_ONCE = 1e-3
"""Least time in which a command falls, over that in which it rises: files hold no infinite ratio."""
OFF = 1e3
"""A saturation level far above every command, in largest commands."""
_LATE = tuple(
    (WHEELS, *law) for own in CHANGES for law in (("1", own), (own, "v"), (own, "w"), (own, "own speed"))
)  # fmt: skip
"""Discovered laws of a robot that follows its commands late."""


def _as_rates(c: Values) -> dict[str, float]:
    rate = float(1.0 / c["inverse_rate"]) if c["inverse_rate"] > 0.0 else float("inf")
    return {"rate": rate, "falling_ratio": float(1.0 / c["falling_time"])}


def _as_inverses(p: Values) -> dict[str, float]:
    return {"inverse_rate": 1.0 / p["rate"], "falling_time": 1.0 / p.get("falling_ratio", 1.0)}


def _pair(unit: str, size: float, typical: float, **more) -> tuple[Parameter, Parameter]:
    low = 0.0 if more.get("least") == 0.0 else -size
    return Parameter("right", unit, 0.0, (low, size), typical, **more), Parameter(
        "left", unit, 0.0, (low, size), 0.8 * typical, **more
    )


def _levels(_: float) -> list[dict[str, float]]:
    return [{"level": level, "soft": soft} for soft in (0.0, 1.0) for level in (0.9, 0.75, 0.6, 0.45, 0.3)]


def _steps(_: float) -> list[dict[str, float]]:
    return [_in_steps(float(step), form) for form in (0.0, 1.0) for step in np.geomspace(0.02, 0.4, 96)]


def _in_steps(step: float, towards_zero: float) -> dict[str, float]:
    return {"step": step, "towards_zero": towards_zero}


def _polls(_: float) -> list[dict[str, float]]:
    return [{"period": period, "phase": phase} for period in (0.03, 0.1) for phase in (0.0, 0.33, 0.67)]


def _twists(_: float) -> list[dict[str, float]]:
    sizes = (0.05, 0.2)
    return [{"mean": mean, "difference": difference} for mean in sizes for difference in sizes]


RECORDS = (
    EffectRecord(
        name="asymmetric_dead_zone", site="actuation", stage="zone", step=statements.ASYMMETRIC_ZONE,
        words="a wheel's dead zone is wider in one direction than in the other",
        equation="D = D0 + a for u > 0, D0 - a for u < 0",
        kinds=(("push of each wheel", "1", "own push"),),
        source="Tao, Kokotovic 1996, Adaptive Control of Systems with Actuator Nonlinearities, ch. 2",
        parameters=_pair(UNIT, 0.15, 0.06),
        channels=BOTH,
        act=asymmetric_dead_zone, confused_with=("coulomb_friction",),
        search=Search((signed("right", 0.5), signed("left", 0.5))),
    ),
    EffectRecord(
        name="direction_gain", site="actuation", stage="motor", step=statements.DIRECTION,
        words="a wheel turns faster in one direction than in the other",
        equation="m -> (1 + g sign m) m",
        kinds=(("push of each wheel", "1", "own push"),),
        source="brush timing of motors; Borenstein, Everett, Feng 1996, Where am I?",
        parameters=_pair("", 0.2, 0.08, least=-1.0, most=1.0),
        channels=BOTH,
        act=direction_gain,
        search=Search((signed("right", 0.7), signed("left", 0.7))),
    ),
    EffectRecord(
        name="input_saturation", site="actuation", stage="command", step=statements.SATURATION, quantity="saturation",
        words="commands beyond a level have no further effect",
        equation="u -> clip(u, -s, s), or s tanh(u / s)",
        kinds=(("push of each wheel", "1", "own push"),),
        source="Franklin, Powell, Emami-Naeini, Feedback Control, ch. 9",
        parameters=(Parameter("level", UNIT, float("inf"), (0.3, 1.0), 0.6, least=0.0, above=True),
                    Parameter("soft", "", 0.0, (0.0, 1.0), 0.0, least=0.0, most=1.0, shape=True,
                              forms=("cut off at the level", "bent towards the level"))),
        channels=BOTH,
        act=input_saturation, rank=1, smooth=False, grid=(0.95, 0.9, 0.8, 0.7, 0.6, 0.5),
        search=Search((Coordinate("level", OFF, 0.05, OFF, 0.5),
                       Coordinate("soft", 0.0, 0.0, 1.0, 1.0, shape=True, stepped=True)), all_or_nothing=True,
                      seeds=_levels),
    ),
    EffectRecord(
        name="input_quantisation", site="actuation", stage="command", step=statements.QUANTISATION,
        words="commands act in steps",
        equation="u -> q round(u / q), or q trunc(u / q)",
        source="Widrow, Kollar 2008, Quantization Noise; ISO/IEC 9899 (C), 6.3.1.4: casts drop the fraction",
        parameters=(Parameter("step", UNIT, 0.0, (0.01, 0.25), 0.15, least=0.0),
                    Parameter("towards_zero", "", 0.0, (0.0, 1.0), 0.0, least=0.0, most=1.0, shape=True,
                              forms=("to the nearest step", "towards zero"))),
        channels=BOTH,
        act=input_quantisation, rank=3, smooth=False, grid=(0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25),
        search=Search((positive("step", 0.6, stepped=True, reach=(1e-2, 2e-3, 2e-4), relative=True),
                       Coordinate("towards_zero", 0.0, 0.0, 1.0, 1.0, shape=True, stepped=True)),
                      seeds=_steps, suggested=Suggested("steps", _in_steps)),
    ),
    EffectRecord(
        name="input_rate_limit", site="actuation", stage="slew", step=statements.RATE_LIMIT,
        words="commands can change only so fast",
        equation="|u'| <= R, or c R where u moves towards 0",
        kinds=_LATE,
        source="slew limit of motor drivers; Franklin, Powell, Emami-Naeini, ch. 9",
        parameters=(Parameter("rate", f"{UNIT}/s", float("inf"), (1.0, 50.0), 5.0, least=0.0, above=True),
                    Parameter("falling_ratio", "", 1.0, (0.2, 1000.0), 1.0, least=0.0, above=True, shape=True)),
        channels=BOTH,
        act=input_rate_limit, fast=rate_limit_by_inverse, confused_with=("motor_lag",), smooth=False,
        grid=(50.0, 20.0, 10.0, 5.0, 2.0, 1.0), sharp=True,
        search=Search((positive("inverse_rate", 2.0), Coordinate("falling_time", 1.0, AT_ONCE, 5.0, 0.5, shape=True)),
                      Transform(_as_rates, _as_inverses),
                      lambda _: [{"inverse_rate": inverse} for inverse in (0.03, 0.07, 0.15, 0.3, 0.6)]),
    ),
    EffectRecord(
        name="transport_delay", site="actuation", stage="arrival", step=statements.DELAY, quantity="delay",
        words="commands act late, or the camera reports late",
        equation="u(t) -> u(t - T)",
        kinds=_LATE,
        source="radio, computing and camera latency; Astrom, Murray, Feedback Systems, ch. 10",
        parameters=(Parameter("delay", "s", 0.0, (0.0, 0.3), 0.05, least=0.0),),
        channels=BOTH,
        act=transport_delay, confused_with=("motor_lag",),
        search=Search((positive("delay", 0.5),)),
    ),
    EffectRecord(
        name="motor_lag", site="actuation", stage="gear", step=statements.LAG, quantity="lag",
        words="the motors take time to follow",
        equation="m = q + tau q' + e tau^2 q'' / 4, gain q in place of gain m",
        kinds=_LATE,
        source="inductance and speed loop; Franklin, Powell, Emami-Naeini, ch. 2",
        parameters=(Parameter("time_constant", "s", 0.0, (0.0, 0.3), 0.06, least=0.0),
                    Parameter("second_order", "", 0.0, (0.0, 1.0), 0.0, least=0.0, most=1.0, shape=True)),
        channels=BOTH,
        act=lag, fast=lag_of_runs, memory=2, rank=1, confused_with=("transport_delay",),
        search=Search((positive("time_constant", 0.5), positive("second_order", 1.0, shape=True))),
    ),
    EffectRecord(
        name="backlash", site="actuation", stage="gear", step=statements.PLAY,
        words="play in the gears, crossed whenever the push turns round",
        equation="p' = m - c n, |p| <= b / 2: where it touches neither side, c n in place of m",
        source="Nordin, Gutman 2002, Controlling mechanical systems with backlash, Automatica 38",
        parameters=(*_pair(f"{UNIT} s", 0.2, 0.05, least=0.0),
                    Parameter("coasting", "", 0.0, (0.0, 1.0), 0.0, least=0.0, most=1.0, shape=True,
                              forms=("a free wheel brakes", "a free wheel rolls on"))),
        channels=BOTH,
        act=play, fast=play_of_runs, confused_with=("transport_delay",), smooth=False,
        grid=(0.005, 0.01, 0.02, 0.05, 0.1, 0.2), sharp=True,
        search=Search((positive("right", 0.5), positive("left", 0.5),
                       Coordinate("coasting", 0.0, 0.0, 1.0, 1.0, shape=True, stepped=True, by_drive=True)),
                      seeds=lambda _: [{}, {"right": 0.02, "left": 0.02, "coasting": 1.0}]),
    ),
    EffectRecord(
        name="supply_sag", site="actuation", stage="motor", step=statements.SAG,
        words="the supply gives way when both motors draw",
        equation="m -> m / (1 + s (|u_r| + |u_l|))",
        source="inner resistance of batteries; Plett 2015, Battery Management Systems, ch. 2",
        parameters=(Parameter("resistance", f"1/{UNIT}", 0.0, (0.0, 0.3), 0.1, least=0.0),),
        channels=BOTH,
        act=supply_sag, rank=1, confused_with=("input_saturation",),
        search=Search((positive("resistance", 1.0),)),
    ),
    EffectRecord(
        name="lost_commands", site="actuation", stage="command",
        words="some commands never arrive",
        equation="u_k -> u_{k-1} with probability p",
        source="radio links; Schenato et al. 2007, Foundations of control over lossy networks, Proc. IEEE 95",
        parameters=(Parameter("probability", "", 0.0, (0.0, 0.5), 0.3, least=0.0, most=1.0),),
        channels=BOTH,
        act=lost_commands, confused_with=("transport_delay",), smooth=False, grid=(0.01, 0.02, 0.05, 0.1, 0.2),
        extension=True,
        chance=Chance("lost", keys=(0,)),
    ),
    EffectRecord(
        name="command_polling", site="actuation", stage="arrival", step=statements.POLLING,
        words="the base reads its commands now and then: each acts from the next reading on",
        equation="u(t) -> u(t_k) from t_k = (k + phi) P on, t_k >= t the first such moment of session time",
        source="buses and radios with frames of their own; Nilsson, Bernhardsson, Wittenmark 1998, Automatica 34",
        parameters=(Parameter("period", "s", 0.0, (0.01, 0.3), 0.1, least=0.0),
                    Parameter("phase", "", 0.0, (0.0, 1.0), 0.4, least=0.0, most=1.0, shape=True)),
        channels=BOTH,
        act=command_polling, rank=1, confused_with=("transport_delay", "motor_lag"), smooth=False,
        grid=(0.02, 0.05, 0.1, 0.2), timed=True, extension=True,
        search=Search((positive("period", 0.5, stepped=True),
                       Coordinate("phase", 0.0, 0.0, 1.0, 0.5, shape=True, reach=(0.3, 0.04))), seeds=_polls),
    ),
    EffectRecord(
        name="twist_quantisation", site="actuation", stage="command", step=statements.TWIST,
        words="the base is told speed and turn rate in whole steps",
        equation="(u_r + u_l) / 2 -> q_v round((u_r + u_l) / (2 q_v)), u_r - u_l -> q_w round((u_r - u_l) / q_w)",
        source="Widrow, Kollar 2008, Quantization Noise; iRobot Create Open Interface (whole mm/s)",
        parameters=(Parameter("mean", UNIT, 0.0, (0.01, 0.25), 0.15, least=0.0),
                    Parameter("difference", UNIT, 0.0, (0.01, 0.5), 0.2, least=0.0)),
        channels=BOTH,
        act=twist_quantisation, rank=2, confused_with=("input_quantisation",), smooth=False,
        grid=(0.01, 0.02, 0.05, 0.1, 0.15, 0.2), extension=True,
        search=Search((positive("mean", 0.6, stepped=True), positive("difference", 0.6, stepped=True)), seeds=_twists),
    ),
)  # fmt: skip
"""The effects of this site."""
