"""What a diagnosis comes to: parameters as given and as refitted, the verdict, and advice on the next run."""

from math import isfinite
from typing import NamedTuple

from jaxident.diagnosis.account.discovered import Shown
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.posterior import Judgement
from jaxident.diagnosis.preparation import translate
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.effects.coordinates import ASIDE, PLACES
from jaxident.effects.law_kinds import ANGLE, REVERSALS, SIGNAL_WORDS

VERDICTS = ("no_gap", "parameters", "effects", "partly", "unknown", "undecided")
"""What a diagnosis may come to; studies store its place here."""
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


def advice(verdict: str, judgement: Judgement, laws: tuple[Shown, ...], whole: bool) -> str:
    """What to record next, in a sentence; `whole`: all of the log was used."""
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
        if signal == ANGLE:
            return f"{begin} Look at what turns with that wheel: its rim, its axle, gears, the motor."
        if signal in REVERSALS:
            return f"{begin} Look at its castors. Runs that often go from forward to backward would tell it better."
        return f"{begin} Runs in which the {SIGNAL_WORDS[signal]} varies more would tell it better."
    if verdict in ("unknown", "partly"):
        return "No effect of the catalogue explains what is left: record runs that stay in the regions where it lies."
    longer = "; a longer log would find fainter effects" if whole else ""
    return f"Nothing more is needed for this question{longer}."
