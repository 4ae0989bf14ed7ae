"""diagnosis.json, "schema": "jaxident.diagnosis/1": what a diagnosis found, for programs."""

from typing import Any

import numpy as np

from jaxident.diagnosis.diagnose import Diagnosis, Gap
from jaxident.diagnosis.extent.where import OF_COMMANDS, Region
from jaxident.diagnosis.replay import Replay
from jaxident.effects.catalogue import CATALOGUE

SCHEMA = "jaxident.diagnosis/1"


def diagnosis_to_dict(found: Diagnosis) -> dict[str, Any]:
    """The content of the file."""
    judgement = found.judgement
    return {
        "schema": SCHEMA,
        "verdict": found.verdict,
        "probability": {
            "none": judgement.none,
            "unknown": judgement.unknown,
            "sets": [{"effects": list(effects), "p": p} for effects, p in judgement.sets],
        },
        "gap": _gap(found.gap),
        "where": {
            "site": judgement.sites,
            "channels": found.where.channels,
            "excess": found.where.excess,
            "regions": [_region(region, found.prepared.largest) for region in found.where.regions],
        },
        "causes": _causes(found),
        "selected": list(found.selected),
        "surplus": list(found.surplus),
        "parameters": [p._asdict() for p in found.parameters],
        "not_testable": found.not_testable,
        "replays": _replays(found.replay),
        "unexplained": [{"site": term.site, "term": term.name, "gain": gain} for term, gain in found.finding.terms],
        "next": found.next,
    }


def _gap(gap: Gap) -> dict[str, Any]:
    placebo = None
    if gap.placebo is not None:
        name, shrink = gap.placebo
        placebo = {"effect": name, "shrink": shrink.value, "shrink_interval": _listed(shrink.interval)}
    return {
        "horizon": gap.horizon,
        "before": gap.before,
        "refitted": gap.refitted,
        "after": gap.after,
        "floor": {"value": gap.floor, "interval": list(gap.floor_interval)},
        "shrink": gap.shrink.value,
        "shrink_interval": _listed(gap.shrink.interval),
        "placebo": placebo,
    }


def _region(region: Region, largest: float) -> dict[str, Any]:
    """One region, edges of command variables in the user's unit."""
    factor = largest if region.variable in OF_COMMANDS else 1.0
    return {
        "variable": region.variable,
        "from": factor * region.low,
        "to": factor * region.high,
        "share": region.share,
        "p_value": region.p_value,
    }


def _replays(replay: Replay) -> dict[str, Any]:
    """How often the scores claim an effect without any, and name each faint one, on this input and noise."""
    right = np.diagonal(replay.named)[1:]
    return {
        "false_claims": float(1.0 - replay.named[0, 0]),
        "named_when_faint": {name: float(share) for name, share in zip(replay.effects, right, strict=True)},
    }


def _listed(interval: tuple[float, float] | None) -> list[float] | None:
    return None if interval is None else list(interval)


def _causes(found: Diagnosis) -> list[dict[str, Any]]:
    """One object per cause; parameters from the corrected model, or from the effect's own refit."""
    known = {effect.name: effect for effect in found.corrected_model.effects}
    rows = []
    for cause in found.judgement.causes:
        effect = known.get(cause.effect)
        shrink = found.shrinks.get(cause.effect)
        rows.append(
            {
                "effect": cause.effect,
                "site": cause.site,
                "probability": cause.probability,
                "parameters": None if effect is None else effect.parameters,
                "standard_deviation": None if effect is None else effect.standard_deviation,
                "shrink": None if shrink is None else shrink.value,
                "indistinguishable_from": list(cause.indistinguishable_from),
                "extension": CATALOGUE[cause.effect].extension,
            }
        )
    return rows
