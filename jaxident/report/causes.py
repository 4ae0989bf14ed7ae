"""The part of a diagnosis's page that speaks of effects: which cause the gap, how far it shrinks, what stays hidden."""

from collections.abc import Iterable

import numpy as np

from jaxident import plot
from jaxident.diagnosis.causes.finding import CLAIMED, Entrant
from jaxident.diagnosis.detectability import DRAWS, FAINT, Replay
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.diagnosis.posterior import believable_excess, believable_slip, rest_of, slip_of_drive
from jaxident.diagnosis.smallest_effects import smallest_sizes
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import ASIDE, PLACES
from jaxident.report.page import PHONE, Figure, Section, Table
from jaxident.report.words import EFFECTS, chance, number, parameters, percent, plain, together

SHOWN = 10
"""Effects in a picture: the best of them."""


def causes(found: Diagnosis) -> Section:
    """Which effects: probabilities, parameters, look-alikes, the ranking, and what none of them explains."""
    judgement = found.judgement
    text = (
        f"Probability that anything is missing in the nominal model: {chance(judgement.gap)}. That something takes "
        f"part which no named effect covers: {chance(judgement.unexplained)}. The probability of an effect below says "
        "that it takes part, whatever else does."
    )
    table = _cause_table(found)
    first = table if table.rows else "No effect of the catalogue is likely to take part."
    words = [*_look_alikes(found), *_untold(found)]
    return Section("Which effect causes it", [text, first, *words, RANKING, _ranking(found), *_unexplained(found)])


RANKING = (
    "Sets of effects are compared by their evidence. The gain of an effect is how much better it explains the runs "
    "beside the others of its set, nominal parameters refitted. An effect is claimed from the black tick on. The tick "
    "pays for the numbers of the effect, for the many effects that were looked at, and for stretches that do not agree "
    "on it."
)


def _cause_table(found: Diagnosis) -> Table:
    in_force = {effect.name: effect for effect in found.corrected_model.effects}
    rows, shares = [], {row.part: row.share for row in found.account.rows}
    for cause in found.judgement.causes:
        effect = in_force.get(cause.effect)
        size = "–" if effect is None else parameters(cause.effect, effect.parameters, effect.standard_deviation)
        share = percent(shares.get(cause.effect))
        rows.append((plain(cause.effect), EFFECTS[cause.effect], chance(cause.probability), share, size))
    return Table(("effect", "what it is", "takes part", "share of the error", "size ± standard deviation"), rows,
                 "Most probable first; shares and sizes are those of the corrected model.")  # fmt: skip


def _look_alikes(found: Diagnosis) -> list[str]:
    """For each cause the effects that this input cannot tell from it."""
    return [
        f"This input cannot tell {plain(cause.effect)} from {together(cause.indistinguishable_from, 'or')}: any of "
        "them may be the cause."
        for cause in found.judgement.causes
        if cause.indistinguishable_from
    ]


def _untold(found: Diagnosis) -> list[str]:
    """A word on what no log with these effects can tell."""
    if ASIDE[0] not in found.selected:
        return []
    return [] if PLACES[ASIDE] in found.finding.fit.places else [BESIDE]


BESIDE = (
    "How far left of the axle's middle the marker lies is not told, and taken for 0: seen from a point beside it a "
    "robot is another nominal robot, whose parameters those of the corrected model are."
)


def _ranking(found: Diagnosis) -> Figure | str:
    """The effects of the corrected model, what could stand in for them, and what comes nearest to joining them."""
    alike = {other for cause in found.judgement.causes for other in cause.indistinguishable_from}
    best = sorted(found.finding.entrants(alike), key=lambda entrant: -entrant.evidence)[:SHOWN]
    if not best:
        return "No effect promised enough to be fitted."
    best.sort(key=lambda entrant: -entrant.gain)
    taking = {cause.effect: cause.probability for cause in found.judgement.causes}
    names = {_entrant(each): each for each in best}
    groups = {name: _group(each, found) for name, each in names.items()}
    figure, ax = plot.figure(size=(PHONE, 1.0 + _row(names) * max(len(best), 2)))
    plot.ranking({name: each.gain for name, each in names.items()},
                 {name: each.gain - each.evidence for name, each in names.items()},
                 notes={name: chance(taking.get(each.effect, 0.0)) for name, each in names.items()},
                 groups={name: group for name, group in groups.items() if group}, ax=ax)  # fmt: skip
    caption = "The most promising effects; behind each point the probability that the effect takes part."
    return Figure(plot.image(figure), "Effects by the gain that each brings beside the others", caption)


