"""A robot as one header in C99 that needs only the C library: `--to c-header`."""

import math
from collections.abc import Iterable
from string import Template

from jaxident.effects.catalogue import CATALOGUE
from jaxident.export.c_difference import DIFFERENCE
from jaxident.export.c_templates import PHYSICAL
from jaxident.export.code import C, block, constants, difference_constants, laws, substeps
from jaxident.export.python import check_gain
from jaxident.export.split import COUPLING, DEAD_ZONE, EVERY, GAIN, RATE, Target, acts, values_of
from jaxident.export.text import origin
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model

TARGET = Target(
    "c-header", "this program",
    dict.fromkeys((GAIN, RATE, COUPLING, DEAD_ZONE), "its constants"),
    stages=EVERY, inside=True,
)  # fmt: skip
SPARE = 64
"""Commands that may be under way beyond those of the longest delay, for steps shorter than the period."""


def write(model: Model, effects: Iterable[Effect], head: str = "") -> str:
    """The text of the header: the model with these of its effects. InputError for a drive whose gain has no inverse."""
    lines = "\n".join(f" * {line}" for line in filter(None, (head, *origin(model))))
    check_gain(model)
    if not isinstance(model.dynamics, Physical):
        return Template(DIFFERENCE).substitute(difference_constants(model), HEAD=lines)
    chosen = tuple(effects)
    found = laws(chosen, C)
    words = {stage.upper(): block(own, 4) for stage, own in found.stages.items()}
    words["MEMORY"] = block([f"double {name};" for name in found.memory], 4)
    words["FORGET"] = block([f"robot->{name} = 0.0;" for name in found.memory], 4)
    words["ROUNDS"] = "3" if found.stages["friction"] else "1"
    words["QUEUE"] = str(SPARE + 4 * math.ceil(_latest(chosen) / float(model.sample_period)))
    count = str(substeps(model, model.dynamics, chosen, float(model.sample_period)))
    return Template(PHYSICAL).substitute(constants(model, model.dynamics), SUBSTEPS=count, HEAD=lines, **words)


def _latest(effects: Iterable[Effect]) -> float:
    """How late a command may act [s]; the first parameter of every effect of that stage is a time."""
    late = [one for one in effects if CATALOGUE[one.name].stage == "arrival" and acts(one)]
    return sum(values_of(one)[CATALOGUE[one.name].parameters[0].name] for one in late)
