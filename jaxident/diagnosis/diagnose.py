"""One diagnosis from start to end: logs in; gap, place, causes, shrink and corrected model out."""

import dataclasses
from collections.abc import Sequence
from math import isfinite
from typing import NamedTuple

from jaxident.diagnosis.account.account import Account
from jaxident.diagnosis.account.discovered import Shown
from jaxident.diagnosis.account.measure import Gap, Measured, measure
from jaxident.diagnosis.account.models import as_model
from jaxident.diagnosis.account.refused import finding_without
from jaxident.diagnosis.account.shrink import Shrink
from jaxident.diagnosis.account.where import Place
from jaxident.diagnosis.causes.chance_effects import direct_effects, direct_evidence, present
from jaxident.diagnosis.causes.finding import CLAIMED, Finding, find_effects
from jaxident.diagnosis.detectability import Replay, answers, replay, visible
from jaxident.diagnosis.posterior import Judgement, judge
from jaxident.diagnosis.preparation import translate
from jaxident.diagnosis.preparation.prepare import Prepared, prepare, suspected_wheels
from jaxident.diagnosis.preparation.translate import to_model
from jaxident.diagnosis.simulator import Simulator, as_simulator, check_units, inspect_simulator, shared
from jaxident.effects.coordinates import ASIDE, PLACES
from jaxident.errors import InputError
from jaxident.estimation.suspicions.log_suspicions import log_suspicions
from jaxident.log import Log, join
from jaxident.numerics import require_float64
from jaxident.robot.model import Model

FEW, FEWEST = 6, 2
"""Windows that naming and judging need before anything is claimed."""
DIFFERENT = 4.0
"""Standard deviations by which a parameter differs before the verdict says so."""


class Parameter(NamedTuple):
    """A nominal parameter as given and as refitted, in the user's units; None where none was given."""

    name: str
    nominal: float | None
    refitted: float
    standard_deviation: float


class Diagnosis(NamedTuple):
    """What `diagnose` found. verdict: "no_gap", "parameters", "effects", "partly", "unknown" or "undecided". selected:
    the named effects, in the order in which they were accepted. visible: the gain that each effect of typical size
    would have had; below CLAIMED this input could not have shown it. replay: what faint effects come out as. surplus:
    effects that the user's simulator has and the robot has not. discovered: laws in no catalogue, which the corrected
    model has as well. suspicions: what the log says against itself, with the option that mends it, a line each.
    refused: effects that fit the runs for naming, and without which the judging runs are predicted better (95 % sure);
    the corrected model has none of them."""

    verdict: str
    judgement: Judgement
    gap: Gap
    account: Account
    where: Place
    selected: tuple[str, ...]
    parameters: list[Parameter]
    visible: dict[str, float]
    replay: Replay
    next: str
    nominal_model: Model
    corrected_model: Model
    shrinks: dict[str, Shrink]
    prepared: Prepared
    finding: Finding
    surplus: tuple[str, ...] = ()
    simulator: Simulator | None = None
    discovered: tuple[Shown, ...] = ()
    suspicions: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()

    @property
    def not_testable(self) -> list[str]:
        """Effects that this input could not have shown at their typical size, and that are not among the named."""
        return [name for name, gain in self.visible.items() if gain < CLAIMED and name not in self.selected]


def diagnose(
    logs: Log | Sequence[Log],
    *,
    sim: Log | Sequence[Log] | None = None,
    model: Model | None = None,
    horizon: float | None = None,
    seed: int = 0,
) -> Diagnosis:
    """The gap between a robot's logs and the nominal model: where, which effect, how far it shrinks.

    The nominal model is `model`, or the one behind the logs `sim` of the user's own simulator, or identified from the
    logs. Effects that a model or simulator has are no gap: the answer is what the robot has and it lacks. horizon [s]
    (default 1, of 20 to 60 rows). The runs keep apart: every third, from the second on, serves the gap, its account and
    its shrink alone. seed: of the laws of noise drawn and the shuffles behind intervals; nothing else is drawn. Needs
    double precision and a minute. InputError for logs that say nothing, and for a simulator in other units."""
    require_float64("diagnose")
    check_nominal(logs, sim, model)
    simulator = None if model is None else as_simulator(model, logs)
    prepared, finding = find_effects(prepare(logs, horizon, None if simulator is None else simulator.vector[:10]))
    if sim is not None:
        simulator, finding = inspect_simulator(sim, prepared, finding)
    (finding, extra, shown, measured), refused = believed(prepared, finding, simulator, model, seed)
    gap, account, where, shrinks, corrected, laws, _ = measured
    told = None if simulator is None else simulator.vector
    common, surplus = shared(shown, simulator)
    judgement = judge(finding, gap, extra, simulator)
    selected = tuple(name for name in shown if name not in common) if judgement.none < 0.5 else ()
    known = answers(finding.data, finding.nominal, prepared.largest)
    parameters = compare_parameters(prepared, finding, told, common)
    verdict = decide(prepared, judgement, selected, parameters)
    nominal = to_model(prepared, finding.nominal.vector, finding.law, (), None, finding.nominal)
    return Diagnosis(verdict, judgement, gap, account, where, selected, parameters, visible(known), replay(known, seed),
                     advice(verdict, judgement, laws), nominal, corrected, shrinks, prepared, finding, surplus,
                     simulator, laws, (*log_suspicions(join(logs)), *suspected_wheels(join(logs))),
                     refused)  # fmt: skip


