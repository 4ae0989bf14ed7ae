"""What a diagnosis speaks of, in words for people who never saw the package."""

from collections.abc import Iterable, Mapping
from math import floor, isfinite, log10

from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.effect import UNIT, Parameter
from jaxident.report.page import NOTHING

SPACE, MINUS = "\N{NO-BREAK SPACE}", "\N{MINUS SIGN}"

EFFECTS = {name: record.words for name, record in CATALOGUE.items()}
"""Each effect of the catalogue in plain words."""

SITES = {
    "actuation": "from the command to the motor",
    "drive": "motors, friction and inertia",
    "contact": "between wheels and floor",
    "time": "changes during the session",
    "camera": "the measurement of the pose",
}

LOOKS = {
    "actuation": "something between the command and the motors",
    "drive": "something in the motors, their friction or the inertia",
    "contact": "something between wheels and floor",
    "time": "something that changes during the session",
    "camera": "something in how the pose is measured",
}
"""What a gap of each site looks like, within a sentence."""

CHANNELS = {"along": "in the direction of travel", "lateral": "sideways", "heading": "in heading"}

VARIABLES = {
    "u_r": ("right command", UNIT, 1),
    "u_l": ("left command", UNIT, 1),
    "|u|": ("mean size of commands", UNIT, 1),
    "largest |u|": ("largest command", UNIT, 1),
    "v": ("speed", "m/s", 0),
    "w": ("turn rate", "rad/s", 0),
    "|v|": ("size of the speed", "m/s", 0),
    "|w|": ("size of the turn rate", "rad/s", 0),
    "v w": ("speed times turn rate", "m rad/s²", 0),
    "w^2": ("turn rate squared", "rad²/s²", 0),
    "reversals": ("changes of a command's sign", "", 0),
    "rest": ("share of commands near zero", "", 0),
    "heading": ("heading", "rad", 0),
    "x": ("position x", "m", 0),
    "y": ("position y", "m", 0),
    "session time": ("session time", "s", 0),
}
"""Variables of the map: in words, unit, and the power of the largest command that brings them to the user's unit."""

NOMINAL: dict[str, tuple[str, str]] = {
    "rate_1": ("how fast the speed settles", "1/s"),
    "rate_2": ("how fast the turn rate settles", "1/s"),
    "gain_11": ("right motor to forward acceleration", f"m/s²/{UNIT}"),
    "gain_12": ("left motor to forward acceleration", f"m/s²/{UNIT}"),
    "gain_21": ("right motor to turning acceleration", f"rad/s²/{UNIT}"),
    "gain_22": ("left motor to turning acceleration", f"rad/s²/{UNIT}"),
    "dead_zone_r": ("dead zone of the right wheel", UNIT),
    "dead_zone_l": ("dead zone of the left wheel", UNIT),
    "coupling_1": ("turn rate to forward acceleration", "m/s²/(rad/s)"),
    "coupling_2": ("speed to turning acceleration", "rad/s²/(m/s)"),
}
"""The nominal parameters: in words, and their unit."""

NOISE = {
    "position": ("camera noise in position", "m"),
    "heading": ("camera noise in heading", "rad"),
    "correlation_time": ("memory of the camera's error", "s"),
    "slip_along": ("random slip, forward", "m/s^1.5"),
    "slip_heading": ("random slip, turning", "rad/s^1.5"),
    "wheel_radius": ("radius of a wheel, as its speed shows it", "m"),
    "wheel_track": ("distance of the wheels, as their speeds show it", "m"),
    "wheel_noise": ("noise of a wheel's speed", "rad/s"),
}
"""The numbers of the noise law and of the wheels as a second sensor: in words, and their unit."""

DIFFERENCE = {
    "alpha_1": ("part of the path length that stays to the next row", ""),
    "alpha_2": ("part of the turn that stays to the next row", ""),
    "delta_1": ("motor to path length, one row later", f"m/{UNIT}"),
    "delta_2": ("motor to turn, one row later", f"rad/{UNIT}"),
    "epsilon_1": ("motor to path length, two rows later", f"m/{UNIT}"),
    "epsilon_2": ("motor to turn, two rows later", f"rad/{UNIT}"),
}
"""The numbers of the difference equations, numerators by their channel: in words, and their unit."""


