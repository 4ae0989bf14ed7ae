"""From evidence to probabilities, and from those to a verdict."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxident.diagnosis.account.discovered import Shown
from jaxident.diagnosis.account.measure import Gap
from jaxident.diagnosis.account.shrink import RESAMPLES
from jaxident.diagnosis.causes.finding import CLAIMED, Finding
from jaxident.diagnosis.simulator import Simulator
from jaxident.effects.catalogue import CATALOGUE, SITES
from jaxident.effects.coordinates import natural

SIGNIFICANT, SHARE = 20.0, 0.05
"""Fall of -log p that terms in no catalogue must bring beyond the best set, and their part of all that is explained,
for something to take part that has no name. A discovered law must take that part of the error away. On simulated robots
with one effect of the catalogue beside one of none the part of the terms was 0.05 to 0.9."""
SHARPNESS = 0.01, 4.0
"""Width of both thresholds: how slowly probability passes from known to unknown."""
HIDDEN, HIDDEN_SHARPNESS = 0.2, 0.04
"""Part of the error that the corrected model leaves, and the width of that threshold, from which on slip may hide a
cause."""
EXCESS = 2.0
"""A gap is unknown where the corrected model's error on runs that serve nothing else, at the low end of its interval,
is this many times what noise could make it at most."""
BELIEVABLE = 0.025
"""Random slip beyond this part of full drive, at a correlation time of SLOW [s], is a cause nobody has found yet, but
where the selected set explains all but HIDDEN of the error: wheels that slide never do so quite as a model has."""
MORE = 2.0
"""Times a simulator's slip, and excess, that a robot's may be: slip of two halves of one log of a real robot differs by
up to 1.7."""
SLOW = 0.2
"""Correlation time [s] at which slip is compared."""
WIDTH = 0.12
"""Of both thresholds, as a logarithm."""
ALIKE = 3.0
"""Log evidence by which a set may be behind another that it cannot be told from: it is more than a twentieth as
likely."""
NOWHERE = {"actuation": 0.2, "drive": 0.4, "contact": 0.4, "time": 0.0, "camera": 0.0}
"""Sites of a gap that no term of the corrector places."""


class Cause(NamedTuple):
    """One effect: the probability that it takes part, and effects that this input cannot tell from it."""

    effect: str
    site: str
    probability: float
    indistinguishable_from: tuple[str, ...]
    extension: bool


class Judgement(NamedTuple):
    """Two statements: probabilities of sets of effects, () for none, which add up to one, whatever else takes part; and
    `unexplained`, that something takes part which no named effect covers. causes, most probable first; probability of
    each site."""

    unexplained: float
    sets: list[tuple[tuple[str, ...], float]]
    causes: list[Cause]
    sites: dict[str, float]

    @property
    def none(self) -> float:
        """Probability that no effect takes part."""
        return sum(p for effects, p in self.sets if not effects)

    @property
    def gap(self) -> float:
        """Probability that anything is beyond the nominal model."""
        return 1.0 - self.none * (1.0 - self.unexplained)


def judge(
    finding: Finding,
    gap: Gap,
    extra: dict[str, float],
    simulator: Simulator | None = None,
    laws: Sequence[Shown] = (),
) -> Judgement:
    """Probabilities from the log evidence of the selected set and its neighbours, from what they leave unexplained, and
    from effects that show in the frames or in the noise law (`extra`: name to evidence). What the simulator has already
    is no gap. laws: discovered ones that the nominal model has not."""
    known_there = () if simulator is None else simulator.effects
    sure = {name for name, evidence in extra.items() if evidence > CLAIMED} - set(known_there)
    top = max(finding.values.values())
    total = sum(np.exp(value - top) for value in finding.values.values())
    explained = 1.0 - unexplained_probability(finding, gap, simulator)
    unexplained = 1.0 - explained * (1.0 - lawful_probability(laws, finding.selected))
    sets: dict[tuple[str, ...], float] = {}
    for effects, value in finding.values.items():
        key = tuple(sorted({*effects - set(known_there), *sure}))
        sets[key] = sets.get(key, 0.0) + float(np.exp(value - top) / total)
    ordered = sorted(((key, p) for key, p in sets.items() if p > 1e-4), key=lambda pair: -pair[1])
    spare = 1.0 - sum(p for _, p in ordered)
    ordered = [(key, p + spare if k == 0 else p) for k, (key, p) in enumerate(ordered)]
    return Judgement(unexplained, ordered, _causes(finding, ordered), _sites(finding, ordered, unexplained))


def unexplained_probability(finding: Finding, gap: Gap, simulator: Simulator | None = None) -> float:
    """How sure it is that something outside the selected set takes part: terms of the corrector explain more, runs that
    served nothing else are predicted worse than noise allows, or more is called slip than wheels slip and more than a
    small part of the error on those runs. What a simulator leaves unexplained as well, or calls slip, is no difference
    between the two."""
    rest = rest_of(finding, simulator)
    large = _logistic((rest - SIGNIFICANT) / SHARPNESS[1])
    explained = large * _logistic((finding.share(rest) - SHARE) / SHARPNESS[0])
    missed = _beyond(gap.excess, believable_excess(simulator))
    slipping = _beyond(slip_of_drive(finding), believable_slip(simulator))
    slipping *= _logistic((gap.left - HIDDEN) / HIDDEN_SHARPNESS)
    return 1.0 - (1.0 - explained) * (1.0 - missed) * (1.0 - slipping)


def lawful_probability(laws: Sequence[Shown], selected: Sequence[str]) -> float:
    """How sure it is that a law takes part in whose place no selected effect acts, and which takes away more than SHARE
    of the error: that of the surest such law, but no surer than RESAMPLES of the judging rows can tell."""
    large = [law for law in laws if law.share > SHARE]
    unlike = [law for law in large if not {*law.kind.effects} & {*selected}]
    return max((1.0 - max(law.p_value, 1.0 / RESAMPLES) for law in unlike), default=0.0)


def rest_of(finding: Finding, simulator: Simulator | None = None) -> float:
    """What terms of the corrector explain, beyond what they explain of as many windows of the simulator."""
    if simulator is None or simulator.finding is None:
        return finding.rest.gain
    other = simulator.finding
    windows = len(finding.data.windows.run) / max(len(other.data.windows.run), 1)
    return max(finding.rest.gain - windows * other.rest.gain, 0.0)


def believable_slip(simulator: Simulator | None = None) -> float:
    """Random slip, as a part of full drive, that no unknown cause is needed for: BELIEVABLE, or MORE times what a
    simulator has itself."""
    if simulator is None or simulator.finding is None:
        return BELIEVABLE
    return max(BELIEVABLE, MORE * slip_of_drive(simulator.finding))


def believable_excess(simulator: Simulator | None = None) -> float:
    """Excess on runs that served nothing else that no unknown cause is needed for: EXCESS, or MORE times what a
    simulator has on its own logs."""
    return EXCESS if simulator is None else max(EXCESS, MORE * simulator.excess)


def slip_of_drive(finding: Finding) -> float:
    """Random slip as a part of full drive, the larger of along and in heading; slip of another correlation time counts
    by its spectral density. Full drive is that of the selected set: a nominal model that bends for want of an effect
    may have a tenth of the robot's."""
    law = finding.law
    if law.slip is None or law.slip_time is None:
        return 0.0
    full = np.abs(natural(finding.fit.vector)[2:6]).reshape(2, 2).sum(axis=1)
    return float(np.max(np.array(law.slip) / full) * np.sqrt(law.slip_time / SLOW))


