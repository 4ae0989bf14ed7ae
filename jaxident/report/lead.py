"""The first lines of a diagnosis's page: the verdict, in a sentence or two."""

from jaxident.diagnosis.diagnose import DIFFERENT, Diagnosis, Parameter
from jaxident.report import causes, words
from jaxident.report.words import NOMINAL, SPACE, number, percent, plain, together

COUNTS = {2: "two", 3: "three", 4: "four"}
CLEAREST = 3
"""Parameters of another size that are told."""


def lead(found: Diagnosis) -> str:
    """The verdict in a sentence or two."""
    gap = found.gap
    low, high = gap.floor_interval
    if found.verdict == "no_gap":
        return (
            f"No gap: the model predicts these logs {gap.horizon:.3g} s ahead as well as noise allows, with an error "
            f"of {number(gap.before)} camera variances where noise alone makes {number(low)} to {number(high)}."
        )
    if found.verdict == "parameters":
        return (
            f"The model has the right form but not the right parameters: {_moved(found)}. Refitting them takes the "
            f"error from {number(gap.before)} to {number(gap.refitted)} camera variances; noise alone makes "
            f"{number(low)} to {number(high)}."
        )
    if found.verdict == "effects":
        many = f"{COUNTS.get(len(found.selected), 'several')} unmodelled effects"
        count = "one unmodelled effect" if len(found.selected) == 1 else many
        rest = f"{_resized(found)} {_shrinks(found)}{_doubt(found)}"
        return f"The gap comes from {count}: {causes.in_words(found)}.{rest}"
    if found.verdict == "unknown":
        return f"There is a gap that no effect of the catalogue explains{_place(found)}. {_best_try(found)}"
    return f"These logs do not suffice for a verdict. {found.next}"


def _moved(found: Diagnosis) -> str:
    moved = _sizes(found.parameters)
    more = f" and {len(moved) - CLEAREST} more differ" if len(moved) > CLEAREST else ""
    return f"{'; '.join(moved[:CLEAREST])}{more}"


def _resized(found: Diagnosis) -> str:
    """Effects that the given model has too, where most of the larger size lies between the two: the clearest three."""
    known = [p for p in found.parameters if p.name not in NOMINAL and p.standard_deviation > 0.0]
    told = _sizes([p for p in known if _mostly_new(p.refitted, p.nominal)])[:CLEAREST]
    return f" Effects that the model has already differ in size: {'; '.join(told)}." if told else ""


def _sizes(parameters: list[Parameter]) -> list[str]:
    """Those that differ, the clearest first, each as refitted and as given."""
    moved = sorted((p for p in parameters if deviations(p) > DIFFERENT), key=deviations, reverse=True)
    names = [p.name if p.name in NOMINAL else plain(p.name) for p in moved]
    return [f"{n} is {number(p.refitted)}, not {number(p.nominal)}" for n, p in zip(names, moved, strict=True)]


def _mostly_new(refitted: float, given: float | None) -> bool:
    """Whether most of the larger size lies between two."""
    return given is not None and 2.0 * abs(refitted - given) > max(abs(refitted), abs(given))


def deviations(parameter: Parameter) -> float:
    """Standard deviations between a parameter as given and as refitted."""
    if parameter.nominal is None:
        return 0.0
    return abs(parameter.refitted - parameter.nominal) / max(parameter.standard_deviation, 1e-12)


def _shrinks(found: Diagnosis) -> str:
    shrink = found.gap.shrink
    if "lost_commands" in found.selected and not found.finding.selected:
        return "No model can tell which commands will be lost, so that no shrink is told; errors count only the others."
    if not found.finding.selected:
        return "It shows in the camera's poses and leaves the path alone, so that no shrink is told."
    if shrink.value is None or shrink.interval is None:
        return "On the runs kept for judging, the gap does not stand out from noise, so that no shrink can be told."
    it = "it" if len(found.selected) == 1 else "them"
    low, high = map(percent, shrink.interval)
    return f"With {it} in the model the gap shrinks by {percent(shrink.value)} (90{SPACE}% interval {low} to {high})."


def _doubt(found: Diagnosis) -> str:
    """Which selected effects could be others."""
    doubtful = [c for c in found.judgement.causes if c.indistinguishable_from and c.effect in found.selected]
    told = (
        f" This input cannot tell {plain(c.effect)} from {together(c.indistinguishable_from, 'or')}." for c in doubtful
    )
    return "".join(told)


def _place(found: Diagnosis) -> str:
    """The largest channel and the most probable site."""
    channel, share = max(found.where.excess.items(), key=lambda pair: pair[1])
    site, likely = max(found.judgement.sites.items(), key=lambda pair: pair[1])
    seen = f"{percent(share)} of it shows {words.CHANNELS[channel]}" if share > 0.0 else ""
    looks = f"it looks like {words.LOOKS[site]}" if likely > 0.0 else ""
    told = ", and ".join(part for part in (seen, looks) if part)
    return f"; {told}" if told else ""


def _best_try(found: Diagnosis) -> str:
    shrink, best = found.gap.shrink, found.finding.selected
    if not best:
        return "No set of known effects makes it smaller."
    if shrink.value is None:
        return f"Of the best known set, {together(best)}, no shrink can be told on the runs kept for judging."
    return f"The best known set, {together(best)}, shrinks it by {percent(shrink.value)} and leaves the rest."