def about(parameter: str) -> tuple[str, str]:
    """A parameter of any form of the model in words, and its unit; empty for a name that is none."""
    every = NOMINAL | NOISE | DIFFERENCE
    return every.get(parameter) or every.get(parameter[:-1], ("", ""))


def plain(name: str) -> str:
    """An effect's name as words; a name that is none of the catalogue's stands as it is."""
    return name.replace("_", " ")


def together(names: Iterable[str], word: str = "and") -> str:
    """Names of effects in a row: a, b and c."""
    *most, last = [plain(name) for name in names] or [""]
    return f"{', '.join(most)} {word} {last}" if most else last


def number(value: float | None) -> str:
    """A number with three digits, whole ones in full."""
    if value is None or not isfinite(value):
        return NOTHING
    return f"{value:{'.0f' if 1e3 <= abs(value) < 1e6 else '.3g'}}".replace("-", MINUS)


def measured(value: float, deviation: float | None, unit: str = "") -> str:
    """A value ± its standard deviation of two digits, with unit."""
    behind = f"{SPACE}{unit}" if unit else ""
    if deviation is None or not isfinite(deviation) or deviation <= 0.0:
        return f"{number(value)}{behind}"
    digits = 1 - floor(log10(deviation))
    if digits > 6 or digits < 0:
        return f"{number(value)}{SPACE}±{SPACE}{number(deviation)}{behind}"
    value = round(value, digits) + 0.0  # no minus before a zero
    return f"{value:.{digits}f}{SPACE}±{SPACE}{deviation:.{digits}f}{behind}".replace("-", MINUS)


PARTS = {
    "camera": "camera noise",
    "start": "start not known better",
    "slip": "random slip",
    "discovered": "discovered",
    "rest": "not explained",
}
"""Parts of an error that no effect causes."""


def part(name: str) -> str:
    """A part of an error in words."""
    return PARTS.get(name, plain(name))


def length(metres: float) -> str:
    """A length in millimetres with two or three digits."""
    return f"{_short(1e3 * metres)}{SPACE}mm"


def angle(radians: float) -> str:
    """An angle in milliradians with two or three digits."""
    return f"{_short(1e3 * radians)}{SPACE}mrad"


def error(pair: tuple[float, float]) -> str:
    """An error in position [m] and heading [rad]."""
    return f"{length(pair[0])} and {angle(pair[1])}"


def plain_text(text: str) -> str:
    """A text for terminals of any encoding."""
    return text.replace(SPACE, " ").replace(MINUS, "-").replace("²", "^2").replace("±", "+-")


def _short(value: float) -> str:
    return f"{value:{'.0f' if abs(value) >= 99.95 else '.2g' if abs(value) < 9.95 else '.3g'}}".replace("-", MINUS)


def parameters(name: str, values: Mapping[str, float], deviations: Mapping[str, float] | None = None) -> str:
    """The parameters of an effect with units: "limit 0.698 ± 0.001 unit, a tyre that yields". A shape that is neutral
    and has no deviation is left out."""
    known = {parameter.name: parameter for parameter in CATALOGUE[name].parameters}
    deviations, said = deviations or {}, []
    for key in values:
        parameter, value = known[key], float(values[key])
        if value in (0.0, 1.0) and parameter.forms:
            said.append(parameter.forms[int(value)])
        elif not parameter.shape or value != parameter.neutral or deviations.get(key):
            said.append(f"{plain(key)} {_parameter(parameter, value, deviations.get(key))}")
    return ", ".join(said)


def _parameter(parameter: Parameter, value: float, deviation: float | None) -> str:
    apart = value - parameter.neutral
    if deviation is None and isfinite(apart) and parameter.neutral and 0.0 < abs(apart) < 0.1:
        digits = 1 - floor(log10(abs(apart)))
        return f"{value:.{digits}f}"  # a ratio of 1.002 is not 1
    return measured(value, deviation, parameter.unit.replace("^2", "²"))


def percent(share: float | None) -> str:
    """A share in whole per cent."""
    if share is None or not isfinite(share):
        return NOTHING
    return f"{round(100.0 * share)}{SPACE}%".replace("-", MINUS)


def chance(probability: float) -> str:
    """A probability in whole per cent, never quite none nor all."""
    if 0.0 < probability < 0.005:
        return f"<{SPACE}1{SPACE}%"
    return f">{SPACE}99{SPACE}%" if 0.995 < probability < 1.0 - 1e-9 else percent(probability)
