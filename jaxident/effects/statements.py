"""Laws of effects over one short step of time as plain statements, for programs that run without this package.

Each line is an assignment that Python and C read alike. `{name}` stands for a parameter of the effect or for a number
that it remembers (`Step.memory`, 0 at rest). Lines may use `fabs exp sin cos sqrt tanh ceil` and `clip(x, low, high)`,
`sign(x)`, `pick(condition, a, b)`, `round_even(x)`, scratch numbers `a b c d`, and these signals of their stage:

==========  ==========================================================================================
command     u_r, u_l: the command of a row
arrival     time: the session time [s] at which it takes effect
slew        u_r, u_l: the command in the middle of the step; dt [s]: its length
zone        f_r, f_l, b_r, b_l: widths of the dead zones forward and backward; time
motor       m_r, m_l: pushes of the commands u_r, u_l; time
gear        m_r, m_l: mean pushes over the step; n_r, n_l: the wheels' speeds in commands; dt
friction    k_r, k_l: levels of dry friction at speeds n_r, n_l
grip        c_r, c_l: what of each wheel's net push the ground takes
body        a_v, a_w: accelerations at v, w, theta
load        factor: what accelerations are multiplied with; time
side        aside: the speed to the left at v, w
optics      x, y, theta: the pose as the camera sees it; sn, cs: sine and cosine of theta
==========  ==========================================================================================

The tests hold each of them against the law in JAX.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple


class Step(NamedTuple):
    """Statements of one effect. memory: names of what it remembers. neutral: parameters that must be 0 for the
    statements to be its whole law."""

    lines: tuple[str, ...]
    memory: tuple[str, ...] = ()
    neutral: tuple[str, ...] = ()

    def holds(self, values: Mapping[str, Any]) -> bool:
        """Whether the statements are the whole law at these parameters."""
        return all(float(values.get(name, 0.0)) == 0.0 for name in self.neutral)


def _wheels(line: Callable[[str], str]) -> tuple[str, ...]:
    return line("r"), line("l")


def _rounded(name: str, value: str, step: str) -> str:
    return f"{name} = pick({step} > 0.0, round_even({value} / pick({step} > 0.0, {step}, 1.0)) * {step}, {value})"


def _quantised(s: str) -> tuple[str, ...]:
    """A command rounded to the nearest step, or towards zero."""
    return (
        f"a = u_{s} / pick({{step}} > 0.0, {{step}}, 1.0)",
        "a = pick({towards_zero} > 0.5, -sign(a) * ceil(-fabs(a)), round_even(a))",
        f"u_{s} = pick({{step}} > 0.0, a * {{step}}, u_{s})",
    )


SATURATION = Step(_wheels(lambda s: f"u_{s} = pick({{soft}} > 0.5, {{level}} * tanh(u_{s} / {{level}}), "
                                    f"clip(u_{s}, -{{level}}, {{level}}))"))  # fmt: skip
QUANTISATION = Step((*_quantised("r"), *_quantised("l")))
TWIST = Step((
    _rounded("a", "(0.5 * (u_r + u_l))", "{mean}"),
    _rounded("b", "(u_r - u_l)", "{difference}"),
    "u_r = a + 0.5 * b",
    "u_l = a - 0.5 * b",
))  # fmt: skip
DELAY = Step(("time = time + {delay}",))
POLLING = Step((
    "a = pick({period} > 0.0, {period}, 1.0)",
    "time = pick({period} > 0.0, (ceil(time / a - {phase} - 1e-6) + {phase}) * a, time)",
))  # fmt: skip


def _ramp(s: str, reach: str) -> str:
    """Where a command is that can rise by `reach`: it falls from b to c, which takes as long as to rise by d."""
    fallen = f"{{falling_ratio}} * ({reach})"
    return (f"pick(d > {reach}, b + clip(c - b, -{fallen}, {fallen}), "
            f"c + clip(u_{s} - c, d - {reach}, {reach} - d))")  # fmt: skip


RATE_LIMIT = Step((
    "a = {rate} * dt",
    *(line for s in "rl" for line in (
        f"b = {{now_{s}}}",
        f"c = clip(u_{s}, clip(b, -1e300, 0.0), clip(b, 0.0, 1e300))",
        "d = fabs(c - b) / {falling_ratio}",
        f"{{now_{s}}} = {_ramp(s, 'a')}",
        f"u_{s} = {_ramp(s, '0.5 * a')}",
    )),
), memory=("now_r", "now_l"))  # fmt: skip
GROWN = (
    "a = clip({growth} * time, -1e300, 3.0)",
    "b = pick(fabs(a) > 1e-4, {growth}, 1.0)",
    "c = pick(fabs(a) > 1e-4, (exp(a) - 1.0) / b, time * (1.0 + 0.5 * a))",
)
"""How far a drift has come whose speed grows: `session.grown`, with its two constants."""
ASYMMETRIC_ZONE = Step((
    "f_r = f_r + {right}", "b_r = b_r - {right}", "f_l = f_l + {left}", "b_l = b_l - {left}",
))  # fmt: skip
ZONE_DRIFT = Step((
    *GROWN, *(f"{width} = clip({width} + {{rate}} * c, 0.0, 1e300)" for width in ("f_r", "f_l", "b_r", "b_l")),
))  # fmt: skip
DIRECTION = Step(("m_r = m_r + {right} * fabs(m_r)", "m_l = m_l + {left} * fabs(m_l)"))
SAG = Step((
    "a = 1.0 / (1.0 + {resistance} * (fabs(u_r) + fabs(u_l)))",
    "m_r = m_r * a",
    "m_l = m_l * a",
))  # fmt: skip
GAIN_DRIFT = Step((
    *GROWN,
    "a = clip(1.0 + {rate} * c, 0.0, 1e300)",
    "m_r = m_r * a",
    "m_l = m_l * a",
))  # fmt: skip


def _pole(time_constant: str, memory: str) -> tuple[str, ...]:
    """What passes one pole of both wheels' lags, its push taken for held; memory: what passed at last."""
    return (
        f"a = {time_constant}",
        "b = pick(a > 0.0, exp(-dt / pick(a > 0.0, a, 1.0)), 0.0)",
        "c = a / dt * (1.0 - b)",
        *(line for s in "rl" for line in (
            f"d = {{{memory}_{s}}} - m_{s}",
            f"{{{memory}_{s}}} = m_{s} + d * b",
            f"m_{s} = m_{s} + d * c",
        )),
    )  # fmt: skip


