"""Effects that show without a refit: commands that never arrived, frames that repeat, outliers, a camera error with a
memory."""

import numpy as np

from jaxident.diagnosis.causes.finding import CLAIMED, Finding
from jaxident.diagnosis.motion.responses import respond
from jaxident.diagnosis.noise.sizing import steady_gain
from jaxident.diagnosis.preparation.pose_screening import has_outliers
from jaxident.diagnosis.preparation.prepare import Prepared
from jaxident.effects.catalogue import BY_CHANCE


def direct_evidence(prepared: Prepared, finding: Finding, price: float = CLAIMED) -> dict[str, float]:
    """Evidence for effects that are seen in the frames or sized with the noise, claimed above CLAIMED. price:
    what commands that never arrived and a memory must be worth, for they too take up what is missing in a model."""
    frozen, outlying = int(prepared.frames.frozen.sum()), prepared.frames.outlying
    return {
        BY_CHANCE["repeat"]: 10.0 * frozen if frozen >= 3 else 0.0,
        # normal noise lies OUTLYING deviations off once in 10^11 rows
        BY_CHANCE["outlier"]: 10.0 * int(outlying.sum()) if has_outliers(outlying, prepared.frames.poses) else 0.0,
        BY_CHANCE["lost"]: prepared.lost[1] - (price - CLAIMED),
        BY_CHANCE["memory"]: _memory(finding, price) if finding.law.coloured is not None else 0.0,
    }


def present(finding: Finding, extra: dict[str, float]) -> tuple[str, ...]:
    """Names of the effects that the search selected, and of those that show without a refit by `direct_evidence`."""
    return (*finding.selected, *(name for name, evidence in extra.items() if evidence > CLAIMED))


def _memory(finding: Finding, price: float) -> float:
    """Evidence for a memory of the camera; beside others it pays what a further effect does."""
    data, solution = finding.data, finding.fit
    responses = respond(np.exp(solution.vector[:2]), solution.linear.residual, data.windows)
    linear, law = solution.linear, finding.law
    gain = steady_gain(linear.residual, linear.starts, data.windows, responses, law)
    return gain - (max(price, finding.further) - CLAIMED)


def direct_effects(prepared: Prepared, finding: Finding, selected) -> dict[str, dict[str, float]]:
    """Parameters of the selected effects among these."""
    frames, poses = prepared.frames, max(prepared.frames.poses, 1)
    found: dict[str, dict[str, float]] = {}
    if BY_CHANCE["repeat"] in selected:
        found[BY_CHANCE["repeat"]] = {"probability": float(frames.frozen.sum() / poses)}
    if BY_CHANCE["outlier"] in selected:
        position, heading = frames.sizes
        share = float(frames.outlying.sum() / poses)
        found[BY_CHANCE["outlier"]] = {"probability": share, "position": position, "heading": heading}
    if BY_CHANCE["lost"] in selected:
        found[BY_CHANCE["lost"]] = {"probability": prepared.lost[0]}
    if BY_CHANCE["memory"] in selected and finding.law.coloured is not None:
        position, heading = finding.law.coloured
        time = float(finding.law.coloured_time or 0.0)
        found[BY_CHANCE["memory"]] = {"position": position, "heading": heading, "correlation_time": time}
    return found
