"""Named effects that discovered laws make needless: names that were put together for what no catalogue lists.

The search names effects before it looks for laws. Where a driver brakes worse than it drives, limited traction and a
drag may stand in for that. Once the law itself is there, nothing speaks for them any more.
"""

from jaxident.diagnosis.causes.evidence import evidence_of
from jaxident.diagnosis.causes.finding import Finding
from jaxident.diagnosis.causes.search_rounds import SURE
from jaxident.diagnosis.causes.settled import whiten
from jaxident.diagnosis.discovery.fit import Bending, refit_with
from jaxident.diagnosis.fit.refit import Solution
from jaxident.effects.catalogue import BY_KIND
from jaxident.effects.coordinates import NOMINAL, PLACES, neutral_vector


def superseded(finding: Finding, bending: Bending) -> tuple[str, ...]:
    """Effects of the finding that are worth less than SURE beside the laws, by refits without them; the one that is
    worth least leaves first. An effect in whose place a law acts stays: the law is what its form lacks. Where wheels
    are measured all stay, for poses alone judge a law."""
    windows = finding.data.windows
    if windows.wheels is not None:
        return ()
    curves = bending.curves
    alike = {name for curve in curves for name in BY_KIND.get(curve.kind.names, ())}
    names = [name for name in finding.selected if name not in alike]
    count, gone, data = len(finding.selected), [], whiten(bending.fit, windows, bending.law)[0]
    now = refit_with(data, bending.fit, curves)[0]
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


def _without(fit: Solution, name: str) -> Solution:
    """A fit in which one effect does nothing."""
    own = {place for (effect, _), place in PLACES.items() if effect == name}
    vector = fit.vector.copy()
    vector[list(own)] = neutral_vector(vector[: len(NOMINAL)])[list(own)]
    return fit._replace(vector=vector, places=[place for place in fit.places if place not in own])
