"""A model to a target: what each part becomes, the file, and the commands' wrapper beside it."""

import os
import pathlib
from collections.abc import Mapping
from typing import NamedTuple

from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.checks import check_effects
from jaxident.effects.law_kinds import check_discovered
from jaxident.errors import InputError
from jaxident.export import c_header, gap, gazebo, isaac, mjcf, python, robot_localization, ros2_control, table
from jaxident.export.ask import Ask, assumed, check, largest_command, reach, unused
from jaxident.export.split import WRAPPER, Part, Target, inside_wrapper, split, values_of
from jaxident.export.wheels import MASS, Robot, robot_of
from jaxident.files.atomic import check_target, write_text
from jaxident.files.models import load_model
from jaxident.robot.model import Model

TARGETS: dict[str, Target] = {
    module.TARGET.name: module.TARGET
    for module in (mjcf, gazebo, isaac, ros2_control, robot_localization, c_header, python, table)
}
"""Every target by its name."""
COMMANDS_FILE = "_commands.py"
"""What the wrapper's name ends in, after the name of the export without its suffix."""
ORDINARY_COMMAND = 1.0
"""Largest command of the default input where nobody tells one."""

LONGEST_DELAY = 100.0
"""[s]; the longest range of the catalogue is 0.3 s."""

USE = {
    "mjcf": "Wrapper for MuJoCo: before each mj_step, robot.step(u_r, u_l, timestep) and ctrl = robot.m_r, robot.m_l.",
    "isaac": "Wrapper for Isaac Lab: before each step, robot.step(u_r, u_l, dt); pushes are robot.m_r, robot.m_l.",
    "gazebo": "Wrapper for Gazebo: after each robot.step(u_r, u_l), publish robot.v and robot.w as cmd_vel.",
    "ros2_control": "Wrapper for ros2_control: robot.command(v, w, a_v, a_w) gives the commands for wanted speeds.",
    "robot_localization": "Wrapper for robot_localization: robot.step(u_r, u_l), then robot.goal() as cmd_vel.",
}
"""What the head of a wrapper says."""


class Export(NamedTuple):
    """An exported model.

    Attributes:
        text: of the file.
        commands: of the wrapper of commands, None where none is needed.
        parts: what each part of the model became.
        assumed: sentences on what the model does not tell.
    """

    text: str
    commands: str | None
    parts: list[Part]
    assumed: list[str]


def export(
    model: Model | str | os.PathLike,
    to: str,
    path: str | os.PathLike | None = None,
    *,
    wheel_radius: float | None = None,
    track: float | None = None,
    mass: float | None = None,
    limit: float | None = None,
    command_unit: str = "unit",
    diagnosis: str | os.PathLike | None = None,
) -> Export:
    """Export a model to a simulator, a controller or a program without this package.

    Args:
        model: the model, or its file.
        to: the target, one of `TARGETS`.
        path: where to write it; the wrapper of commands goes beside it as `NAME_commands.py`. Without a path nothing is
            written.
        wheel_radius: [m], where the target needs it.
        track: distance of the wheels [m], where the target needs it. It is the robot's own, beside the one at which it
            moves.
        mass: [kg], where the target needs it.
        limit: the largest command [unit of the command].
        command_unit: "rad/s" or "m/s" if commands are wheel speeds.
        diagnosis: a diagnosis.json that knows what effects are worth, by default the one beside a model file.

    Returns:
        Export: the text, the wrapper, and how each part of the model is carried.

    Raises:
        InputError: an unknown target, a model that the target cannot hold, a size that makes no sense, or a file.

    Examples:
        >>> import jaxident as ji
        >>> ji.start_jax()
        >>> found = ji.export(ji.load_model("published"), "python")
        >>> found.parts[0].name, found.parts[0].how
        ('gain', 'field')
    """
    if to not in TARGETS:
        raise InputError(f"unknown target {to!r}; there are {', '.join(TARGETS)}")
    ask = Ask(wheel_radius, track, mass, limit, command_unit)
    check(ask)
    if path is not None:
        check_target(path)
    if not isinstance(model, Model):
        diagnosis = gap.beside(model) if diagnosis is None else diagnosis
        model = load_model(model)
    check_effects(model.effects)
    check_discovered(model.discovered)
    made = _made(model, TARGETS[to], ask, diagnosis, path)
    if path is not None:
        _write(made, path)
    return made


