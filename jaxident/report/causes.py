"""The part of a diagnosis's page that speaks of effects: which cause the gap, how far it shrinks, what stays hidden."""

from collections.abc import Iterable

import numpy as np

from jaxident import plot
from jaxident.diagnosis.causes.candidates import ENOUGH, PENALTY, Candidate, value
from jaxident.diagnosis.diagnose import Diagnosis
from jaxident.diagnosis.replay import DRAWS, FAINT, Replay
from jaxident.diagnosis.verdict import believable_excess, believable_slip, rest_of, slip_of_drive
from jaxident.diagnosis.visible import smallest_sizes
from jaxident.effects.catalogue import CATALOGUE
from jaxident.effects.coordinates import ASIDE, COORDINATES, PLACES
from jaxident.report.page import Figure, Section, Table
from jaxident.report.words import EFFECTS, chance, number, parameters, percent, plain, together

SHOWN = 10
"""Candidates in a picture: the best of them."""


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
    "Every effect of the catalogue was scored; the most promising were fitted in full, the nominal parameters along "
    "with them. The gain is how much better the runs are then explained. It must pay for each number of the effect, "
    "for chance and, beside others, for what may be their form, before the effect is claimed: that is the black tick."
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
    best = found.finding.candidates[found.finding.selected].solution
    return [] if PLACES[ASIDE] in best.places else [BESIDE]


BESIDE = (
    "How far left of the axle's middle the marker lies is not told, and taken for 0: seen from a point beside it a "
    "robot is another nominal robot, whose parameters those of the corrected model are."
)


def _ranking(found: Diagnosis) -> Figure | str:
    """The best candidates, sets of several effects among them, with their probabilities."""
    finding = found.finding
    best = sorted((c for e, c in finding.candidates.items() if e), key=lambda c: -c.evidence)[:SHOWN]
    if not best:
        return "No effect promised enough to be fitted."
    sets: dict[tuple[str, ...], float] = {}
    for effects, p in found.judgement.sets:
        searched = tuple(sorted(name for name in effects if name in COORDINATES))
        sets[searched] = sets.get(searched, 0.0) + p
    best.sort(key=lambda c: -c.gain)
    alike = {other for cause in found.judgement.causes for other in cause.indistinguishable_from}
    names = [_label(c.effects) for c in best]
    groups = {name: _group(c, found, alike) for name, c in zip(names, best, strict=True)}
    notes = {n: chance(sets.get(tuple(sorted(c.effects)), 0.0)) for n, c in zip(names, best, strict=True)}
    needed = {n: c.gain - value(c, finding.asked) for n, c in zip(names, best, strict=True)}
    figure, ax = plot.figure(size=(6.3, 1.0 + _row(names) * max(len(best), 2)))
    plot.ranking({n: c.gain for n, c in zip(names, best, strict=True)}, needed, notes=notes,
                 groups={name: group for name, group in groups.items() if group}, ax=ax)  # fmt: skip
    count = len(finding.candidates) - 1
    which = f"The {SHOWN} best of {count} candidates" if count > SHOWN else "All candidates that were fitted"
    caption = f"{which}, those that together make a set among them; behind each bar the probability of that very set."
    return Figure(plot.image(figure), "Candidate effects by the gain that each brings", caption)


def _row(names: Iterable[str]) -> float:
    """Height of a picture's row [inch] under the tallest of its names."""
    return max(0.27, 0.18 * max(name.count("\n") + 1 for name in names))


def _label(effects: tuple[str, ...]) -> str:
    return "\n+ ".join(plain(name) for name in effects)


def _group(candidate: Candidate, found: Diagnosis, alike: set[str]) -> str:
    if candidate.effects == found.finding.selected:
        return "corrected model"
    rest = set(candidate.effects) - set(found.finding.selected)
    same_size = len(candidate.effects) == len(found.finding.selected)
    return "looks alike" if rest and rest <= alike and same_size else ""


def _unexplained(found: Diagnosis) -> list[str | Table]:
    """What a library of forces, speeds and camera errors explains beyond the best set."""
    terms = found.finding.terms
    if not terms:
        return [*_beyond_words(found), NO_TERMS]
    rows = [(term.name, term.site, float(gain)) for term, gain in terms]
    text = (
        "What the best set of effects leaves unexplained: terms from a library of simple forces and camera errors that "
        f"would explain more, {percent(found.finding.unexplained)} of all that can be explained. Commands, and "
        "so the words small and large, are over the largest one."
    )
    if found.simulator is not None and found.simulator.finding is not None:
        own = rest_of(found.finding, found.simulator) / max(found.finding.rest, 1e-9)
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
    chosen = _label(found.finding.selected)
    if chosen and gap.shrink.value is not None and gap.shrink.interval is not None:
        rows[chosen] = gap.shrink.value, gap.shrink.interval, "corrected model"
    weak = gap.placebo[0] if gap.placebo else ""
    for name, one in sorted(found.shrinks.items(), key=lambda pair: (pair[0] == weak, -(pair[1].value or 0.0))):
        if one.value is not None and one.interval is not None and plain(name) not in rows:
            rows[plain(name)] = one.value, one.interval, "placebo" if name == weak else "other effects, alone"
    if not rows:
        return Section("How far the gap shrinks", [NOTHING_TO_SHRINK])
    figure, ax = plot.figure(size=(6.3, 1.0 + _row(rows) * max(len(rows), 2)))
    plot.shrinks({n: row[0] for n, row in rows.items()}, {n: row[1] for n, row in rows.items()},
                 groups={n: row[2] for n, row in rows.items()}, ax=ax)  # fmt: skip
    return Section("How far the gap shrinks", [SHRINK, Figure(plot.image(figure), "Shrink of the gap by effect")])


NOTHING_TO_SHRINK = (
    "With its parameters refitted, the nominal model's error does not stand out from noise: no gap is left to shrink."
)
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
            (plain(name), parameters(name, shown), float(f"{gain:.3g}"), "yes" if gain >= ENOUGH else "no", least)
        )
    missed = found.not_testable
    lead = (
        f"This input could not have shown {together(missed, 'or')} at its typical size: nothing here speaks against it."
        if missed else "This input would have shown every effect that shapes the path, at its typical size."
    )  # fmt: skip
    table = Table(("effect", "typical size", "gain", "visible", "smallest visible"), rows, HIDDEN_CAPTION)
    return Section("What this input could have shown", [lead, table, DIRECT, *_replays(found.replay)])


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
    f"Gain at the typical size, nominal parameters refitted; visible from {ENOUGH:g} on, to which the smallest size is "
    f"scaled. A claim asks for {PENALTY:g} more for each number of the effect."
)
DIRECT = (
    "Frozen frames, outliers and camera errors that persist are looked for in the frames themselves and in the noise; "
    "they need no special input."
)
