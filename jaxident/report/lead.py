"""The first lines of a diagnosis's page: the verdict, in a sentence or two."""

from jaxident.diagnosis.account.account import REST
from jaxident.diagnosis.decide import DIFFERENT, Parameter
from jaxident.diagnosis.diagnose import COASTED, Diagnosis
from jaxident.report import words
from jaxident.report.discovered import sentence
from jaxident.report.words import EFFECTS, NOMINAL, error, number, parameters, percent, plain, together

COUNTS = {2: "two", 3: "three", 4: "four"}
CLEAREST = 3
"""Parameters of another size that are told."""


def lead(found: Diagnosis) -> str:
    """The verdict with all that belongs to it, in a few sentences."""
    return f"{headline(found)} {further}" if (further := details(found)) else headline(found)


def details(found: Diagnosis) -> str:
    """What the headline leaves out: shares, known effects of another size, look-alikes, effects that were refused or
    are needless, noise that is too large, and rates that are no measurement; empty where there is nothing of that."""
    named = found.verdict in ("effects", "partly")
    own = f"{_due(found)}{_resized(found)}{_doubt(found)}" if named else ""
    others = [f" {told}" for told in (refusal(found), needless(found), too_much_noise(found)) if told]
    held = [f" {line[0].upper()}{line[1:]}." for line in found.suspicions if line in COASTED]
    return f"{own}{''.join((*others, *held))}".strip()


def headline(found: Diagnosis) -> str:
    """The verdict in two or three sentences, and what was discovered in one."""
    return f"{_verdict(found)}{_discovered(found)}"


def refusal(found: Diagnosis) -> str:
    """Effects that the judging runs refuse, in a sentence; nothing where there are none."""
    why = "the runs for naming, but with {it} the model predicts the runs kept for judging worse (95 % sure). So"
    return _without(found.refused, ("fits", "fit"), why)


def needless(found: Diagnosis) -> str:
    """Effects that discovered laws make needless, in a sentence; nothing where there are none."""
    why = "named at first. What was discovered stands in {its} place, and"
    return _without(found.needless, ("was", "were"), why)


def _without(effects: tuple[str, ...], verbs: tuple[str, str], why: str) -> str:
    """Why the corrected model lacks some effects; verbs: for one and for several. Nothing where there are none."""
    if not effects:
        return ""
    names, number = together(effects), int(len(effects) > 1)
    it, its = (("it", "its"), ("them", "their"))[number]
    begin = f"{names[0].upper()}{names[1:]} {verbs[number]} {why.format(it=it, its=its)}"
    return f"{begin} the corrected model has not got {it}."


def too_much_noise(found: Diagnosis) -> str:
    """A sentence where the corrected model misses by less than noise should make, below its 90 % interval; else
    nothing. Of 106 sealed robots 5 have it, as many as chance alone would."""
    gap = found.gap
    if not gap.discovered < gap.floor_interval[0]:
        return ""
    should, missed = error(gap.rms["floor"]), error(gap.rms["discovered"])
    return (
        f"The noise, sized on the runs for naming, should make {should} on the runs kept for judging. The corrected "
        f"model misses them by less ({missed}). So camera, start and slip probably have smaller parts than shown."
    )


def _discovered(found: Diagnosis) -> str:
    """Laws in no catalogue, and what they leave."""
    if not found.discovered:
        return ""
    laws = _listed([sentence(shown) for shown in found.discovered])
    return f" Discovered: {laws}. With that {error(found.gap.rms['discovered'])} are left."


def _verdict(found: Diagnosis) -> str:
    rms = found.gap.rms
    if found.verdict == "no_gap":
        return (
            f"No gap: {_ahead(found)} the model is off by {error(rms['refitted'])} (root mean square), where noise "
            f"alone makes {error(rms['floor'])}."
        )
    if found.verdict == "parameters":
        return (
            f"The model has the right form but not the right parameters: {_moved(found)}. Refitting them takes the "
            f"error {_ahead(found)} from {error(rms['before'])} to {error(rms['refitted'])} (root mean square); noise "
            f"alone makes {error(rms['floor'])}."
        )
    if found.verdict in ("effects", "partly"):
        return f"{_named(found)}{_left(found)}"
    if found.verdict == "unknown":
        return f"There is a gap that no effect of the catalogue explains{_place(found)}. {_size(found)}"
    return f"These logs do not suffice for a verdict. {found.next}"


def _ahead(found: Diagnosis) -> str:
    return f"{found.gap.horizon:.3g}{words.SPACE}s ahead"


def _size(found: Diagnosis) -> str:
    """How large the refitted model's error is beside noise."""
    rms = found.gap.rms
    return (
        f"The nominal model is off by {error(rms['refitted'])} {_ahead(found)} (root mean square), where noise alone "
        f"makes {error(rms['floor'])}."
    )


def _named(found: Diagnosis) -> str:
    """What was named, and how large the error is."""
    many = f"{COUNTS.get(len(found.selected), 'several')} unmodelled effects"
    count = "one unmodelled effect" if len(found.selected) == 1 else many
    begin = "The gap comes from" if found.verdict == "effects" else "A part of the gap comes from"
    return f"{begin} {count}: {_in_words(found)}. {_size(found)}"


def _due(found: Diagnosis) -> str:
    """The part of the error that each selected effect makes, and those that take none of it away."""
    own = [(plain(row.part), row.share) for row in found.account.rows if row.part in found.selected]
    told = [f"{percent(share)} is due to {name}" for name, share in own if share > 0.0]
    idle = [name for name, share in own if share <= 0.0]
    due = f" Of the mean squared error {_listed(told)}." if told else ""
    if not idle:
        return due
    return f"{due} On the runs kept for judging {_listed(idle)} {'take' if len(idle) > 1 else 'takes'} nothing away."


def _in_words(found: Diagnosis) -> str:
    """The selected effects with what they are and their parameters, for a sentence."""
    in_force = {effect.name: effect for effect in found.corrected_model.effects}
    parts = []
    for name in found.selected:
        effect = in_force.get(name)
        size = "" if effect is None else f"; {parameters(name, effect.parameters, effect.standard_deviation)}"
        parts.append(f"{plain(name)} ({EFFECTS[name]}{size})")
    return _listed(parts)


def _listed(parts: list[str]) -> str:
    """Parts of a sentence in a row."""
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else "".join(parts)


def _left(found: Diagnosis) -> str:
    """What the corrected model leaves, and whether something without a name is in it."""
    after = (
        f" With {'it' if len(found.selected) == 1 else 'them'} in the model {error(found.gap.rms['after'])} are left."
    )
    if not found.finding.selected and found.verdict == "effects":
        after = " It acts by chance, so that no model can tell when."
    if found.verdict == "effects":
        return after
    rest = next((row for row in found.account.rows if row.part == REST), None)
    size = "" if rest is None or rest.share <= 0.0 else f", {percent(rest.share)} of the error"
    return f"{after} Something else takes part that no named effect covers{size}{_place(found)}."


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
