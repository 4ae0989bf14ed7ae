"""What a Monte-Carlo study runs over: its axes, its robots, its estimators, and whether they make sense."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

from jaxident.effects.checks import check_delay, check_effects
from jaxident.effects.law_kinds import check_discovered
from jaxident.errors import InputError
from jaxident.robot.excitation import EXCITATIONS
from jaxident.robot.model import Effect, Model, require_physical
from jaxident.study.estimators import DIAGNOSE, check_choice
from jaxident.study.sight import Choice

AXES = ("excitation", "samples", "robot", "effect", "period", "amplitude", "noise", "seed")
"""The axes of a study's trials in their order, the last one fastest; `effect` where a study has `effects`, else not."""

PARTS = ("rate", "gain", "coupling", "dead_zone")
"""The parts of a robot that a study may scale or spread."""

SMALLEST_RUN, LONGEST_RUN = 20, 10_000_000
"""Rows of a run, and of all runs of a trial: the longest lasts a day at 100 Hz."""
LONGEST_NAME = 300
"""Characters of a name; a picture grows with it."""
MOST_TRIALS = 100_000_000
"""Trials of a study: some 200 bytes are kept of each and estimator, 20 GB in all."""
CHUNK = 2000
HEADING_PER_POSITION = 10.0
"""Heading noise for each metre of position noise [rad/m]: 10 mrad at 1 mm, an overhead camera's usual ratio."""


class Candidate(NamedTuple):
    """A robot of the study: a name, a model in physical parameters with or without effects, and by what part of itself,
    at most, each of PARTS departs from it, drawn anew for every seed (uniform, the same for all other axes)."""

    name: str
    model: Model
    spread: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


class EffectSet(NamedTuple):
    """An entry of a study's axis of effects: its name, and the effects that it adds to every robot, none for the robots
    as they are."""

    name: str
    effects: tuple[Effect, ...] = ()


