"""A robot as one file of Python that needs only the standard library: `--to python`, and the wrapper of commands that
stands beside the files of other targets.

One step integrates the drive by Runge and Kutta's method of order four under the mean push of each substep, in the
order of stages of `jaxident.effects.stages`. A model of free numerators takes one step of PAPER (13)-(14).
"""

from collections.abc import Iterable
from string import Template

import numpy as np

from jaxident.errors import InputError
from jaxident.export.code import PYTHON, block, constants, difference_constants, laws, substeps
from jaxident.export.python_difference import DIFFERENCE
from jaxident.export.python_templates import PHYSICAL
from jaxident.export.split import COUPLING, DEAD_ZONE, EVERY, GAIN, RATE, Target
from jaxident.export.text import number, origin
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model

TARGET = Target(
    "python", "this program",
    dict.fromkeys((GAIN, RATE, COUPLING, DEAD_ZONE), "its constants"),
    stages=EVERY, inside=True,
)  # fmt: skip
IN_FUNCTIONS = ("friction", "grip", "body", "side")
"""Stages that the template has in functions of the module, not in methods."""


def write(model: Model, effects: Iterable[Effect], head: str = "", period: float | None = None) -> str:
    """The text of the program: the model with these of its effects; period [s]: of its steps, the model's where none is
    given. InputError for a drive whose gain has no inverse."""
    lines = "\n".join(filter(None, (head, *origin(model))))
    check_gain(model)
    if not isinstance(model.dynamics, Physical):
        return Template(DIFFERENCE).substitute(difference_constants(model), HEAD=lines)
    chosen = tuple(effects)
    found = laws(chosen, PYTHON)
    indents = {stage: 4 if stage in IN_FUNCTIONS else 8 for stage in found.stages}
    words = {stage.upper(): block(own or ["pass"], indents[stage]) for stage, own in found.stages.items()}
    words["MEMORY"] = block([f"self.{name} = 0.0" for name in found.memory] or ["pass"], 8)
    words["ROUNDS"] = "3" if found.stages["friction"] else "1"
    step = float(model.sample_period) if period is None else period
    words |= {"PERIOD": number(step), "SUBSTEPS": str(substeps(model, model.dynamics, chosen, step))}
    return Template(PHYSICAL).substitute(constants(model, model.dynamics) | words, HEAD=lines)


def check_gain(model: Model) -> None:
    """InputError where two wheels do the same, or speeds never come to rest, so that no command can be computed for a
    wanted motion."""
    if model.physical is None and not np.all(np.abs(np.asarray(model.difference.alpha)) < 1.0):
        raise InputError(f"alpha: is {np.asarray(model.difference.alpha).tolist()}; an export needs poles below 1")
    matrix = np.asarray(model.physical.gain if model.physical else model.difference.delta - model.difference.epsilon)
    if not np.isfinite(matrix).all() or np.linalg.cond(matrix) > 1e12:
        raise InputError("gain: both wheels do the same; an export needs a robot that can drive and turn")
