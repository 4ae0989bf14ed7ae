"""One diagnosis from start to end: logs in; gap, place, causes, shrink and corrected model out."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxident.diagnosis.account.account import Account
from jaxident.diagnosis.account.discovered import Shown
from jaxident.diagnosis.account.measure import Gap, Measured, measure
from jaxident.diagnosis.account.models import as_model
from jaxident.diagnosis.account.odometry import Odometry, odometry
from jaxident.diagnosis.account.refused import finding_without
from jaxident.diagnosis.account.shrink import LOW, Shrink, taken
from jaxident.diagnosis.account.where import Place
from jaxident.diagnosis.causes.chance_effects import direct_effects, direct_evidence, present
from jaxident.diagnosis.causes.finding import CLAIMED, Finding, find_effects
from jaxident.diagnosis.decide import Parameter, advice, compare_parameters, decide
from jaxident.diagnosis.detectability import Replay, answers, replay, visible
from jaxident.diagnosis.fit.prior import held_rates
from jaxident.diagnosis.laws.not_shown import NotShown, not_shown
from jaxident.diagnosis.posterior import Judgement, judge
from jaxident.diagnosis.preparation.prepare import Prepared, prepare, suspected_wheels
from jaxident.diagnosis.preparation.translate import to_model
from jaxident.diagnosis.simulator import Simulator, as_simulator, check_units, inspect_simulator, shared
from jaxident.errors import InputError
from jaxident.estimation.poses.prior import RATE
from jaxident.estimation.suspicions.log_suspicions import log_suspicions
from jaxident.log import Log, join
from jaxident.numerics import require_float64
from jaxident.robot.model import Model

_COASTS = "the poses ask for a robot that coasts, whatever it is told, and such a robot predicts nothing; "
_WHEELS = "; wheel speeds would tell them"
COASTED = (
    f"{_COASTS}robots answer within seconds: rates are held at {RATE:g} 1/s, without coupling{_WHEELS}",
    f"{_COASTS}rates and couplings are held at those of the model that was given{_WHEELS}",
)
"""Lines where rates are held, without a given nominal model and with one."""


class Diagnosis(NamedTuple):
    """What `diagnose` found.

    Attributes:
        verdict: "no_gap", "parameters", "effects", "partly", "unknown" or "undecided".
        judgement: probabilities of sets of effects, of each effect and of each site.
        gap: mean squared error of the nominal and the corrected model on rows used for nothing else, and the floor.
        account: parts of that error, by effect and by place.
        where: channels and regions of the input where the error is.
        selected: the named effects, in the order in which they were accepted.
        parameters: nominal parameters as given and as refitted.
        visible: the gain that each effect of typical size would have had. Below CLAIMED this input could not have
            shown it.
        replay: what faint effects come out as.
        next: what to do next.
        nominal_model: the model without the effects.
        corrected_model: the model with them, and with the discovered laws.
        shrinks: how far each named effect by itself shrinks the error beyond the floor.
        prepared: the logs as cut for naming and judging.
        finding: what the search found.
        surplus: effects that the user's simulator has and the robot has not.
        simulator: what was found of that simulator.
        discovered: laws in no catalogue.
        suspicions: what the log says against itself, with the option that mends it, a line each.
        refused: effects that fit the runs for naming, and without which the judging runs are predicted better (95 %
            sure). The corrected model has none of them.
        needless: effects that were named before the laws were discovered, and in whose place these stand. The corrected
            model has none of them, either.
        odometry: the judging stretches as the wheels tell them; None without wheel speeds.
        not_shown: why some laws were not looked for.
    """

    verdict: str
    judgement: Judgement
    gap: Gap
    account: Account
    where: Place
    selected: tuple[str, ...]
    parameters: list[Parameter]
    visible: dict[str, float]
    replay: Replay
    next: str
    nominal_model: Model
    corrected_model: Model
    shrinks: dict[str, Shrink]
    prepared: Prepared
    finding: Finding
    surplus: tuple[str, ...] = ()
    simulator: Simulator | None = None
    discovered: tuple[Shown, ...] = ()
    suspicions: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    needless: tuple[str, ...] = ()
    odometry: Odometry | None = None
    not_shown: NotShown = NotShown()

    @property
    def not_testable(self) -> list[str]:
        """Effects that this input could not have shown at their typical size, and that are not among the named."""
        return [name for name, gain in self.visible.items() if gain < CLAIMED and name not in self.selected]


def diagnose(
    logs: Log | Sequence[Log],
    *,
    sim: Log | Sequence[Log] | None = None,
    model: Model | None = None,
    horizon: float | None = None,
    seed: int = 0,
) -> Diagnosis:
    """Diagnose the gap between a robot's logs and a nominal model: where it lies, which effect causes it, how far it
    shrinks.

    A third of the runs is kept for judging, the second and others two to five apart; of one or two runs, a third of
    their parts. Of a long log at most 16,000 rows fit and 8,000 judge, those whose commands tell most. The gap, its
    account and how far it shrinks come from the rows that judge alone. Effects and discovered laws that the nominal
    model has are no gap. Needs double precision and about a minute.

    Args:
        logs: the robot's logs, several runs if possible.
        sim: logs of the user's own simulator. The nominal model is then the one behind these.
        model: the nominal model. Without `sim` and `model` it is identified from the logs.
        horizon: how far ahead the models are compared [s], by default 1, bounded to 20 to 60 rows.
        seed: of the laws of noise that are drawn and of the shuffles behind intervals.

    Returns:
        Diagnosis: verdict, named effects, account of the error, nominal and corrected model. `report` writes the page.

    Raises:
        InputError: logs that tell nothing, a simulator in other units, or both `sim` and `model`.

    Examples:
        >>> import dataclasses, jax, jaxident as ji
        >>> ji.start_jax()
        >>> nominal = dataclasses.replace(ji.load_model("published"), noise=ji.Noise(position=5e-4, heading=5e-3))
        >>> robot = dataclasses.replace(nominal, effects=(ji.Effect("transport_delay", {"delay": 0.1}),))
        >>> inputs = [ji.excite(jax.random.key(k), "multilevel", 600, robot.sample_period) for k in range(3)]
        >>> logs = [ji.simulate(robot, u, key=jax.random.key(k + 3)) for k, u in enumerate(inputs)]
        >>> gap = ji.diagnose(logs, model=nominal)
        >>> gap.verdict, gap.selected
        ('effects', ('transport_delay',))
    """
    require_float64("diagnose")
    check_nominal(logs, sim, model)
    simulator = None if model is None else as_simulator(model, logs)
    begin = None if simulator is None else simulator.vector
    prepared, finding = find_effects(prepare(logs, horizon, begin, laws=() if model is None else model.discovered))
    if sim is not None:
        simulator, finding = inspect_simulator(sim, prepared, finding)
    (finding, extra, shown, measured), refused, needless = believed(prepared, finding, simulator, seed)
    gap, account, where, shrinks, corrected, laws, *_ = measured
    told = None if simulator is None else simulator.vector
    common, surplus = shared(shown, simulator)
    judgement = judge(finding, gap, extra, simulator, laws)
    selected = tuple(name for name in shown if name not in common) if judgement.none < 0.5 else ()
    known = answers(finding.data, finding.nominal, prepared.largest)
    parameters = compare_parameters(prepared, finding, told, common)
    verdict = decide(prepared, judgement, selected, parameters)
    nominal = to_model(prepared, finding.nominal.vector, finding.law, (), None, finding.nominal)
    return Diagnosis(verdict, judgement, gap, account, where, selected, parameters, visible(known), replay(known, seed),
                     advice(verdict, judgement, laws, prepared.whole), nominal, corrected, shrinks, prepared, finding,
                     surplus, simulator, laws, suspicions_of(join(logs), prepared),
                     refused, needless, odometry(prepared, gap.paths, corrected),
                     not_shown(finding.fit, finding.data.windows))  # fmt: skip


class Seen(NamedTuple):
    """What the judging rows say of a finding: the evidence of effects that show without a refit, all effects present,
    and what is measured of them."""

    finding: Finding
    extra: dict[str, float]
    shown: tuple[str, ...]
    measured: Measured


def believed(
    prepared: Prepared, finding: Finding, simulator: Simulator | None, seed: int
) -> tuple[Seen, tuple[str, ...], tuple[str, ...]]:
    """A finding measured on the rows kept for judging, the effects that these rows refuse, and those that discovered
    laws make needless. While some are refused, it is measured again without them; then without the needless ones,
    unless these rows are predicted worse then."""
    refused: tuple[str, ...] = ()
    seen = see(prepared, finding, simulator, seed)
    while more := seen.measured.refused:
        refused = (*refused, *more)
        seen = see(prepared, finding_without(seen.finding, more), simulator, seed)
    needless = seen.measured.needless
    if needless:
        other = see(prepared, finding_without(seen.finding, needless), simulator, seed)
        if not other.measured.refused and not worse(other.measured.gap, seen.measured.gap, seed):
            return other, refused, needless
    return seen, refused, ()


def worse(own: Gap, other: Gap, seed: int) -> bool:
    """Whether the corrected model of one gap misses the judging rows by more than that of another, 95 % surely."""
    missed, less = (np.sqrt(gap.errors[-1] * gap.unit) for gap in (own, other))
    share, p_value = taken(missed, less, own.errors[-1], own.unit, seed)
    return share > 0.0 and p_value < LOW


def see(prepared: Prepared, finding: Finding, simulator: Simulator | None, seed: int) -> Seen:
    """A finding on the rows kept for judging."""
    extra = direct_evidence(prepared, finding, CLAIMED if simulator is None else simulator.price)
    shown = present(finding, extra)
    common, _ = shared(shown, simulator)
    direct = direct_effects(prepared, finding, shown)
    given = None if simulator is None else as_model(prepared, simulator.vector, finding.law, simulator.effects, direct)
    return Seen(finding, extra, shown, measure(prepared, finding, given, common, direct, seed))


def suspicions_of(log: Log, prepared: Prepared) -> tuple[str, ...]:
    """What a log says against itself, its wheel speeds against its poses, and its poses against any robot."""
    held = [COASTED[prepared.told is not None]] if held_rates(prepared.windows) else []
    return (*log_suspicions(log), *suspected_wheels(log), *held)


def check_nominal(logs: Log | Sequence[Log], sim: Log | Sequence[Log] | None, model: Model | None) -> None:
    """InputError where there are two nominal models, or one in other units."""
    if sim is not None and model is not None:
        raise InputError("give the simulator's logs or a model, not both: each is the nominal model to judge")
    if sim is not None:
        check_units(sim, logs)