_APART = "sqrt(clip(1.0 - {second_order}, 0.0, 1.0))"
"""Difference of the time constants of both poles over their sum, as `gears.poles` has it."""
LAG = Step(
    (
        *_pole(f"0.5 * {{time_constant}} * (1.0 + {_APART})", "q"),
        *_pole(f"0.5 * {{time_constant}} * (1.0 - {_APART})", "s"),
    ),
    memory=("q_r", "q_l", "s_r", "s_l"),
)
PLAY = Step(tuple(line for s, width in zip("rl", ("{right}", "{left}"), strict=True) for line in (
    f"a = {{coasting}} * n_{s}",
    f"b = m_{s} - a",
    f"c = clip(0.5 * {width} - sign(b) * {{p_{s}}}, 0.0, 1e300)",
    f"d = pick({width} > 0.0, clip(c / pick(fabs(b) > 0.0, fabs(b) * dt, 1e300), 0.0, 1.0), 0.0)",
    f"{{p_{s}}} = clip({{p_{s}}} + b * dt, -0.5 * {width}, 0.5 * {width})",
    f"m_{s} = a + (1.0 - d) * b",
)), memory=("p_r", "p_l"))  # fmt: skip
COULOMB = Step(("k_r = k_r + {right}", "k_l = k_l + {left}"))
STRIBECK = Step((
    "k_r = k_r + {right} * exp(-(n_r / {fade}) * (n_r / {fade}))",
    "k_l = k_l + {left} * exp(-(n_l / {fade}) * (n_l / {fade}))",
))  # fmt: skip
DRAG = Step(("a_v = a_v - {along} * v * fabs(v)", "a_w = a_w - {heading} * w * fabs(w)"))
MASS_OFFSET = Step(("a_v = a_v + {along} * w * w", "a_w = a_w - {heading} * v * w"))
TURN_LOSS = Step(("a_v = a_v - {loss} * fabs(w) * v",))
GRIP = Step(
    _wheels(lambda s: f"c_{s} = (1.0 - {{dry}}) * {{limit}} * tanh(c_{s} / {{limit}}) "
                      f"+ {{dry}} * clip(c_{s}, -{{limit}}, {{limit}})"),
    neutral=("spin",),
)  # fmt: skip
LATERAL = Step(("aside = aside - {slip} * v * w",))
SLOPE = Step(("a_v = a_v + {acceleration} * cos(theta - {direction})",))
PAYLOAD = Step(("factor = factor * pick(time >= {instant}, 1.0 / {ratio}, 1.0)",))
MARKER = Step(("x = x + {ahead} * cs - {left} * sn", "y = y + {ahead} * sn + {left} * cs"))
TURNED = Step(("theta = theta + {offset}",))
SCALE = Step(("x = x * (1.0 + 0.5 * {difference})", "y = y * (1.0 - 0.5 * {difference})"))
LENS = Step((
    "a = x - {centre_x}",
    "b = y - {centre_y}",
    "c = a * a + b * b",
    "c = {strength} * c * (1.0 + {edge} * c)",
    "x = x + c * a",
    "y = y + c * b",
))  # fmt: skip
TILT = Step(("a = 1.0 + {along_x} * x + {along_y} * y", "x = x / a", "y = y / a"))