class Seen(NamedTuple):
    """What the judging rows say of a finding: the evidence of effects that show without a refit, all effects present,
    and what is measured of them."""

    finding: Finding
    extra: dict[str, float]
    shown: tuple[str, ...]
    measured: Measured


def believed(
    prepared: Prepared, finding: Finding, simulator: Simulator | None, model: Model | None, seed: int
) -> tuple[Seen, tuple[str, ...]]:
    """A finding measured on the rows kept for judging, and the effects that these rows refuse: while there are some,
    it is measured again without them."""
    refused: tuple[str, ...] = ()
    seen = see(prepared, finding, simulator, model, seed)
    while more := seen.measured.refused:
        refused = (*refused, *more)
        seen = see(prepared, finding_without(seen.finding, more), simulator, model, seed)
    return seen, refused


def see(prepared: Prepared, finding: Finding, simulator: Simulator | None, model: Model | None, seed: int) -> Seen:
    """A finding on the rows kept for judging. `model`: the nominal model where one was given."""
    extra = direct_evidence(prepared, finding, CLAIMED if simulator is None else simulator.price)
    shown = present(finding, extra)
    common, _ = shared(shown, simulator)
    direct = direct_effects(prepared, finding, shown)
    given = None if simulator is None else as_model(prepared, simulator.vector, finding.law, simulator.effects, direct)
    if given is not None and model is not None:
        given = dataclasses.replace(given, discovered=model.discovered)
    return Seen(finding, extra, shown, measure(prepared, finding, given, common, direct, seed))


def check_nominal(logs: Log | Sequence[Log], sim: Log | Sequence[Log] | None, model: Model | None) -> None:
    """InputError where there are two nominal models, or one in other units."""
    if sim is not None and model is not None:
        raise InputError("give the simulator's logs or a model, not both: each is the nominal model to judge")
    if sim is not None:
        check_units(sim, logs)


def compare_parameters(prepared: Prepared, finding: Finding, given, common: tuple[str, ...] = ()) -> list[Parameter]:
    """Nominal parameters given (coordinates, None where none were) and refitted, in the user's units; then those of the
    effects that the given model has in common with the robot: the right effect may have the wrong size. A limit that
    never acts has none."""
    best = finding.fit
    if given is not None and ASIDE[0] in common and PLACES[ASIDE] not in best.places:
        given = translate.abreast_of_marker(given)  # as the refit has it, which is not told its side
    names, values, deviations = translate.parameters_of(best, prepared.largest)
    told = [None] * len(names) if given is None else translate.in_user_units(given, prepared.largest)
    rows = [Parameter(*row) for row in zip(names, told, values, deviations, strict=True)]
    for name in (name for name in finding.selected if name in common):
        effect = translate.effect_of(name, best, prepared.largest)
        before = translate.effect_values(name, given, prepared.largest)
        rows += [
            Parameter(f"{name} {key}", _finite(before[key]), effect.parameters[key], deviation)
            for key, deviation in (effect.standard_deviation or {}).items()
            if isfinite(effect.parameters[key])
        ]
    return rows


def _finite(value: float) -> float | None:
    """A limit that never acts has no number."""
    return value if isfinite(value) else None


def decide(prepared: Prepared, judgement: Judgement, selected: tuple[str, ...], parameters: list[Parameter]) -> str:
    """The verdict."""
    if len(prepared.windows.run) < FEW or len(prepared.judging.row) < FEWEST:
        return "undecided"
    if selected:
        return "partly" if judgement.unexplained > 0.5 else "effects"
    if judgement.unexplained > 0.5:
        return "unknown"
    apart = [
        abs(p.refitted - p.nominal) / max(p.standard_deviation, 1e-12) for p in parameters if p.nominal is not None
    ]
    moved = any(z > DIFFERENT for z in apart)
    return "parameters" if moved else "no_gap"


def advice(verdict: str, judgement: Judgement, laws: tuple[Shown, ...] = ()) -> str:
    """What to record next, in a sentence."""
    if verdict == "undecided":
        return "Record at least three runs of 500 samples with both wheels at many levels, forward and backward."
    sets = [cause for cause in judgement.causes if cause.indistinguishable_from]
    if verdict in ("effects", "partly") and sets:
        names = ",".join((sets[0].effect, sets[0].indistinguishable_from[0]))
        told = names.replace(",", " from ")
        return f"This input cannot tell {told}: record the one that `jaxident plan MODEL --between {names}` designs."
    if verdict in ("unknown", "partly") and laws:
        signal = laws[0].law.signal
        begin = "Ask what on the robot could make the discovered curve."
        return f"{begin} Runs in which its signal ({signal}) varies more would tell it better."
    if verdict in ("unknown", "partly"):
        return "No effect of the catalogue explains what is left: record runs that stay in the regions where it lies."
    return "Nothing more is needed for this question; a longer log would find fainter effects."