def _row(names: Iterable[str]) -> float:
    """Height of a picture's row [inch] under the tallest of its names."""
    return max(0.27, 0.18 * max(name.count("\n") + 1 for name in names))


def _label(effects: tuple[str, ...]) -> str:
    return "\n+ ".join(plain(name) for name in effects)


def _entrant(each: Entrant) -> str:
    return plain(each.effect) + (f"\nfor {plain(each.instead)}" if each.instead else "")


def _group(each: Entrant, found: Diagnosis) -> str:
    if each.instead:
        return "looks alike"
    return "corrected model" if each.effect in found.finding.selected else ""


def _unexplained(found: Diagnosis) -> list[str | Table]:
    """What a library of forces, speeds and camera errors explains beyond the best set."""
    terms = found.finding.rest.terms
    if not terms:
        return [*_beyond_words(found), NO_TERMS]
    rows = [(term.name, term.site, float(gain)) for term, gain in terms]
    text = (
        "What the best set of effects leaves unexplained: terms from a library of simple forces and camera errors that "
        f"would explain more, {percent(found.finding.unexplained)} of all that can be explained. Commands, and "
        "so the words small and large, are over the largest one."
    )
    if found.simulator is not None and found.simulator.finding is not None:
        own = rest_of(found.finding, found.simulator) / max(found.finding.rest.gain, 1e-9)
        text += f" Of that, {percent(own)} is beyond what the simulator's logs leave unexplained as well."
    table = Table(("term", "site", "gain"), rows, "They are no effects by name; they say where to look.")
    return [text, table, *_beyond_words(found)]


NO_TERMS = "A library of simple forces and camera errors explains nothing more."


def _beyond_words(found: Diagnosis) -> list[str]:
    """What speaks for something unknown without saying where."""
    excess, slip = found.gap.excess, slip_of_drive(found.finding)
    words = []
    if excess > believable_excess(found.simulator):
        words.append(f"Stretches that took no part in any fit are predicted {number(excess)} times worse than noise "
                     "allows, at the least.")  # fmt: skip
    if slip > believable_slip(found.simulator):
        words.append(f"What is left, {percent(found.gap.left)} of the error, looks like random slip of {percent(slip)} "
                     "of full drive: more than wheels slip without a cause.")  # fmt: skip
    return words


def shrink(found: Diagnosis) -> Section:
    """How far each effect makes the gap shrink, with the placebo."""
    gap = found.gap
    rows: dict[str, tuple[float, tuple[float, float], str]] = {}
    chosen, laws = found.finding.selected, ("discovered laws",) if found.discovered else ()
    if chosen and gap.shrink.value is not None and gap.shrink.interval is not None:
        rows[_label(chosen)] = gap.shrink.value, gap.shrink.interval, "all named effects" if laws else CORRECTED
    if laws and gap.whole.value is not None and gap.whole.interval is not None:
        rows[_label((*chosen, *laws))] = gap.whole.value, gap.whole.interval, CORRECTED
    weak = gap.placebo[0] if gap.placebo else ""
    for name, one in sorted(found.shrinks.items(), key=lambda pair: (pair[0] == weak, -(pair[1].value or 0.0))):
        if one.value is not None and one.interval is not None and plain(name) not in rows:
            rows[plain(name)] = one.value, one.interval, "placebo" if name == weak else "each effect alone"
    if not rows:
        told = NOTHING_TO_SHRINK if gap.shrink.value is None else NOTHING_NAMED
        return Section("How far the gap shrinks", [told])
    figure, ax = plot.figure(size=(PHONE, 1.0 + _row(rows) * max(len(rows), 2)))
    plot.shrinks({n: row[0] for n, row in rows.items()}, {n: row[1] for n, row in rows.items()},
                 groups={n: row[2] for n, row in rows.items()}, ax=ax)  # fmt: skip
    return Section("How far the gap shrinks", [SHRINK, Figure(plot.image(figure), "Shrink of the gap by effect")])


