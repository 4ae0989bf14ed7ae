"""Effects that show without a refit: commands that never arrived, frames that repeat, outliers, a camera error with a
memory."""

from jaxident.diagnosis.causes.candidates import ENOUGH, Finding
from jaxident.diagnosis.frames import has_outliers
from jaxident.diagnosis.prepare import Prepared


def direct_evidence(prepared: Prepared, finding: Finding, price: float = ENOUGH) -> dict[str, float]:
    """Evidence for effects that are seen in the frames themselves or sized with the noise, claimed above ENOUGH. price:
    what commands that never arrived must be worth, for they too take up what is missing in a model."""
    frozen, outlying = int(prepared.frames.frozen.sum()), prepared.frames.outlying
    return {
        "frozen_frames": 10.0 * frozen if frozen >= 3 else 0.0,
        # normal noise lies OUTLYING deviations off once in 10^11 rows
        "outliers": 10.0 * int(outlying.sum()) if has_outliers(outlying) else 0.0,
        "lost_commands": prepared.lost[1] - (price - ENOUGH),
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
    if "lost_commands" in selected:
        found["lost_commands"] = {"probability": prepared.lost[0]}
    if "coloured_noise" in selected and finding.law.coloured is not None:
        position, heading = finding.law.coloured
        time = float(finding.law.coloured_time or 0.0)
        found["coloured_noise"] = {"position": position, "heading": heading, "correlation_time": time}
    return found
