"""Named effects that discovered laws make needless: names that were put together for what no catalogue lists.

The search names effects before it looks for laws. Where a driver brakes worse than it drives, limited traction and a
drag may stand in for that. Once the law itself is there, nothing speaks for them any more.

A name that explains nearly all by itself comes first, as it does beside the corrector's terms. On half a log of a
Create a surface of both pushes can stand in for its turn loss, too.

A law may act in the place of a named effect. The law is what the effect's form lacks, or the name was put together for
the law. In the first case the name explains most by itself, in the second the law does. Where a delay grows with the
speed, -log p fell by 2065 through a lag alone, and by 4679 through the law alone.
"""

from typing import NamedTuple

from jaxident.array_types import Array
from jaxident.diagnosis.causes.discrepancy import UNEXPLAINED
from jaxident.diagnosis.causes.evidence import evidence_of
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.causes.search_rounds import SURE
from jaxident.diagnosis.causes.settled import whiten
from jaxident.diagnosis.discovery.fit import Bending, refit_with
from jaxident.diagnosis.fit.refit import Data, Solution, refit
from jaxident.effects.coordinates import NOMINAL, PLACES, neutral_vector

LESS = 0.6
"""Part of what laws bring in the place of a name. On five simulated robots a false name brought 0.01 to 0.51 of it."""


class Costs(NamedTuple):
    """-log p without laws: of the fit with all names together, and of those without each."""

    together: float
    without: dict[str, float]


def needless(finding: Finding, bending: Bending) -> tuple[str, ...]:
    """Effects of the finding that laws make needless, by refits without them. First leave those in whose place a law
    acts, if it explains far more than they do (`_replaced`). Of the others those leave that are worth less than SURE
    beside the laws, the one that is worth least first. An effect that owns what it explains (`_owners`) stays. Where
    wheels are measured all stay, for poses alone judge a law."""
    windows = finding.data.windows
    if windows.wheels is not None:
        return ()
    curves, data = bending.curves, whiten(bending.fit, windows, bending.law)[0]
    now, costs, gone = refit_with(data, bending.fit, curves)[0], _without_laws(data, finding), []
    doubted = [name for name in finding.selected if name not in _owners(costs, now.cost)]
    alike = {name for curve in curves for name in curve.kind.effects}
    for name in (name for name in doubted if name in alike):
        fit = refit_with(data, _without(now, name), curves)[0]
        if _replaced(costs, name, fit.cost):
            now = fit
            gone.append(name)
    names, count = [name for name in doubted if name not in alike], len(finding.selected) - len(gone)
    while names:
        fits = {name: refit_with(data, _without(now, name), curves)[0] for name in names}
        worth = {name: evidence_of(now, count) - evidence_of(fit, count - 1) for name, fit in fits.items()}
        weakest = min(names, key=lambda name: worth[name])
        if worth[weakest] >= SURE:
            break
        now, count = fits[weakest], count - 1
        names.remove(weakest)
        gone.append(weakest)
    return tuple(gone)


def _without_laws(data: Data, finding: Finding) -> Costs:
    """Costs of refits without laws."""
    names = finding.selected
    plain = refit(data, finding.fit.vector, finding.fit.starts, names)
    without = {
        name: refit(data, _neutral(plain.vector, name), plain.starts, tuple(n for n in names if n != name)).cost
        for name in names
    }
    return Costs(plain.cost, without)


def _owners(costs: Costs, with_laws: float) -> set[str]:
    """Effects beside which all laws bring less than UNEXPLAINED of what these and the effect bring."""
    laws = max(costs.together - with_laws, 0.0)
    return {name for name, other in costs.without.items() if laws < UNEXPLAINED * (other - costs.together + laws)}


def _replaced(costs: Costs, name: str, with_laws: float) -> bool:
    """Whether a name brings by itself less than LESS of what the laws bring in its place. with_laws: the cost of these
    without it."""
    without = costs.without[name]
    return without - costs.together < LESS * (without - with_laws)


def _without(fit: Solution, name: str) -> Solution:
    """A fit in which one effect does nothing."""
    own = {place for (effect, _), place in PLACES.items() if effect == name}
    return fit._replace(vector=_neutral(fit.vector, name), places=[k for k in fit.places if k not in own])


def _neutral(vector: Array, name: str) -> Array:
    """Coordinates of a robot without one of its effects."""
    own = [place for (effect, _), place in PLACES.items() if effect == name]
    vector = vector.copy()
    vector[own] = neutral_vector(vector[: len(NOMINAL)])[own]
    return vector