def commands_path(path: str | os.PathLike) -> pathlib.Path:
    """Where the wrapper beside an export stands."""
    file = pathlib.Path(path)
    return file.with_name(file.name.split(".")[0] + COMMANDS_FILE)


def _made(model: Model, target: Target, ask: Ask, diagnosis, path) -> Export:
    _check_physical(model, target)
    _check_delays(model)
    robot = robot_of(model, MASS if ask.mass is None else ask.mass, ask.wheel_radius) if target.needs_wheels else None
    parts = split(model, target, coupled=robot is None or robot.coupled)
    text = _text(model, target.name, ask, parts, robot, path)
    commands = None
    if any(part.how == WRAPPER for part in parts):
        period = mjcf.timestep(model) if target.name in ENGINES else None
        commands = python.write(model, inside_wrapper(model, parts), USE[target.name], period)
    most = largest_command(model, ask)
    parts = gap.measured(model, parts, diagnosis, ORDINARY_COMMAND if most is None else most)
    told = [] if robot is None else assumed(ask, robot, target)
    return Export(text, commands, parts, told + unused(ask, target))


ENGINES = ("mjcf", "isaac")
"""Targets whose wrapper works at each step of the engine."""


def _check_physical(model: Model, target: Target) -> None:
    """InputError where a target of wheels and rates gets the paper's free numerators."""
    if model.physical is None and not target.inside:
        raise InputError(
            f"physical: null; {target.title} needs rates and gains in seconds, and free numerators have none; "
            "`--to python`, `c-header` and `table` take them as difference equations"
        )
    if model.physical is None and model.effects:
        raise InputError("physical: null; a model of free numerators takes no effects")


def _check_delays(model: Model) -> None:
    """InputError for commands that come so late that no export can keep all that are under way."""
    for effect in model.effects:
        record = CATALOGUE[effect.name]
        late = values_of(effect)[record.parameters[0].name]
        if record.stage == "arrival" and late > LONGEST_DELAY:
            raise InputError(
                f"effect {effect.name!r}: {late:g} s; an export keeps commands for {LONGEST_DELAY:g} s at most"
            )


def _text(model: Model, to: str, ask: Ask, parts: list[Part], robot: Robot | None, path) -> str:
    own = [effect for effect in model.effects if any(part.name == effect.name for part in parts)]
    within = reach(model, ask) if model.physical is not None else None
    if robot is None:
        writers: Mapping[str, object] = {
            "python": lambda: python.write(model, own),
            "c-header": lambda: c_header.write(model, own),
            "table": lambda: table.write(model, str(path).endswith(".csv")),
            "robot_localization": lambda: robot_localization.write(model, within),
        }
    else:
        writers = {
            "mjcf": lambda: mjcf.write(model, parts, robot),
            "isaac": lambda: isaac.write(model, parts, robot),
            "gazebo": lambda: gazebo.write(model, parts, robot, ask, within),
            "ros2_control": lambda: ros2_control.write(model, robot, ask, within),
        }
    return writers[to]()  # type: ignore[operator]


def _write(made: Export, path: str | os.PathLike) -> None:
    """The wrapper first: an export never stands without it."""
    if made.commands is not None:
        beside = commands_path(path)
        if beside == pathlib.Path(path):
            raise InputError(f"{os.fspath(path)}: is the name of the wrapper beside the export; give another one")
        write_text(beside, made.commands)
    write_text(path, made.text)