class Study(NamedTuple):
    """A Monte-Carlo study: every combination of its axes, each with `seeds` seeds, each seen by every estimator.

    Attributes:
        robots: candidates, each a model by its name.
        estimators: each with its settings.
        seeds: number of seeds in each cell.
        noise: standard deviations of the camera's position [m].
        heading_per_position: those of its heading are so many times as large [rad/m].
        correlation_time: memory of both [s], None for white noise.
        excitations: names of `EXCITATIONS`.
        hold: samples that a level of the excitation lasts.
        samples: rows of a run.
        period: sample periods [s].
        amplitude: largest commands [unit of the command].
        seed: the number that all random draws follow from.
        name: what results are called.
        chunk: trials computed and stored together, which bounds the memory.
        effects: sets that are added to every robot in turn, under the same random numbers. Without them robots have
            their own effects alone, and the trials have no axis `effect`.
        runs: how many a trial has, each of `samples` rows from rest under commands of its own. Estimators see all of
            them, as one log.
    """

    robots: tuple[Candidate, ...]
    estimators: tuple[Choice, ...]
    seeds: int
    noise: tuple[float, ...]
    excitations: tuple[str, ...] = ("multilevel",)
    amplitude: tuple[float, ...] = (1.0,)
    samples: tuple[int, ...] = (1000,)
    period: tuple[float, ...] = (1.0 / 30.0,)
    hold: int = 20
    heading_per_position: float = HEADING_PER_POSITION
    correlation_time: float | None = None
    seed: int = 0
    name: str = "study"
    chunk: int = CHUNK
    effects: tuple[EffectSet, ...] = ()
    runs: int = 1

    @property
    def axes(self) -> tuple[str, ...]:
        """Those of AXES that the study has, in their order."""
        return tuple(axis for axis in AXES if axis != "effect" or self.effects)

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of each of `axes`."""
        entries = (self.excitations, self.samples, self.robots, *([self.effects] if self.effects else []), self.period,
                   self.amplitude, self.noise)  # fmt: skip
        return (*map(len, entries), self.seeds)

    @property
    def in_force(self) -> tuple[tuple[tuple[Effect, ...], ...], ...]:
        """The effects of a trial by its place on the axes robot and effect; without the latter, one place there."""
        added = [one.effects for one in self.effects] or [()]
        return tuple(tuple((*one.model.effects, *more) for more in added) for one in self.robots)

    @property
    def effect_names(self) -> frozenset[str]:
        """Names of the effects that are in force in any trial."""
        return frozenset(effect.name for robot in self.in_force for effects in robot for effect in effects)

    @property
    def diagnoses(self) -> tuple[int, ...]:
        """Places of the estimators that are diagnoses."""
        return tuple(k for k, choice in enumerate(self.estimators) if choice.method == DIAGNOSE)

    @property
    def trials(self) -> int:
        """How many logs are simulated; each is seen by every estimator."""
        return math.prod(self.shape)


def check_study(study: Study, where: str = "study") -> None:
    """InputError naming the key, what is wrong and what would be right; `where` is what the line calls the study."""
    _check_name(study.name, f"{where}: name")
    _check_axes(study, where)
    for key, most in (("seeds", MOST_TRIALS), ("hold", LONGEST_RUN), ("chunk", MOST_TRIALS), ("runs", LONGEST_RUN)):
        if not 1 <= getattr(study, key) <= most:
            raise InputError(f"{where}: {key}: is {getattr(study, key)}; it should be at least 1 and at most {most}")
    if study.trials > MOST_TRIALS:
        raise InputError(f"{where}: seeds: with {study.seeds} the axes make {study.trials} trials; {MOST_TRIALS} are "
                         "the most: take fewer seeds, or cut the study into several")  # fmt: skip
    if study.heading_per_position < 0.0:
        raise InputError(f"{where}: heading_per_position: is {study.heading_per_position:g}; it should not be negative")
    if study.correlation_time is not None and not study.correlation_time > 0.0:
        raise InputError(f"{where}: correlation_time: is {study.correlation_time:g}; it should be above 0, or left out")
    duration = (min(study.samples) - 1) * min(study.period)
    for candidate in study.robots:
        _check_candidate(candidate, f"{where}: robot {candidate.name!r}", duration)
    _check_wheels([candidate.model for candidate in study.robots], f"{where}: robots")
    for one in study.effects:
        _check_set(one, study.robots, f"{where}: effects: {one.name!r}", duration)
    for choice in study.estimators:
        check_choice(choice, study.runs, f"{where}: estimator {choice.name!r}")


def _check_axes(study: Study, where: str) -> None:
    unknown = next((kind for kind in study.excitations if kind not in EXCITATIONS), None)
    if unknown is not None:
        raise InputError(f"{where}: excitations: {unknown!r} is not one of {', '.join(EXCITATIONS)}")
    names = [candidate.name for candidate in study.robots], [choice.name for choice in study.estimators]
    entries = {key: getattr(study, key) for key in ("excitations", "amplitude", "samples", "period", "noise")}
    for key, values in (entries | {"robots": names[0], "estimators": names[1]}).items():
        _check_axis(values, f"{where}: {key}")
    if study.effects:
        _check_axis([one.name for one in study.effects], f"{where}: effects")
    for key, values in (("amplitude", study.amplitude), ("period", study.period)):
        if min(values) <= 0.0:
            raise InputError(f"{where}: {key}: {min(values):g} is not above 0")
    if min(study.noise) < 0.0:
        raise InputError(f"{where}: noise: {min(study.noise):g} is negative; it is a standard deviation in metres")
    if min(study.samples) < SMALLEST_RUN:
        raise InputError(f"{where}: samples: {min(study.samples)} is too short; a run has at least {SMALLEST_RUN} rows")
    if max(study.samples) * study.runs > LONGEST_RUN:
        of_all = f" in {study.runs} runs" if study.runs > 1 else ""
        told = f"samples: {max(study.samples)}{of_all} is too long"
        raise InputError(f"{where}: {told}; a trial has at most {LONGEST_RUN} rows")


def _check_axis(values: Sequence[Any], where: str) -> None:
    if not values:
        raise InputError(f"{where}: is empty; it needs at least one entry")
    for value in values:
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{where}: every entry should be a finite number")
        if isinstance(value, str):
            _check_name(value, where)
    twice = next((value for value, count in Counter(values).items() if count > 1), None)
    if twice is not None:
        raise InputError(f"{where}: {twice!r} stands there twice; keep one")


def _check_name(name: str, where: str) -> None:
    if not (name.isprintable() and name.strip() and len(name) <= LONGEST_NAME):
        raise InputError(f"{where}: {name[:40]!r} is no name: it should have 1 to {LONGEST_NAME} letters, no control "
                         "characters")  # fmt: skip


def _check_candidate(candidate: Candidate, where: str, duration: float) -> None:
    """`duration` [s]: that of the shortest run."""
    try:
        require_physical(candidate.model)
        check_effects(candidate.model.effects)
        check_discovered(candidate.model.discovered)
        check_delay(candidate.model.effects, duration)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    bad = next((width for width in candidate.spread if not 0.0 <= width < 1.0), None)
    if bad is not None:
        raise InputError(f"{where}: spread: {bad:g} should be at least 0 and below 1")


def _check_wheels(models: Sequence[Model], where: str) -> None:
    sensors = [model.wheels for model in models if model.wheels is not None]
    if sensors and len(sensors) < len(models):
        raise InputError(f"{where}: {len(sensors)} of {len(models)} measure their wheels; all should, or none")
    if any(not float(sensor.noise) > 0.0 for sensor in sensors):
        raise InputError(f"{where}: wheels: noise should be above 0; without noise their speeds would outweigh all")


def _check_set(one: EffectSet, robots: Sequence[Candidate], where: str, duration: float) -> None:
    """`duration` [s]: that of the shortest run."""
    try:
        check_effects(one.effects)
        check_delay(one.effects, duration)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    names = {effect.name for effect in one.effects}
    for robot in robots:
        twice = next((effect.name for effect in robot.model.effects if effect.name in names), None)
        if twice is not None:
            raise InputError(
                f"{where}: robot {robot.name!r} has {twice!r} of its own already; take it out of one of the two"
            )