def _beyond(value: float, threshold: float) -> float:
    return _logistic(np.log(max(value, 1e-9) / threshold) / WIDTH)


def _logistic(value: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(value, -60.0, 60.0))))


def _causes(finding: Finding, sets) -> list[Cause]:
    taking: dict[str, float] = {}
    for effects, p in sets:
        for name in effects:
            taking[name] = taking.get(name, 0.0) + p
    order = sorted(taking, key=lambda name: (name not in finding.selected, -taking[name]))
    return [
        Cause(name, CATALOGUE[name].site, min(taking[name], 1.0), alike(finding, name), CATALOGUE[name].extension)
        for name in order if taking[name] > 1e-3
    ]  # fmt: skip


def alike(finding: Finding, name: str) -> tuple[str, ...]:
    """Effects that in place of one in the selected set leave the evidence nearly as good."""
    if name not in finding.selected:
        return ()
    rest = frozenset(finding.selected) - {name}
    rivals = [e for e, worth in finding.values.items() if len(e) == len(rest) + 1 and rest < e and worth > -ALIKE]
    return tuple(sorted({other for effects in rivals for other in effects - rest} - {name}))


def _sites(finding: Finding, sets, unexplained: float) -> dict[str, float]:
    """Probability that each site takes part; an unknown cause lies where the corrector's terms do, and without any
    somewhere between motors and ground, as what cannot be told from slip does."""
    rest, found = finding.rest.gain, {}
    for site in SITES:
        known = sum(p for effects, p in sets if any(CATALOGUE[name].site == site for name in effects))
        lies = sum(gain for term, gain in finding.rest.terms if term.site == site) / rest if rest else NOWHERE[site]
        found[site] = float(min(known + unexplained * lies, 1.0))
    return found
