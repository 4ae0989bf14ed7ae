"""The gap on rows kept for judging: before, refitted, corrected; who causes it; where it lies; how far each effect
shrinks it."""

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from jaxident.array_types import Array
from jaxident.diagnosis.account.account import Account, account_of
from jaxident.diagnosis.account.discovered import Shown, confirm, each_law
from jaxident.diagnosis.account.floor import Floor, floor_of
from jaxident.diagnosis.account.models import placebo_of, players_of, with_players, without
from jaxident.diagnosis.account.needless import needless
from jaxident.diagnosis.account.refused import refused
from jaxident.diagnosis.account.shrink import HIGH, LOW, Shrink, interval, shrink_of
from jaxident.diagnosis.account.sized import REPLAYS, sized_corrected
from jaxident.diagnosis.account.where import Place, increments, locate
from jaxident.diagnosis.causes.discrepancy import UNEXPLAINED
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.noise.law import deviations
from jaxident.diagnosis.preparation.judging import Judged, judge_model
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.robot.model import Model


class Gap(NamedTuple):
    """Mean squared pose error over the camera's variance at the horizon [s], three channels alike, on rows used for
    nothing else: the model as given, refitted, with the selected effects, with the discovered laws as well; the floor
    and its 90 % interval; the shrink by the selected effects; `whole`: by the corrected model, which has the laws, too.
    `placebo`: the shrink of an effect that nothing speaks for. errors (models, starts, 3): of these four models, as
    squares over the camera's variances `unit` (3,) [m^2, m^2, rad^2]; paths (2, starts, rows, 3): poses that the
    refitted nominal model and the last of the four predict; noise: the floor of each start; run_up: starts of the
    corrected model where its filter did not converge."""

    horizon: float
    before: float
    refitted: float
    after: float
    discovered: float
    floor: float
    floor_interval: tuple[float, float]
    shrink: Shrink
    whole: Shrink
    placebo: tuple[str, Shrink] | None
    errors: Any
    paths: Any
    noise: Floor
    unit: Any
    run_up: int

    @property
    def rms(self) -> dict[str, tuple[float, float]]:
        """Root mean square errors in position [m] and heading [rad] of the models and of the floor; `discovered` is
        `after` where nothing is discovered."""
        kept = np.isfinite(self.errors).all(axis=(0, 2))
        names = ("before", "refitted", "after", "discovered")
        squares = {name: own[kept] * self.unit for name, own in zip(names, self.errors, strict=True)}
        squares["floor"] = self.noise.total[kept] if kept.any() else squares["after"]
        return {name: (_root(own[:, 0] + own[:, 1]), _root(own[:, 2])) for name, own in squares.items()}

    @property
    def left(self) -> float:
        """The part of the refitted nominal model's error that the corrected one leaves, floor and all."""
        return self.after / max(self.refitted, 1e-9)

    @property
    def excess(self) -> float:
        """The corrected model's error, at the low end of its interval, over the high end of what noise makes."""
        errors = np.asarray(self.errors[2])
        seen = np.isfinite(errors).all(axis=1).any()
        return interval(errors)[0] / max(float(np.quantile(self.noise.draws, HIGH)), 1e-9) if seen else 0.0


def _root(squares: Array) -> float:
    """The root of a mean; 0 of nothing."""
    return float(np.sqrt(np.mean(squares))) if len(squares) else 0.0


class Measured(NamedTuple):
    """All that the judging rows tell, the corrected model of which they tell it, the laws that were discovered, and
    named effects that these rows refuse, and those that the laws make needless."""

    gap: Gap
    account: Account
    where: Place
    shrinks: dict[str, Shrink]
    model: Model
    discovered: tuple[Shown, ...]
    refused: tuple[str, ...]
    needless: tuple[str, ...]


