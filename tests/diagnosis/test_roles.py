"""What each part of a log is for, and that what judges has no say in any fit."""

import jax
import numpy as np
import pytest

from jaxident.diagnosis.account.models import LOST
from jaxident.diagnosis.causes.chance_effects import direct_effects, direct_evidence, present
from jaxident.diagnosis.causes.finding import find_effects
from jaxident.diagnosis.motion.paths import track
from jaxident.diagnosis.motion.windows import cut
from jaxident.diagnosis.preparation.prepare import BURN, FEWEST, judging_starts, prepare, shows_start
from jaxident.diagnosis.preparation.roles import (
    LONGEST,
    MOST_FITTED,
    MOST_JUDGED,
    PARTS,
    leverages,
    split,
    which_judge,
)
from jaxident.effects.coordinates import PLACES, neutral_vector, nominal_vector
from jaxident.effects.simulate import simulate
from jaxident.errors import InputError
from jaxident.log import Log, join, make_log, run_begins
from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model
from jaxident.robot.noise import Noise
from jaxident.study.synthetic import excite

STEP, ROWS = 0.03, 50
ROBOT = Model(STEP, Physical(np.array([3.0, 5.0]), np.array([[0.5, 0.45], [9.0, -8.5]])), np.array([0.1, 0.12]),
              noise=Noise(3e-4, 2e-3))  # fmt: skip


def blank(rows: int, runs: int) -> Log:
    t = STEP * np.arange(rows)
    return join([make_log(t, np.sin(t), np.cos(t), 0.0 * t, 0.0 * t, 0.0 * t) for _ in range(runs)])


def rows_of(log, pieces):
    begins = run_begins(log)
    return [row for p in pieces for row in range(begins[p.run] + p.first, begins[p.run] + p.last)]


@pytest.mark.parametrize(("rows", "runs"), [(600, 1), (600, 2), (600, 7), (22000, 1), (2500, 4)])
def test_every_row_has_one_role_and_a_third_judges(rows, runs):
    log = blank(rows, runs)
    roles = split(log, ROWS)
    fit, judge = (rows_of(log, pieces) for pieces in roles)
    assert sorted(fit + judge) == list(range(rows * runs))
    assert 0.2 < len(judge) / (rows * runs) < 0.45
    assert max(p.last - p.first for p in roles.fit) <= max(LONGEST, 2 * ROWS)
    assert len(roles.judge) <= max(PARTS, runs)
    if runs >= 3:
        assert {p.run for p in roles.judge} == {run for run in (1, 4, 6) if run < runs}


@pytest.mark.parametrize("period", range(1, 13))
def test_runs_of_every_phase_of_a_period_fit_and_judge_alike(period):
    """Of 60 runs of each phase 16 to 24 judge; if every third run judged, all of a phase or none would, at period 3."""
    judges = np.array(which_judge(60 * period))
    for phase in range(period):
        assert np.sum(judges[phase::period]) == pytest.approx(20, abs=4)


def test_from_three_runs_on_each_purpose_has_some_and_judging_runs_lie_apart():
    for count in range(3, 100):
        judges = np.flatnonzero(which_judge(count))
        assert 0.2 < len(judges) / count < 0.45
        assert set(np.diff(judges)) <= {2, 3, 5}


