"""The one record of an effect: what it is in words, its numbers, its law, and how a diagnosis looks for it.

How to add an effect
--------------------
1. Find its stage: the place in the chain from the command to the reported pose at which it acts. An effect is a pure
   function of what passes there, `act(signal, ..., **values)`, with its parameters as keywords:

   ===========  ===============================================  ==============================================
   stage        act(...)                                         what it changes
   ===========  ===============================================  ==============================================
   command      (u, **values) -> Wheels                          the command of each row, as it is sent
   arrival      (time, offset, **values) -> time                 when a command sent at a time [s] takes effect;
                                                                 time + offset is session time; never decreasing
   slew         (now, target, elapsed, **values) -> Wheels       the command, `elapsed` [s] after it was `now`
   zone         (zone, time, **values) -> Zone                   widths of the dead zones at a session time
   motor        (m, u, time, **values) -> Wheels                 pushes m of commands u at a session time
   gear         (push, memory, substep, **values) ->             pushes over a substep; memory is Wheels or a
                (Push, memory)                                   tuple of them (`memory`), 0 at rest
   friction     (n, **values) -> Wheels                          levels of dry friction at wheel speeds n
   grip         `Grip`: two functions                            what the ground takes of each wheel's push
   body         (motion, **values) -> Force                      accelerations of the whole robot
   load         `Load`: two functions                            the mass that all pushes have to move
   side         (v, w, **values) -> speed                        the speed to the left
   optics       (pose, **values) -> Pose                         the pose as the camera sees it
   frames       (pose, step, keys, **values) -> Pose             random errors of the camera's frames
   ===========  ===============================================  ==============================================

2. Write the function in the file of its site, and below it one `EffectRecord` in `RECORDS`. That is all: the catalogue,
   both integrators, the command line, model files, reports and the search read the record. No other line of the
   package names an effect.
3. Write the law once more as plain statements (`statements.Step`), for exports.
4. Give it twins, written from the equation and not from the code: in `tests/support/reference_effects.py`, and in the
   robots with hidden effects (`experiments/withheld`: `NEUTRAL` and `LAWS`). The tests that run over the whole
   catalogue then compare both integrators with them.

An effect that draws has `chance` in place of `search`, and takes `keys` before its values. Where the search has other
coordinates than the catalogue has parameters (a limit's inverse, say), `search.transform` leads to and fro, and `fast`
is the law in these coordinates. A law of stage `load` needs a `fast` form (see `signals.Load`). A law of stage `gear`
may have one for whole runs, `(push, drive, step, **values) -> Push`; without it `act` is scanned.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from jaxident.array_types import Array
from jaxident.effects.statements import Step

UNIT = "unit"
"""The unit of the motor command, which is the user's."""

ALONG, LATERAL, HEADING = "along", "lateral", "heading"
BOTH = (ALONG, HEADING)
EVERYWHERE = (ALONG, LATERAL, HEADING)

EDGE = 0.2
"""Part of a session, at its begin and at its end, in which no change at an instant is looked for: few windows tell it,
and it foretells all that follows. On half a log of a Create, a load that changed 19 s before the end of 443 s took the
error 10 s ahead on the other half from 41 to 107 mm. No other was tried."""


class Parameter(NamedTuple):
    """One number of an effect, as the catalogue, model files and the command line have it.

    neutral: the value at which the effect does nothing, or for a number that only shapes it (`shape`) its default.
    range: what real robots show, the bounds of a search. typical: a clear but not extreme case, for examples and
    pictures. least, most: what is refused outside; `above` refuses `least` itself. instant: a session time; where the
    session's duration is known, its middle is typical. forms: words for 0 and 1, where it chooses between two forms.
    """

    name: str
    unit: str
    neutral: float
    range: tuple[float, float]
    typical: float
    least: float = -math.inf
    most: float = math.inf
    above: bool = False
    shape: bool = False
    instant: bool = False
    forms: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """What values it takes, in words."""
        unit = f" {self.unit}" if self.unit else ""
        low = f"{'above' if self.above else 'at least'} {self.least:g}{unit}" if math.isfinite(self.least) else ""
        high = f"at most {self.most:g}{unit}" if math.isfinite(self.most) else ""
        typical = f"{self.range[0]:g} to {self.range[1]:g}{unit} on real robots"
        return "; ".join(part for part in (" and ".join(filter(None, (low, high))), typical) if part)


class Coordinate(NamedTuple):
    """One number of an effect as it is searched for: neutral, the bounds of the search, and a typical size.

    shape: it shapes an effect, whatever its size, and does nothing alone. silent: it does nothing alone. stepped: poses
    follow it in jumps, or it chooses between two forms, so that it is looked for on a grid alone. unseen: no log tells
    it, unless an effect acts on the speeds of axle or wheels. by_drive: above 0, what drives the wheels depends on the
    drive as well. reach: where -log p has many valleys, how far each further search for the best goes, in the
    coordinate's unit, or if `relative` as a part of it. below: no robot has values from here on. accelerates: an
    acceleration along (0) or in heading (1), told for a robot of the typical rate (`coordinates.ACCELERATIONS`).
    """

    name: str
    neutral: float
    low: float
    high: float
    size: float
    shape: bool = False
    silent: bool = False
    stepped: bool = False
    unseen: bool = False
    by_drive: bool = False
    reach: tuple[float, ...] = ()
    relative: bool = False
    below: float = math.inf
    accelerates: int | None = None


