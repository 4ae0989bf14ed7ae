"""The gap on windows kept for it: before, refitted, corrected; where it lies; how far each effect shrinks it."""

from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.causes.candidates import Finding
from jaxident.diagnosis.causes.search import Solution
from jaxident.diagnosis.causes.unexplained import UNEXPLAINED
from jaxident.diagnosis.extent.floor import REPLAYS, Floor, floor_of, wander_of
from jaxident.diagnosis.extent.gap import early_inverse, ends_of, last_errors, settle
from jaxident.diagnosis.extent.shrink import HIGH, LOW, Shrink, interval, shrink_of
from jaxident.diagnosis.extent.where import Place, increments, locate
from jaxident.diagnosis.motion.coordinates import COORDINATES, NOMINAL, PLACES, neutral_vector
from jaxident.diagnosis.motion.linear import Linear, follow, linearise
from jaxident.diagnosis.motion.responses import Responses, modelled_path, respond
from jaxident.diagnosis.motion.windows import Windows, cut
from jaxident.diagnosis.noise.doubt import Draws, draw_laws, sizes_by_memory
from jaxident.diagnosis.noise.law import Law, deviations, white_whitener
from jaxident.diagnosis.noise.sizing import Sized, sample
from jaxident.diagnosis.prepare import BURN, FEWEST, Prepared, first_starts, shows_start
from jaxident.errors import InputError
from jaxident.log import Log


class Gap(NamedTuple):
    """Mean squared pose error over the camera's variance at the horizon [s], three channels alike, on runs used for
    nothing else: the model as given, refitted, with the selected effects; the floor and its 90 % interval; the shrink.
    `placebo`: the shrink of an effect that nothing speaks for. errors (models, windows, 3): before, refitted, after."""

    horizon: float
    before: float
    refitted: float
    after: float
    floor: float
    floor_interval: tuple[float, float]
    shrink: Shrink
    placebo: tuple[str, Shrink] | None
    errors: Any
    replay: Floor

    @property
    def left(self) -> float:
        """The part of the refitted nominal model's error that the corrected one leaves, floor and all."""
        return self.after / max(self.refitted, 1e-9)

    @property
    def excess(self) -> float:
        """The corrected model's error, at the low end of its interval, over the high end of what noise makes."""
        errors = np.asarray(self.errors[2])
        seen = np.isfinite(errors).all(axis=1).any()
        return interval(errors)[0] / max(self.floor_interval[1], 1e-9) if seen else 0.0


def measure(prepared: Prepared, finding: Finding, given, common, seed: int = 0) -> tuple[Gap, Place, dict[str, Shrink]]:
    """The gap on windows kept for it, before and after, where it lies, and the shrink of each single effect; `given`
    (10,) or (SIZE,) is the model as given, `common` are effects that it has already."""
    windows = judging_windows(prepared, len(prepared.windows.step))
    best = finding.candidates[finding.selected].solution
    fitted = respond(np.exp(best.vector[:2]), best.linear.residual, finding.data.windows)
    law, draws = _laws(finding, best, fitted, seed)
    singles = {e[0]: c for e, c in finding.candidates.items() if len(e) == 1}
    base = _with(finding, common).vector
    told = base if given is None else np.concatenate([given, finding.nominal.vector[len(given) :]])
    vectors = np.stack([told, base, best.vector, *(c.solution.vector for c in singles.values())])
    responses, linear, starts = settled(best.vector, windows, law)
    residual = linear.residual
    inverse = early_inverse(law, windows, responses, BURN)
    found = last_errors(vectors, np.tile(starts, (len(vectors), 1, 1)), windows, law, inverse) ** 2
    ends = ends_of(linear.starts, inverse)
    own_inverse = early_inverse(law, finding.data.windows, fitted, BURN)
    replay = floor_of(residual, windows, law, draws, responses, ends, seed)
    least = None
    if finding.terms and law.slip is not None:
        # terms left over are regular: so may be what the law calls slip, and then it is still to explain
        steady = law._replace(slip=None, slip_time=None), draws.without_slip()
        least = floor_of(residual, windows, *steady, responses, ends, seed).replays

    def shrink(squares, solution: Solution) -> Shrink:
        wander = wander_of(solution, finding.data.windows, law, own_inverse, seed)
        return shrink_of(found[1], squares, replay, wander, seed, least)

    shrinks = {name: shrink(found[3 + k], c.solution) for k, (name, c) in enumerate(singles.items())}
    weakest = min(singles.values(), key=lambda c: c.gain, default=None)
    placebo = None if weakest is None else (weakest.effects[0], shrinks[weakest.effects[0]])
    low, high = (float(end) for end in np.quantile(replay.replays, [LOW, HIGH]))
    before, refitted, after = (float(value) for value in np.nanmean(found, axis=(1, 2))[:3])
    gap = Gap(prepared.horizon, before, refitted, after, replay.value, (low, high), shrink(found[2], best), placebo,
              found[:3], replay)  # fmt: skip
    floor = np.full(found[1].shape, np.nan)
    floor[np.asarray(windows.seen)[-1]] = replay.channels
    moved = moved_by(finding, common, starts, windows, law)
    return gap, locate(found[1], floor, residual, windows, moved, seed), shrinks