def driven(rows, runs, share, seed=0):
    """Logs of a robot that is driven over a share of the time, in spells of 1500 rows, and stands else; where it is."""
    log, rng = blank(rows, runs), np.random.default_rng(seed)
    count = rows * runs
    moving = np.repeat(rng.random(count // 1500 + 1) < share, 1500)[:count]
    commands = np.repeat(rng.uniform(-1.0, 1.0, (count // 10 + 1, 2)), 10, axis=0)[:count]
    u = np.where(moving[:, None], commands, 0.0)
    return log._replace(u_r=u[:, 0], u_l=u[:, 1]), moving


@pytest.mark.parametrize(("rows", "runs"), [(300_000, 1), (3_000, 100)])
def test_of_a_long_log_parts_that_tell_most_have_a_role(rows, runs):
    """The robot is driven a fifth of the time: nearly all rows that are used are from there, early and late ones."""
    log, moving = driven(rows, runs, 0.2)
    fit, judge = (rows_of(log, pieces) for pieces in split(log, ROWS))
    assert not set(fit) & set(judge)
    assert 0.6 * MOST_FITTED < len(fit) <= MOST_FITTED
    assert 0.5 * MOST_JUDGED < len(judge) <= MOST_JUDGED
    for part in (fit, judge):
        assert np.mean(moving[part]) > 0.8
        early, late = np.quantile(part, [0.1, 0.9]) / len(moving)
        assert early < 0.35
        assert late > 0.75


def test_of_many_short_runs_as_many_rows_have_a_role_as_of_long_ones():
    """603 runs of 40 rows, as a Husky's log has: pieces are shorter than SHORT, so that more of them are needed."""
    rng, (log, _) = np.random.default_rng(0), driven(40, 603, 1.0)
    factor = np.repeat(rng.uniform(0.2, 1.0, 603), 40)  # every run has one command, small or large
    log = log._replace(u_r=factor, u_l=-0.7 * factor)
    roles = split(log, 40)
    fit, judge = (rows_of(log, pieces) for pieces in roles)
    assert 0.8 * MOST_FITTED < len(fit) <= MOST_FITTED
    assert 0.8 * MOST_JUDGED < len(judge) <= MOST_JUDGED


def test_where_all_rows_tell_alike_parts_lie_evenly():
    log, _ = driven(90_000, 1, 1.0)
    fit = split(log, ROWS).fit
    apart = np.diff([piece.first for piece in fit])
    assert 0.9 * MOST_FITTED < sum(piece.last - piece.first for piece in fit) <= MOST_FITTED
    assert max(apart) < 3 * 90_000 / len(fit)


def test_leverages_are_those_of_a_least_squares_fit():
    """The diagonal of the matrix that takes measurements to fitted values; 0 where the camera was blind."""
    log, _ = driven(3000, 2, 0.5)
    blind = np.arange(6000) % 7 == 0
    told = leverages(log._replace(x=np.where(blind, np.nan, log.x)))
    command = np.stack([log.u_r, log.u_l], axis=1)
    change = np.diff(command, axis=0, prepend=command[:1])
    change[3000] = 0.0
    basis, _ = np.linalg.qr(np.concatenate([command, change], axis=1)[~blind])
    assert np.all(told[blind] == 0.0)
    np.testing.assert_allclose(told[~blind], np.sum(basis**2, axis=1), atol=1e-12)


@pytest.mark.slow
def test_a_piece_of_a_long_run_drives_as_the_whole_does():
    """A delay, a lag, play and a slew limit remember what was commanded before the piece."""
    rng = np.random.default_rng(1)
    log = blank(2400, 3)
    u = np.repeat(rng.uniform(-1.0, 1.0, (2400 * 3 // 12, 2)), 12, axis=0)
    log = log._replace(u_r=u[:, 0], u_l=u[:, 1])
    vector = neutral_vector(nominal_vector(ROBOT.dynamics, ROBOT.dead_zone))
    sizes = {("transport_delay", "delay"): 0.11, ("motor_lag", "time_constant"): 0.15, ("backlash", "right"): 0.05,
             ("backlash", "left"): 0.04, ("input_rate_limit", "inverse_rate"): 0.1}  # fmt: skip
    for pair, size in sizes.items():
        vector[PLACES[pair]] = size
    whole, pieces = cut(log, ROWS), cut(log, ROWS, pieces=split(log, ROWS).fit)
    assert len(pieces.command) < 1.2 * LONGEST < 0.6 * len(whole.command)
    paths = [np.stack(jax.jit(track)(vector, np.zeros((5, len(w.run))), w)) for w in (whole, pieces)]
    order = [int(np.flatnonzero(whole.row == row)[0]) for row in pieces.row]
    np.testing.assert_allclose(paths[1], paths[0][:, :, order], atol=2e-6)
    np.testing.assert_allclose(pieces.session[pieces.run] + pieces.t[pieces.first, pieces.run],
                               (whole.session[whole.run] + whole.t[whole.first, whole.run])[order])  # fmt: skip


@pytest.fixture(scope="module")
def logs():
    """Three runs of a robot with a delay, lost commands and outliers; of the size of those in `test_end_to_end`, for
    both then need the same programs."""
    period = 1.0 / 30.0
    effects = (Effect("transport_delay", {"delay": 0.08}), Effect(LOST, {"probability": 0.15}),
               Effect("outliers", {"probability": 0.02, "position": 0.02, "heading": 0.2}))  # fmt: skip
    robot = Model(period, ROBOT.dynamics, ROBOT.dead_zone, ROBOT.noise, effects)
    plain = [excite(jax.random.key(k), "multilevel", 400, period, hold=10) for k in range(3)]
    runs = [simulate(robot, log, key=jax.random.key(10 + k)) for k, log in enumerate(plain)]
    return [Log(*map(np.asarray, run)) for run in runs]


def found(logs):
    prepared, finding = find_effects(prepare(logs, None))
    direct = direct_effects(prepared, finding, present(finding, direct_evidence(prepared, finding)))
    return prepared, finding, direct


def nonsense(logs):
    """The logs with other poses in the run that judges."""
    rng, other = np.random.default_rng(0), list(logs)
    shape = len(logs[1].t)
    other[1] = logs[1]._replace(x=rng.normal(size=shape), y=rng.normal(size=shape), theta=rng.uniform(-3, 3, shape))
    return other


def test_poses_that_judge_reach_nothing_that_fits(logs):
    one, two = prepare(logs, None), prepare(nonsense(logs), None)
    assert set(one.judging.run) == {1}
    for name in ("windows", "naming", "fitted", "nominal", "frames", "lost"):
        for a, b in zip(jax.tree.leaves(getattr(one, name)), jax.tree.leaves(getattr(two, name)), strict=True):
            np.testing.assert_array_equal(a, b, err_msg=name)


@pytest.mark.slow
def test_judging_runs_only_report(logs):
    """Other poses in the run that judges, noise and nonsense, change no fit, no name, no size and no law."""
    one, two = found(logs), found(nonsense(logs))
    assert one[1].selected == two[1].selected
    assert one[1].law == two[1].law
    assert one[2] == two[2]
    assert one[1].values == two[1].values
    np.testing.assert_array_equal(one[1].fit.vector, two[1].fit.vector)
    np.testing.assert_array_equal(one[1].table.cross, two[1].table.cross)
    np.testing.assert_array_equal(one[0].log.u_r, join(logs).u_r)  # judged under the commands that were sent


@pytest.mark.slow
def test_sizes_of_outliers_come_out_in_the_model(logs):
    """About 15 of them: a root mean square of so few has a standard error of 13 % in position, of 18 % in heading."""
    _, _, direct = found(logs)
    assert direct["outliers"]["position"] == pytest.approx(0.02, rel=0.5)
    assert direct["outliers"]["heading"] == pytest.approx(0.2, rel=0.5)


def test_windows_that_do_not_show_their_start_take_no_part():
    """Of every fourth window all but just enough of its first poses are missing, of every fifth one more."""
    log = blank(24 * ROWS, 1)
    x = np.array(log.x).reshape(24, ROWS)
    x[::4, : BURN - FEWEST] = np.nan
    x[::5, : BURN + 1 - FEWEST] = np.nan
    windows = cut(log._replace(x=x.ravel()), ROWS)
    assert np.sum(shows_start(windows)) == np.sum(np.arange(24) % 5 > 0)


def test_starts_that_nothing_shows_do_not_judge():
    log = blank(200, 1)
    x = np.array(log.x)
    x[101 - BURN : 101 - FEWEST + 1] = np.nan  # one pose short before row 100
    x[150] = np.nan
    starts = judging_starts(log._replace(x=x), split(log, 400).fit, 20)
    rows = starts.row.tolist()
    assert 100 not in rows
    assert 130 not in rows  # its horizon is row 150
    assert {20, 40, 60, 120, 140} <= set(rows)


def test_a_log_without_anything_to_judge_by_is_refused(logs):
    other = [logs[0], logs[1]._replace(x=np.full(len(logs[1].t), np.nan)), *logs[2:]]
    with pytest.raises(InputError, match="none to judge by"):
        prepare(other, None)