def measure(prepared: Prepared, finding: Finding, given: Model | None, common, direct: dict, seed: int = 0) -> Measured:
    """The gap before and after, the account, where it lies, and the shrink of each single effect; `given` is the model
    as given, `common` are effects that it has already, `direct` parameters of effects that show without a refit."""
    corrected, draws = sized_corrected(prepared, finding, direct, seed)
    if (shown := confirm(prepared, finding, direct, seed, corrected)) is not None:
        corrected, draws = shown.named, shown.draws
    law = corrected.law
    bare = dataclasses.replace(corrected.model, covariance=None, parameter_order=())
    players = players_of(corrected, common)
    judged: dict[frozenset[str], Judged] = {
        joined: judge_model(model, prepared) for joined, model in with_players(prepared, finding, corrected, players)
    }
    nobody, everybody = judged[frozenset()], judged[frozenset(players)]
    before = nobody if given is None else judge_model(dataclasses.replace(given, noise=corrected.model.noise), prepared)
    floor = floor_of(corrected.model, everybody, prepared, law, draws)
    unit, last = deviations(law) ** 2, everybody if shown is None else judge_model(shown.model, prepared)
    missed = {joined: one.error for joined, one in judged.items()}
    account = account_of(prepared.horizon, missed, players, floor, unit, seed, last.error)
    errors = np.stack([one.error**2 / unit for one in (before, nobody, everybody, last)])
    regular = bool(finding.rest.terms) and law.slip is not None
    least = floor.steady if regular else None  # slip may be regular as well, and then it is still to explain
    level = float(np.mean(floor.total / unit))

    def shrink(model: Judged) -> Shrink:
        return shrink_of(errors[1], model.error**2 / unit, level, floor.draws, _wander(model, unit, seed), seed, least)

    shrinks = {name: shrink(judged[frozenset({name})]) for name in players}
    weakest, idle = placebo_of(prepared, finding, law)
    placebo = (weakest, shrink(judge_model(idle, prepared)))
    low, high = (float(q) for q in np.quantile(floor.likely, [LOW, HIGH]))
    gap = Gap(prepared.horizon, *_levels(errors), level, (low, high), shrink(everybody), shrink(last), placebo, errors,
              np.stack([nobody.path, last.path]), floor, unit, int(last.run_up.sum()))  # fmt: skip
    moved = None
    if players and finding.unexplained <= UNEXPLAINED:
        moved = _moved(everybody, judge_model(without(bare, players), prepared), unit)
    place = locate(errors[1], floor.total / unit, everybody.path, prepared, moved, seed)
    laws = () if shown is None else each_law(prepared, shown, errors[1], unit, seed)
    return Measured(gap, account, place, shrinks, corrected.model if shown is None else shown.model, laws,
                    refused(judged, players, last, unit, seed),
                    () if shown is None else needless(finding, shown.bending))  # fmt: skip


def _levels(errors: Array) -> tuple[float, float, float, float]:
    """Means of errors (models, starts, 3) over starts that no model fails at: before, refitted, after, discovered."""
    kept = np.isfinite(errors).all(axis=(0, 2))
    before, refitted, after, last = (float(np.mean(own[kept])) if kept.any() else float("nan") for own in errors)
    return before, refitted, after, last


def _wander(judged: Judged, unit: Array, seed: int) -> np.ndarray:
    """Mean squared errors (draws,) over the camera's variances that the uncertainty of a model's own parameters makes:
    the least that it can miss by."""
    normal = np.random.default_rng(seed).normal(size=(len(judged.slopes), REPLAYS))
    moved = np.einsum("dsi,dn->nsi", judged.slopes, normal)
    return np.nanmean(moved**2 / unit, axis=(1, 2)) if len(normal) else np.zeros(REPLAYS)


def _moved(corrected: Judged, bare: Judged, unit: Array) -> np.ndarray:
    """Squares (starts, 3) over the camera's variances of what the effects add to the movement along, sideways and in
    heading from row to row, all else alike.

    The refitted nominal model's own error would say less: its parameters bend until some of what an effect does in
    one channel lies in another, and an error of heading soon lies sideways.
    """
    both = (increments(np.moveaxis(one.path, 2, 0)) for one in (corrected, bare))
    return np.sum(np.subtract(*both) ** 2, axis=2).T / unit