def _laws(finding: Finding, best: Solution, fitted: Responses, seed: int) -> tuple[Law, Draws]:
    """The law that the floor takes, and draws of laws as likely. Slip's memory is sized finely, unless something
    is left unexplained, which slip would take up."""
    data = finding.data
    given = sample(best.linear.residual, best.linear.starts, data.windows, fitted, data.use)
    unknown = finding.unexplained > UNEXPLAINED
    sizes = [Sized(finding.law, 0.0)] if unknown else sizes_by_memory(finding.likely, given)
    likeliest = max(sizes, key=lambda sized: sized.log_likelihood).law
    return likeliest, draw_laws(sizes, given, REPLAYS, seed)


def moved_by(finding: Finding, common: tuple[str, ...], starts, windows: Windows, law: Law) -> np.ndarray | None:
    """Squares (windows, 3) over the camera's variances of what the selected effects add to the movement along, sideways
    and in heading from row to row, all else alike; None without such effects or where they explain too little.

    The refitted nominal model's own error would say less: its parameters bend until some of what an effect does in
    one channel lies in another, and an error of heading soon lies sideways.
    """
    own = {name for name in finding.selected if name not in common}
    if not own or finding.unexplained > UNEXPLAINED:
        return None
    best = finding.candidates[finding.selected].solution.vector
    places = [place for (name, _), place in PLACES.items() if name in own]
    without = np.array(best)
    without[places] = neutral_vector(best[: len(NOMINAL)])[places]
    both = follow(np.stack([best, without]), np.stack([starts, starts]), windows)
    added = np.subtract(*(increments(modelled_path(residual, windows)) for residual in both))
    return np.sum(added**2, axis=2).T / deviations(law) ** 2


def _with(finding: Finding, common: tuple[str, ...]) -> Solution:
    """The fit with effects that a simulator has as well, as far as they shape the path; else the nominal one."""
    wanted = {name for name in common if name in COORDINATES}
    fits = (c.solution for effects, c in finding.candidates.items() if set(effects) == wanted)
    return next(fits, finding.nominal)


def judging_windows(prepared: Prepared, rows: int) -> Windows:
    """Windows of the runs that judge, overlapping by two thirds; of one or two runs, those that do not name. Without
    poses to start from a window does not judge. InputError where none is left."""
    windows = prepared.windows
    own = ~prepared.naming
    if len(np.unique(windows.run)) >= 3:
        windows = cut(blinded(prepared), rows, stride=max(rows // 3, 1), session=windows.session)
        own = windows.run % 3 == 1
    chosen = np.flatnonzero(own & shows_start(windows))
    if not chosen.size:
        raise InputError(f"no stretch of the runs kept for judging has {FEWEST} poses in its first {BURN} rows")
    return pick(windows, chosen, len(prepared.naming))


def blinded(prepared: Prepared) -> Log:
    """The log as the windows saw it."""
    hidden = prepared.frames.outlying
    x, y, theta = (np.where(hidden, np.nan, column) for column in prepared.log.pose)
    return prepared.log._replace(x=x, y=y, theta=theta)


def pick(windows: Windows, chosen, count: int) -> Windows:
    """Some windows, spread evenly if there are more than `count`; else filled up with unseen copies of the first, so
    that the program compiled for `count` serves them."""
    if len(chosen) > count:
        chosen = chosen[np.linspace(0, len(chosen) - 1, count).round().astype(int)]
    filled = np.concatenate([chosen, np.repeat(chosen[:1], count - len(chosen))])
    seen = np.array(windows.seen[:, filled])
    seen[:, len(chosen) :] = False
    seen[:2, len(chosen) :] = True  # a window without any pose has no start
    return windows._replace(step=windows.step[:, filled], pose=windows.pose[:, filled], seen=seen,
                            run=windows.run[filled], first=windows.first[filled])  # fmt: skip


def settled(vector: Array, windows: Windows, law: Law) -> tuple[Responses, Linear, np.ndarray]:
    """Responses, linearisation by start states and starts (5, windows) of windows under a model (SIZE,), start states
    from all their rows; its parameters stay, for these windows serve no fit."""
    white = white_whitener(law, windows)
    starts = settle(vector, first_starts(windows), windows, white**2)
    linear = linearise(vector, starts, windows, [])
    return respond(np.exp(vector[:2]), linear.residual, windows), linear, starts
