"""The search, and the search again with the commands that arrived where some were lost."""

from collections.abc import Collection

from jaxident.diagnosis.causes.candidates import ENOUGH, PENALTY, Finding
from jaxident.diagnosis.causes.lost import find_lost
from jaxident.diagnosis.causes.which import search_effects
from jaxident.diagnosis.prepare import Prepared, repaired

REPAIRS = 2
"""Times that lost commands are looked for: a second time under the noise that the first leaves."""


def search(prepared: Prepared, without: Collection[str] = ()) -> tuple[Prepared, Finding]:
    """The search, and again with the commands that arrived where saying that some were lost is worth more than the
    effects found without: a delay, say, makes every change late, lost commands only some. `without`: effects that the
    catalogue is to lack."""
    finding = search_effects(prepared.windows, prepared.nominal, prepared.law, without=without)
    for _ in range(REPAIRS):
        best = finding.candidates[finding.selected]
        alone, beside = (find_lost(finding.data, solution) for solution in (finding.nominal, best.solution))
        instead = alone.gain - best.evidence > beside.gain
        lost, worth = (alone, alone.gain - best.evidence) if instead else (beside, beside.gain)
        if worth - PENALTY < ENOUGH:
            break
        prepared = repaired(prepared, lost, worth - PENALTY)
        finding = search_effects(prepared.windows, prepared.nominal, prepared.law, without=without)
    return prepared, finding
