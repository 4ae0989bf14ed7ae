"""One diagnosis from start to end: logs in; gap, place, causes, shrink and corrected model out."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxident.diagnosis import translate
from jaxident.diagnosis.gap import Floor, Shrink, errors, floor_of, interval, shrink_of
from jaxident.diagnosis.noise import Law
from jaxident.diagnosis.prepare import BURN, Prepared, first_starts, prepare
from jaxident.diagnosis.responses import respond
from jaxident.diagnosis.search import Data, refit
from jaxident.diagnosis.verdict import Judgement, judge
from jaxident.diagnosis.where import Place, locate
from jaxident.diagnosis.which import ENOUGH, Finding, search_effects, visible
from jaxident.diagnosis.windows import Windows, cut
from jaxident.log import Log
from jaxident.numerics import require_float64
from jaxident.robot.model import Model

FEW = 6
"""Windows that each purpose needs before anything is claimed."""
DIFFERENT = 4.0
"""Standard deviations by which a parameter differs before the verdict says so."""


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


class Parameter(NamedTuple):
    """A nominal parameter as given and as refitted, in the user's units; None where none was given."""

    name: str
    nominal: float | None
    refitted: float
    standard_deviation: float


class Diagnosis(NamedTuple):
    """What `diagnose` found. verdict: "no_gap", "parameters", "effects", "unknown" or "undecided". visible: the gain
    that each effect of typical size would have had; below ENOUGH this input could not have shown it."""

    verdict: str
    judgement: Judgement
    gap: Gap
    where: Place
    selected: tuple[str, ...]
    parameters: list[Parameter]
    visible: dict[str, float]
    next: str
    nominal_model: Model
    corrected_model: Model
    shrinks: dict[str, Shrink]
    prepared: Prepared
    finding: Finding

    @property
    def not_testable(self) -> list[str]:
        """Effects that this input could not have shown at their typical size."""
        return [name for name, gain in self.visible.items() if gain < ENOUGH]


def diagnose(logs: Log | Sequence[Log], *, model: Model | None = None, horizon: float | None = None) -> Diagnosis:
    """The gap between a robot's logs and the nominal model: where, which effect, how far it shrinks.

    The nominal model is `model`, or identified from the logs. horizon [s] (default 1, of 20 to 60 rows). The logs' runs
    keep apart: every third, from the second on, serves the gap and its shrink alone. Needs double precision and 20 to
    120 s; the same logs give the same numbers. InputError for logs that say nothing.
    """
    require_float64("diagnose")
    given = None if model is None else translate.to_coordinates(model, logs)
    prepared = prepare(logs, horizon, given)
    finding = search_effects(prepared.windows, prepared.naming, prepared.nominal, prepared.law)
    extra = direct_evidence(prepared, finding)
    judgement = judge(finding, extra)
    selected = (*finding.selected, *(name for name, evidence in extra.items() if evidence > ENOUGH))
    gap, where, shrinks = measure(prepared, finding, given)
    duration = float(prepared.windows.session[-1] + prepared.windows.t[-1, -1])
    found = visible(finding.data, finding.nominal, prepared.largest, duration)
    parameters = compare_parameters(prepared, finding, model)
    verdict = decide(prepared, judgement, gap, parameters)
    nominal_model = translate.to_model(prepared, finding.nominal, finding.law, ())
    corrected = translate.to_model(prepared, finding.candidates[finding.selected].solution, finding.law, finding.selected,
                                   direct_effects(prepared, finding, selected))  # fmt: skip
    return Diagnosis(verdict, judgement, gap, where, selected if verdict == "effects" else (), parameters, found,
                     advice(verdict, judgement), nominal_model, corrected, shrinks, prepared, finding)  # fmt: skip


def direct_evidence(prepared: Prepared, finding: Finding) -> dict[str, float]:
    """Evidence for effects that are seen in the frames themselves or sized with the noise."""
    rows = len(prepared.log.t)
    frozen, outlying = int(prepared.frames.frozen.sum()), int(prepared.frames.outlying.sum())
    return {
        "frozen_frames": 10.0 * frozen if frozen >= 3 else 0.0,
        # seven standard deviations by chance are less than one in 10^8 rows
        "outliers": 10.0 * outlying if outlying >= max(3, 1e-4 * rows) else 0.0,
        "coloured_noise": 2.0 * ENOUGH if finding.law.coloured is not None else 0.0,
    }


def direct_effects(prepared: Prepared, finding: Finding, selected) -> dict[str, dict[str, float]]:
    """Parameters of the selected effects among these."""
    rows = max(len(prepared.log.t), 1)
    found = {}
    if "frozen_frames" in selected:
        found["frozen_frames"] = {"probability": float(prepared.frames.frozen.sum() / rows)}
    if "outliers" in selected:
        found["outliers"] = {"probability": float(prepared.frames.outlying.sum() / rows)}
    if "coloured_noise" in selected and finding.law.coloured is not None:
        position, heading = finding.law.coloured
        time = finding.law.coloured_time
        found["coloured_noise"] = {"position": position, "heading": heading, "correlation_time": time}
    return found


