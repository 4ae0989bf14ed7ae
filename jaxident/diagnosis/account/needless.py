"""Named effects that discovered laws make needless: names that were put together for what no catalogue lists.

The search names effects before it looks for laws. Where a driver brakes worse than it drives, limited traction and a
drag may stand in for that. Once the law itself is there, nothing speaks for them any more.

A name that explains nearly all by itself comes first, as it does beside the corrector's terms. On half a log of a
Create a surface of both pushes can stand in for its turn loss, too.
"""

from jaxident.array_types import Array
from jaxident.diagnosis.causes.discrepancy import UNEXPLAINED
from jaxident.diagnosis.causes.evidence import evidence_of
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.causes.search_rounds import SURE
from jaxident.diagnosis.causes.settled import whiten
from jaxident.diagnosis.discovery.fit import Bending, refit_with
from jaxident.diagnosis.fit.refit import Data, Solution, refit
from jaxident.effects.coordinates import NOMINAL, PLACES, neutral_vector


def needless(finding: Finding, bending: Bending) -> tuple[str, ...]:
    """Effects of the finding that are worth less than SURE beside the laws, by refits without them; the one that is
    worth least leaves first. An effect in whose place a law acts stays: the law is what its form lacks. So does one
    that owns what it explains (`_owners`). Where wheels are measured all stay, for poses alone judge a law."""
    windows = finding.data.windows
    if windows.wheels is not None:
        return ()
    curves, data = bending.curves, whiten(bending.fit, windows, bending.law)[0]
    now, count, gone = refit_with(data, bending.fit, curves)[0], len(finding.selected), []
    kept = {name for curve in curves for name in curve.kind.effects}
    kept |= _owners(data, finding, now.cost)
    names = [name for name in finding.selected if name not in kept]
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


def _owners(data: Data, finding: Finding, cost: float) -> set[str]:
    """Effects beside which all laws bring less than UNEXPLAINED of what these and the effect bring. cost: with laws."""
    fit, names = finding.fit, finding.selected
    plain = refit(data, fit.vector, fit.starts, names)
    laws = max(plain.cost - cost, 0.0)
    alone = {
        name: refit(data, _neutral(plain.vector, name), plain.starts, tuple(n for n in names if n != name)).cost
        for name in names
    }
    return {name for name, other in alone.items() if laws < UNEXPLAINED * (other - plain.cost + laws)}


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
