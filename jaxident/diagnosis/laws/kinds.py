"""Kinds of laws that are looked for: where each acts, what it depends on, what of it the nominal robot has as well."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.effects.catalogue import BY_KIND
from jaxident.effects.law_kinds import (
    AHEAD,
    ALONG,
    ANGLE,
    BY_CAMERA,
    CHANGES,
    DIRECTIONS,
    HEADING,
    HEATS,
    LEFT,
    PUSHES,
    REVERSALS,
    ROLLINGS,
    SENSE,
    SIDEWAYS,
    TURN,
    WHEELS,
)

OF_FORCE = ("v", "w", "heading", "x", "y", "time", "push right", "push left", "since reversal")
ELSEWHERE = ("heading", "x", "y", "time", "since reversal")
"""Of what is no speed."""
SITE_OF_SIGNAL = {
    "v": "drive", "w": "drive", "heading": "contact", "x": "contact", "y": "contact", "time": "time",
    "push right": "actuation", "push left": "actuation", **dict.fromkeys(REVERSALS, "contact"),
    "own speed": "drive", "own push": "actuation", ANGLE: "drive", **dict.fromkeys([*HEATS, *CHANGES], "actuation"),
}  # fmt: skip
"""The site of a law that acts on accelerations or pushes, by its signal, unless a curve is multiplied with how a
command has changed (`Kind.site`)."""
NOMINAL = ("v", "w", "push right", "push left", "own speed", "own push")
"""Signals on which a force of the nominal robot depends, in a straight line."""
FLOOR = ((ALONG, "1"), (ALONG, "v"), (ALONG, "cos heading"), (ALONG, "sin heading"), (HEADING, "1"), (HEADING, "w"),
         (HEADING, "v cos heading"), (HEADING, "v sin heading"), (SIDEWAYS, "v"), (TURN, "1"))  # fmt: skip
"""What may differ from place to place on the floor: a pull, rolling, the slope along x and along y, twist, turning,
what a nap turns a robot by that moves along x or y, drift, and the camera's heading."""


class Kind(NamedTuple):
    """Where a law acts, what its curve or surface is multiplied with, and what this depends on."""

    acts_on: str
    times: str
    signal: str
    second_signal: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """As an effect's record says in whose place it acts (`EffectRecord.kinds`)."""
        return tuple(filter(None, self))

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects of the catalogue in whose place such a law acts: it may be one of them in another form."""
        return BY_KIND.get(self.names, ())

    @property
    def site(self) -> str:
        """The site of the catalogue that such a law belongs to."""
        if self.acts_on in BY_CAMERA:
            return "camera"
        if self.acts_on == SIDEWAYS:
            return "contact"
        return "actuation" if self.times in (*CHANGES, SENSE) else SITE_OF_SIGNAL[self.signal]


KINDS = (
    *(Kind(act, "1", signal) for act in (ALONG, HEADING) for signal in OF_FORCE),
    *(Kind(act, "v", signal) for act in (ALONG, HEADING) for signal in ("w", *ELSEWHERE)),
    *(Kind(act, "w", signal) for act in (ALONG, HEADING) for signal in ("v", *ELSEWHERE)),
    *(Kind(act, *pair) for act in (ALONG, HEADING) for pair in zip(DIRECTIONS, REVERSALS, strict=True)),
    *(Kind(act, "v", since) for act in (ALONG, HEADING) for since in [*REVERSALS][1:]),
    *(Kind(SIDEWAYS, "v", signal) for signal in ("w", "heading", "x", "y", "time")),
    *(Kind(SIDEWAYS, "1", signal) for signal in ("w", "heading")),
    *(Kind(WHEELS, "1", signal) for signal in ("own speed", "own push")),
    *(Kind(WHEELS, "own push", signal) for signal in HEATS),
    *(Kind(WHEELS, change, signal) for change in CHANGES for signal in ("v", "w", "own speed")),
    *(Kind(WHEELS, "1", change) for change in CHANGES),
    *(Kind(WHEELS, SENSE, signal) for signal in ("own push", "own speed")),
    Kind(WHEELS, "1", "own speed", "own push"),
    *(Kind(act, "1", signal) for act in (AHEAD, LEFT, TURN) for signal in ("heading", "x", "y")),
    *(Kind(act, times, "x", "y") for act, times in FLOOR),
    *(Kind(act, "1", *pair) for act in (ALONG, HEADING) for pair in (("v", "w"), ("push right", "push left"))),
    *(Kind(act, times, ANGLE) for act in PUSHES for times in ("1", "own push")),
    *(Kind(act, "own speed", ANGLE) for act in ROLLINGS),
)
"""All that are tried. What stands as a product in two of them (v times a curve of w, w times one of v) stands twice."""


def at_knots(at: tuple[Any, ...]) -> list[np.ndarray]:
    """Each signal (knots,) at all knots of a law, row by row."""
    return [signal.ravel() for signal in np.meshgrid(*at, indexing="ij")]


def nominal_part(kind: Kind, at: tuple[Any, ...]) -> np.ndarray:
    """Values (knots, n) of laws that the nominal robot has itself: rates, couplings and gains."""
    signals = dict(zip(kind.names[2:], at_knots(at), strict=True))
    count = int(np.prod([len(knots) for knots in at]))
    if kind.signal == ANGLE:
        return np.ones((count, 1))
    if kind.acts_on not in (ALONG, HEADING, WHEELS):
        return np.zeros((count, 0))
    if kind.times != "1":
        return np.ones((count, int(kind.times in ("v", "w", "own push"))))
    return np.stack([np.zeros(count), *(s for name, s in signals.items() if name in NOMINAL)], axis=1)[:, 1:]