def measure(prepared: Prepared, finding: Finding, given) -> tuple[Gap, Place, dict[str, Shrink]]:
    """The gap on windows kept for it, before and after, where it lies, and the shrink of each single effect."""
    rows = len(prepared.windows.step)
    windows = judging_windows(prepared, rows)
    law, best = finding.law, finding.candidates[finding.selected].solution
    singles = {e[0]: c for e, c in finding.candidates.items() if len(e) == 1}
    before = finding.nominal.vector if given is None else np.concatenate([given, finding.nominal.vector[10:]])
    vectors = np.stack([before, finding.nominal.vector, best.vector, *(c.solution.vector for c in singles.values())])
    responses, residual, starts = _settle(best.vector, windows, law)
    found = errors(vectors, np.tile(starts, (len(vectors), 1, 1)), windows, law, responses, BURN)
    replay = floor_of(best.vector, residual, windows, law, responses, BURN)
    mean = np.nanmean(found, axis=(1, 2))
    shrinks = {name: shrink_of(found[1], found[3 + k], replay) for k, name in enumerate(singles)}
    weakest = min(singles.values(), key=lambda c: c.gain, default=None)
    placebo = None if weakest is None else (weakest.effects[0], shrinks[weakest.effects[0]])
    spread = np.quantile(replay.replays, [0.05, 0.95])
    gap = Gap(prepared.horizon, float(mean[0]), float(mean[1]), float(mean[2]), replay.value,
              (float(spread[0]), float(spread[1])), shrink_of(found[1], found[2], replay), placebo, found[:3], replay)  # fmt: skip
    seen = np.asarray(windows.seen)[-1]
    floor = np.full(found[1].shape, np.nan)
    floor[seen] = replay.channels
    return gap, locate(found[1], floor, residual, windows), shrinks


def judging_windows(prepared: Prepared, rows: int) -> Windows:
    """Windows of the runs that judge, overlapping by half; of one or two runs, those that do not name."""
    windows = prepared.windows
    own = ~prepared.naming
    if len(np.unique(windows.run)) < 3:
        chosen = np.flatnonzero(own)
        return pick(windows, chosen, len(own))
    dense = cut(blinded(prepared), rows, stride=max(rows // 3, 1), session=windows.session)
    chosen = np.flatnonzero(dense.run % 3 == 1)
    return pick(dense, chosen, len(own))


def blinded(prepared: Prepared) -> Log:
    """The log as the windows saw it."""
    hidden = prepared.frames.outlying
    x, y, theta = (np.where(hidden, np.nan, column) for column in prepared.log.pose)
    return prepared.log._replace(x=x, y=y, theta=theta)


def pick(windows: Windows, chosen, count: int) -> Windows:
    """Some windows, spread evenly if there are more than `count`; else filled up with unseen copies of the first, so that
    the program compiled for `count` serves them."""
    if len(chosen) > count:
        chosen = chosen[np.linspace(0, len(chosen) - 1, count).round().astype(int)]
    filled = np.concatenate([chosen, np.repeat(chosen[:1], count - len(chosen))])
    seen = np.array(windows.seen[:, filled])
    seen[:, len(chosen) :] = False
    seen[:2, len(chosen) :] = True  # a window without any pose has no start
    return windows._replace(step=windows.step[:, filled], pose=windows.pose[:, filled], seen=seen,
                            run=windows.run[filled], first=windows.first[filled])  # fmt: skip


def _settle(vector, windows: Windows, law: Law):
    """Responses, residuals and starts of windows under a model, start states from all their rows."""
    starts = first_starts(windows)
    seen = np.repeat(np.asarray(windows.seen).T, 3, axis=1)
    scale = np.tile(1.0 / np.array([law.position, law.position, law.heading]), len(windows.step))
    data = Data(windows, np.eye(len(scale)) * scale * seen[:, :, None], np.ones(windows.step.shape[1], bool))
    solution = refit(data, vector, starts, (), most=3)
    responses = respond(np.exp(vector[:2]), solution.linear.residual, windows)
    return responses, solution.linear.residual, solution.starts


def compare_parameters(prepared: Prepared, finding: Finding, model: Model | None) -> list[Parameter]:
    """Nominal parameters given and refitted, in the user's units."""
    best = finding.candidates[finding.selected].solution
    names, values, deviations = translate.parameters_of(best, prepared.largest)
    given = [None] * len(names) if model is None else translate.given_parameters(model)
    return [Parameter(*row) for row in zip(names, given, values, deviations, strict=True)]


def decide(prepared: Prepared, judgement: Judgement, gap: Gap, parameters: list[Parameter]) -> str:
    """The verdict."""
    naming, judging = int(prepared.naming.sum()), int((~prepared.naming).sum())
    if naming < FEW or judging < 2:
        return "undecided"
    if judgement.unknown > 0.5:
        return "unknown"
    if judgement.none < 0.5:
        return "effects"
    moved = [p for p in parameters if p.nominal is not None
             and abs(p.refitted - p.nominal) > DIFFERENT * max(p.standard_deviation, 1e-12)]  # fmt: skip
    return "parameters" if moved else "no_gap"


def advice(verdict: str, judgement: Judgement) -> str:
    """What to record next, in a sentence."""
    if verdict == "undecided":
        return "Record at least three runs of 500 samples with both wheels at many levels, forward and backward."
    sets = [cause for cause in judgement.causes if cause.indistinguishable_from]
    if verdict == "effects" and sets:
        names = ",".join((sets[0].effect, sets[0].indistinguishable_from[0]))
        return f"This input cannot tell {names.replace(',', ' from ')}: `jaxident plan MODEL --between {names} --out next.csv` designs one that does."
    if verdict == "unknown":
        return "Look at the regions where the gap lies, and record runs that stay there: no catalogue effect explains them."
    return "Nothing more is needed for this question; a longer log would find fainter effects."


__all__ = ["Diagnosis", "diagnose", "interval"]
