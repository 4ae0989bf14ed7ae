"""What the Python and the C export have in common: the laws of effects as lines of either, and the model's numbers."""

import math
import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.full import SHARP_SUBSTEPS, SUBSTEPS
from jaxident.effects.stages import CHAIN
from jaxident.export.split import acts, values_of
from jaxident.export.text import number, signed
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model

FASTEST = 0.05
"""Largest product of a rate and a substep: one step of Runge and Kutta's method is then right to 3e-9 of the speed."""


class Language(NamedTuple):
    """How a line is written. held: before what is remembered. end: of a line. functions: {of the statements: own}."""

    held: str
    end: str
    functions: Mapping[str, str]


PYTHON = Language("self.", "", {})
C = Language("robot->", ";", {
    "clip": "robot_clip", "sign": "robot_sign", "pick": "robot_pick", "round_even": "rint",
})  # fmt: skip


class Laws(NamedTuple):
    """Lines of each stage, and the names of all numbers that the effects remember."""

    stages: Mapping[str, list[str]]
    memory: list[str]


def laws(effects: Iterable[Effect], language: Language) -> Laws:
    """The laws of effects that act and have statements, in the order in which they act."""
    own = {effect.name: effect for effect in effects if acts(effect)}
    stages: dict[str, list[str]] = {}
    memory: list[str] = []
    for stage, chain in CHAIN.items():
        stages[stage] = []
        for record in chain:
            if record.name not in own or record.step is None or not record.step.holds(values_of(own[record.name])):
                continue
            names = {name: f"{record.name}_{name}" for name in record.step.memory}
            words = {key: signed(value) for key, value in values_of(own[record.name]).items() if math.isfinite(value)}
            words |= {name: language.held + held for name, held in names.items()}
            stages[stage] += [_line(line.format(**words), language) for line in record.step.lines]
            memory += names.values()
    return Laws(stages, memory)


def _line(text: str, language: Language) -> str:
    for name, own in language.functions.items():
        text = re.sub(rf"\b{name}\(", f"{own}(", text)
    return text + language.end


def block(lines: Iterable[str], indent: int) -> str:
    """Lines one below the other, the first without its indent, as a placeholder that stands there already has it."""
    return f"\n{' ' * indent}".join(lines)


def substeps(model: Model, drive: Physical, effects: Iterable[Effect], period: float) -> int:
    """Substeps of a step [s]: as many as the package's own simulator takes for it, more for a fast drive."""
    found = [CATALOGUE[effect.name] for effect in effects if acts(effect)]
    least = SHARP_SUBSTEPS if found else SUBSTEPS
    fastest = max(float(rate) for rate in np.asarray(drive.rate))
    return math.ceil(max(least * min(period / float(model.sample_period), 1.0), fastest * period / FASTEST))


def constants(model: Model, drive: Physical) -> dict[str, str]:
    """The numbers of a physical model by the names of the templates."""
    gain, rate = np.asarray(drive.gain, float), np.asarray(drive.rate, float)
    coupling = np.zeros(2) if drive.coupling is None else np.asarray(drive.coupling, float)
    inverse = np.linalg.inv(gain)
    found = {"PERIOD": model.sample_period, "RATE_V": rate[0], "RATE_W": rate[1], "COUPLING_V": coupling[0],
             "COUPLING_W": coupling[1], "ZONE_R": model.dead_zone[0], "ZONE_L": model.dead_zone[1]}  # fmt: skip
    for name, matrix in (("GAIN", gain), ("INVERSE", inverse)):
        for row, channel in enumerate("VW" if name == "GAIN" else "RL"):
            for column, end in enumerate("RL" if name == "GAIN" else "VW"):
                found[f"{name}_{channel}{end}"] = matrix[row, column]
    return {key: number(value) for key, value in found.items()}


def difference_constants(model: Model) -> dict[str, str]:
    """The numbers of a model of free numerators by the names of the templates."""
    alpha, delta, epsilon = (np.asarray(part, float) for part in model.difference)
    inverse = np.linalg.inv((delta - epsilon) / (1.0 - alpha)[:, None])
    found = {"PERIOD": model.sample_period, "ZONE_R": model.dead_zone[0], "ZONE_L": model.dead_zone[1]}
    for row, channel in enumerate("VW"):
        found[f"ALPHA_{channel}"] = alpha[row]
        for column, wheel in enumerate("RL"):
            found[f"DELTA_{channel}{wheel}"] = delta[row, column]
            found[f"EPSILON_{channel}{wheel}"] = epsilon[row, column]
            found[f"INVERSE_{wheel}{channel}"] = inverse[column, row]
    return {key: number(value) for key, value in found.items()}