def signed(name: str, high: float, **more: Any) -> Coordinate:
    """A coordinate of either sign, neutral at 0."""
    return Coordinate(name, 0.0, -high, high, 0.3 * high, **more)


def positive(name: str, high: float, **more: Any) -> Coordinate:
    """A coordinate that is not negative, neutral at 0."""
    return Coordinate(name, 0.0, 0.0, high, 0.3 * high, **more)


Values = Mapping[str, float]
Seed = dict[str, float]


class Transform(NamedTuple):
    """From values of the coordinates to those of the parameters, and back."""

    to_catalogue: Callable[[Values], dict[str, float]]
    from_catalogue: Callable[[Values], dict[str, float]]


class Suggested(NamedTuple):
    """Seeds that a log itself suggests. by: what is looked for in it, `places` (x, y: all over the field that poses
    fill) or `steps` (of rounded commands, by the residuals; then 0, or 1 if towards zero). seed: from such a pair."""

    by: str
    seed: Callable[..., Seed]


class Search(NamedTuple):
    """How a diagnosis looks for an effect.

    transform: where the coordinates are not the parameters. seeds(duration): points {coordinate: value} from which it
    is looked for in a session of some duration [s]. Without seeds, or with a first one that is empty, the derivative at
    neutral says where to begin; further seeds then stand for other forms of the effect. on_speeds: it acts on the
    speeds of axle or wheels. all_or_nothing: its gain does not grow with its size.
    """

    coordinates: tuple[Coordinate, ...]
    transform: Transform | None = None
    seeds: Callable[[float], list[Seed]] | None = None
    suggested: Suggested | None = None
    on_speeds: bool = False
    all_or_nothing: bool = False

    @property
    def smooth(self) -> bool:
        """Whether a derivative at neutral tells what the effect would explain."""
        return self.seeds is None or not self.seeds(1.0)[0]


class Chance(NamedTuple):
    """An effect that needs random draws.

    kind: what a log shows of it, `lost` commands, a `memory` of the camera, an `outlier` or a `repeat` among the
    frames. keys: numbers of the random keys that it draws from; no two effects draw the same numbers. squares(late,
    **values): expected squares (starts, 3) that it leaves on single frames, where late[k] (starts, 3) is how far the
    pose is from that k + 1 frames before; None where they come from elsewhere.
    """

    kind: str
    keys: tuple[int, ...]
    squares: Callable[..., Array] | None = None


class EffectRecord(NamedTuple):
    """One effect of the catalogue.

    words: in plain words, as they follow the name in a report. equation: with the symbols of docs/how_it_works.md,
    primes for time derivatives. channels: those of along, lateral, heading in which it changes the movement from row to
    row, as the reported heading sees it. confused_with: effects that inputs separate badly. act, fast: its law (see
    above). rank: within a stage, the lower acts first; equal ones in the order of the catalogue.

    smooth: whether the simulation has a derivative by the parameters at neutral; where not, `grid` holds values of the
    first parameter to try instead. sharp: it has corners within a sample. varies: it changes while the command is held.
    timed: it goes by session time. extension: beyond the catalogue that this program was asked for. step: its law as
    statements for programs without this package; None where it draws. memory: how many numbers of each wheel a law of
    stage `gear` remembers. quantity: what simulators call it (`jaxident.export`). kinds: discovered laws (acts on,
    times, signals) in whose place it acts, so that one found there may be this effect in another form. poses_only: it
    acts on the camera's clock; no log without wheel speeds is searched for it. All have `search` or `chance`.
    """

    name: str
    site: str
    stage: str
    words: str
    equation: str
    parameters: tuple[Parameter, ...]
    channels: tuple[str, ...]
    source: str
    act: Any
    fast: Any = None
    search: Search | None = None
    chance: Chance | None = None
    confused_with: tuple[str, ...] = ()
    rank: int = 0
    smooth: bool = True
    grid: tuple[float, ...] | None = None
    sharp: bool = False
    varies: bool = False
    timed: bool = False
    extension: bool = False
    step: Step | None = None
    memory: int = 1
    quantity: str = ""
    kinds: tuple[tuple[str, ...], ...] = ()
    poses_only: bool = False

    @property
    def random(self) -> bool:
        """Whether it needs a key."""
        return self.chance is not None

    def own_keys(self, keys: Array) -> list[Array]:
        """The keys that it draws from, among those of all."""
        return [] if self.chance is None else [keys[number] for number in self.chance.keys]

    @property
    def law(self) -> Any:
        """Its law in the coordinates of the search."""
        return self.fast or self.act

    def neutral(self) -> dict[str, float]:
        """Parameters at which it does nothing, by name."""
        return {parameter.name: parameter.neutral for parameter in self.parameters}

    def typical(self, duration: float | None = None) -> dict[str, Any]:
        """Parameters of a clear but not extreme case, by name, for a session of some duration [s]."""
        middle = None if duration is None else 0.5 * duration
        return {p.name: p.typical if middle is None or not p.instant else middle for p in self.parameters}