NOTHING_TO_SHRINK = (
    "With its parameters refitted, the nominal model's error does not stand out from noise: no gap is left to shrink."
)
NOTHING_NAMED = "No effect is named and no law is discovered, so nothing shrinks the gap."
CORRECTED = "corrected model"
SHRINK = (
    "0 % leaves the gap as it is after the nominal parameters are refitted, 100 % brings it down to the floor; beyond, "
    "the error came out below the floor. All on stretches that took no part in finding the effect. Intervals (90 %) "
    "hold the chance in these stretches and what is not known of the noise and of the parameters. The placebo is the "
    "effect that least speaks for: its interval should hold 0 %, or the numbers above it are worth less."
)


def hidden(found: Diagnosis) -> Section:
    """What this input could have shown: the gain of each effect at typical size, and the smallest it shows."""
    smallest = smallest_sizes(found.visible)
    rows = []
    for name, gain in sorted(found.visible.items(), key=lambda pair: pair[1]):
        size, typical = smallest[name], CATALOGUE[name].typical()
        shown = {key: typical[key] for key in (size or typical)}
        least = "–" if size is None else parameters(name, size)
        rows.append(
            (plain(name), parameters(name, shown), float(f"{gain:.3g}"), "yes" if gain >= CLAIMED else "no", least)
        )
    missed = found.not_testable
    lead = (
        f"This input could not have shown {together(missed, 'or')} at its typical size: nothing here speaks against it."
        if missed else "This input would have shown every effect that shapes the path, at its typical size."
    )  # fmt: skip
    table = Table(("effect", "typical size", "gain", "visible", "smallest visible"), rows, HIDDEN_CAPTION)
    return Section("What this input could have shown", [lead, table, DIRECT, *_replays(found.replay)], folded=True)


def _replays(replay: Replay) -> list[str | Figure]:
    """What faint effects come out as on this input."""
    if not replay.effects:
        return []
    labels = ["none", *(plain(name) for name in replay.effects)]
    count, own = len(replay.effects), np.diagonal(replay.named)[1:]
    poor = [plain(name) for name, share in zip(replay.effects, own, strict=True) if share < TOLD]
    text = REPLAYS.format(
        wrong=percent(1.0 - replay.named[0, 0]), right=percent(float(own.mean())), count=count,
        poor=f" Named in fewer than {percent(TOLD)}: {together(poor)}." if poor else "",
    )  # fmt: skip
    figure, ax = plot.figure(size=(6.3, 1.5 + 0.17 * len(labels)))
    plot.confusion(replay.named, labels, labels, ax=ax)
    return [text, Figure(plot.image(figure), "What faint effects come out as", REPLAYS_CAPTION)]


TOLD = 0.8
"""Share of replays in which a faint effect should be named."""
REPLAYS = (
    "Replays on this very input and noise: without any effect {wrong} claim one; each of {count} effects, made faint, "
    "is named in {right} on average.{poor}"
)
REPLAYS_CAPTION = (
    f"Rows: what was hidden, so faint that its expected gain is {FAINT:g}; columns: what its scores name, in per cent "
    f"of {DRAWS} replays. To first order in the effect, one effect at a time, all fits taken to succeed."
)


HIDDEN_CAPTION = (
    f"Gain at the typical size, nominal parameters refitted; visible from {CLAIMED:g} on, to which the smallest size "
    "is scaled. A claim pays for each number of the effect as well."
)
DIRECT = (
    "Frozen frames, outliers and camera errors that persist are looked for in the frames themselves and in the noise; "
    "they need no special input."
)
