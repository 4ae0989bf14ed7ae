"""Laws that some logs cannot show: there are too few windows, a signal hardly varies, or two go together everywhere."""

import itertools
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.laws.candidates import INSIDE, KNOTS, Path, hats, path_of
from jaxident.diagnosis.laws.kinds import OF_FORCE, Kind
from jaxident.diagnosis.motion.windows import Windows

FEWEST = 8
"""Windows that a curve needs: two for each stretch that is left out once."""
HARDLY = 0.05
"""A signal hardly varies if it spans less than this part of what it could span (`_could_span`). A robot that is told to
go straight turns at 0.02 of its fastest turn rate where its wheels' gains differ by 4 %. On five real Creates only the
time since a reversal hardly varies. No other value was tried."""
TOGETHER = 0.999
"""Two signals go together if a curve of either explains more than this part of the other's variance. On six runs of a
simulated robot that is led from place to place it is at most 0.56 for any two, on five real Creates no more than this.
No other value was tried."""


class NotShown(NamedTuple):
    """Why laws are not looked for. windows: how many there are, where these are too few for any; still: signals that
    hardly vary; together: pairs of signals each of which follows from the other."""

    windows: int | None = None
    still: tuple[str, ...] = ()
    together: tuple[tuple[str, str], ...] = ()

    def hides(self, kind: Kind) -> bool:
        """Whether these logs cannot show such a law."""
        untold = {*self.still, *itertools.chain(*self.together)}
        return self.windows is not None or not untold.isdisjoint({kind.signal, kind.second_signal})


def not_shown(fit: Solution, windows: Windows) -> NotShown:
    """What some windows cannot show, about a fit."""
    few = len(windows.run) < FEWEST
    return NotShown(len(windows.run)) if few else not_shown_along(path_of(fit, windows))


def not_shown_along(path: Path) -> NotShown:
    """Signals that hardly vary along a path, and pairs that go together."""
    seen = {name: path.signals[name].ravel() for name in OF_FORCE}
    span = {name: float(np.ptp(np.quantile(signal, INSIDE))) for name, signal in seen.items()}
    still = tuple(name for name, most in _could_span(path, span).items() if span[name] <= HARDLY * most)
    pairs = itertools.combinations([name for name in OF_FORCE if name not in still], 2)
    return NotShown(None, still, tuple(pair for pair in pairs if _follow(*(seen[name] for name in pair))))


def _could_span(path: Path, span: dict[str, float]) -> dict[str, Any]:
    """What a robot's signals could span with the largest commands. Speeds: from full speed backward to forward;
    heading: a turn; x and y: the longer of both spans, or a second at full speed if that is more; since reversal: a
    second."""
    speed, turning = 2.0 * np.abs(path.gain).sum(axis=1) / path.rates
    far = max(span["x"], span["y"], 0.5 * speed)
    return {"v": speed, "w": turning, "heading": 2.0 * np.pi, "x": far, "y": far, "push right": 2.0, "push left": 2.0,
            "since reversal": 1.0}  # fmt: skip


def _follow(one: Array, other: Array) -> bool:
    """Whether each of two signals is a curve of the other."""
    return all(_explained(*pair) > TOGETHER for pair in ((one, other), (other, one)))


def _explained(signal: Array, by: Array) -> float:
    """Part of a signal's variance that a curve of another explains."""
    low, high = np.quantile(by, INSIDE)
    shape = hats(by, np.linspace(low, high, KNOTS))
    size = np.linalg.lstsq(shape, signal, rcond=None)[0]
    return 1.0 - float(np.var(signal - shape @ size) / np.var(signal))
