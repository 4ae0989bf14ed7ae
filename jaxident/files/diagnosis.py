"""diagnosis.json, "schema": "jaxident.diagnosis/2": what a diagnosis found, for programs."""

import itertools
from typing import Any

import numpy as np

from jaxident.diagnosis.account.account import Account, Row
from jaxident.diagnosis.account.discovered import Shown
from jaxident.diagnosis.account.measure import Gap
from jaxident.diagnosis.account.odometry import Odometry
from jaxident.diagnosis.account.where import OF_COMMANDS, Region
from jaxident.diagnosis.detectability import Replay
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.diagnosis.laws.not_shown import NotShown
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.law_kinds import MEMORIES, REVERSALS, TURNING, knots_by_signal

SCHEMA = "jaxident.diagnosis/2"


def diagnosis_to_dict(found: Diagnosis) -> dict[str, Any]:
    """The content of the file."""
    judgement = found.judgement
    return {
        "schema": SCHEMA,
        "verdict": found.verdict,
        "rows": _served(found.prepared),
        "probability": {
            "gap": judgement.gap,
            "unexplained": judgement.unexplained,
            "sets": [{"effects": list(effects), "p": p} for effects, p in judgement.sets],
        },
        "account": account_to_dict(found.account),
        "gap": _gap(found.gap),
        "where": {
            "site": judgement.sites,
            "channels": found.where.channels,
            "excess": found.where.excess,
            "regions": [_region(region, found.prepared.largest) for region in found.where.regions],
        },
        "causes": _causes(found),
        "selected": list(found.selected),
        "refused": list(found.refused),
        "needless": list(found.needless),
        "wheels": None if found.odometry is None else _wheels(found.odometry),
        "discovered": [law_to_dict(one) for one in found.discovered] or None,
        "not_looked_for": _not_looked_for(found.not_shown),
        "surplus": list(found.surplus),
        "parameters": [p._asdict() for p in found.parameters],
        "not_testable": found.not_testable,
        "replays": _replays(found.replay),
        "terms": [{"site": term.site, "term": term.name, "gain": gain} for term, gain in found.finding.rest.terms],
        "suspicions": list(found.suspicions),
        "next": found.next,
    }


def _served(prepared: Prepared) -> dict[str, int]:
    """How many rows the log has, and how many of them fitted and judged."""
    fitted, judged = prepared.served
    return {"log": len(prepared.log.t), "fitted": fitted, "judged": judged}


def _not_looked_for(hidden: NotShown) -> dict[str, Any]:
    """Why some laws were not looked for."""
    pairs = [list(pair) for pair in hidden.together]
    return {"too_few_windows": hidden.windows, "hardly_vary": list(hidden.still), "go_together": pairs}


def _wheels(told: Odometry) -> dict[str, Any]:
    """Errors of the models and of a robot that moves as its wheels turned, in mm and mrad."""
    return {
        "radius": told.sensor.radius,
        "track": told.sensor.track,
        "windows": told.starts,
        "rms": _in_thousandths(told.rms),
        "median": _in_thousandths(told.median),
    }


def _in_thousandths(errors: dict[str, tuple[float, float]]) -> dict[str, dict[str, float]]:
    """Errors in position [m] and heading [rad] as mm and mrad."""
    return {name: {"position": 1e3 * own[0], "heading": 1e3 * own[1]} for name, own in errors.items()}


def law_to_dict(shown: Shown) -> dict[str, Any]:
    """One discovered law."""
    law, form = shown.law, shown.form
    places = itertools.product(*(knots.tolist() for knots in knots_by_signal(law).values()))
    keys = ("at", *(["second_at"] if law.second_signal else []), "value", "standard_deviation")
    columns = (np.ravel(np.asarray(column, float)).tolist() for column in (law.value, law.standard_deviation))
    points = ((*place, *values) for place, *values in zip(places, *columns, strict=True))
    return {
        "site": shown.kind.site,
        "acts_on": law.acts_on,
        "times": law.times,
        "inputs": [*knots_by_signal(law), *([] if law.times == "1" else [law.times])],
        "memory": (MEMORIES | REVERSALS).get(law.signal, MEMORIES.get(law.times)) or None,
        **{key: getattr(law, key) for key in TURNING},
        "curve": [dict(zip(keys, point, strict=True)) for point in points],
        "rows": list(shown.density),
        "share": shown.share,
        "p_value": shown.p_value,
        "looks_like": None if form is None else form._asdict(),
        "alike": [kind._asdict() for kind in shown.alike],
        "effects_there": list(shown.kind.effects),
    }


def account_to_dict(account: Account) -> dict[str, Any]:
    """Who causes how much, in mm and mrad."""
    return {
        "horizon": account.horizon,
        "windows": account.windows,
        "failed": account.failed,
        "rows": [_row(row) for row in account.rows],
        "places": account.places,
    }


def _row(row: Row) -> dict[str, Any]:
    return {
        "part": row.part,
        "rms_position": 1e3 * row.rms_position,
        "rms_heading": 1e3 * row.rms_heading,
        "share": row.share,
        "share_interval": list(row.interval),
        "channels": row.channels,
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
        "discovered": gap.discovered,
        "floor": {"value": gap.floor, "interval": list(gap.floor_interval)},
        "shrink": gap.shrink.value,
        "shrink_interval": _listed(gap.shrink.interval),
        "whole_shrink": gap.whole.value,
        "whole_shrink_interval": _listed(gap.whole.interval),
        "rms": _in_thousandths(gap.rms),
        "run_up": gap.run_up,
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
    shares = {row.part: row.share for row in found.account.rows}
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
                "share": shares.get(cause.effect),
                "shrink": None if shrink is None else shrink.value,
                "indistinguishable_from": list(cause.indistinguishable_from),
                "extension": CATALOGUE[cause.effect].extension,
            }
        )
    return rows
