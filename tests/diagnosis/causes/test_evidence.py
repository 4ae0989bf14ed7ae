"""The log evidence of sets of effects against dense linear algebra, and the set that is best, on tables made up."""

import itertools

import numpy as np
import pytest
from scipy import stats
from support.tables import table_of

from jaxident.diagnosis.causes.columns import Option
from jaxident.diagnosis.causes.evidence import CHANCE, WRONG, log_evidence, posterior_mean, worth
from jaxident.diagnosis.causes.search import MOST_EFFECTS, best_set, joining

WINDOWS, NUMBERS, COUNT = 80, 15, 30
NAMES = [f"effect {k}" for k in range(COUNT)]
ODDS = np.log(0.03 / 0.97)


def columns_of(rng, count=COUNT, windows=WINDOWS, alike=0.0):
    """Columns of unit length over all windows; odd ones resemble the even ones before them with a correlation."""
    columns = rng.normal(size=(windows, NUMBERS, count)) / np.sqrt(windows * NUMBERS)
    columns[..., 1::2] = alike * columns[..., : count - 1 : 2] + np.sqrt(1.0 - alike**2) * columns[..., 1::2]
    return columns


def noise(rng, windows=WINDOWS):
    return rng.normal(size=(windows, NUMBERS))


def dense(columns, residual, scale):
    """log N(r; 0, 1 + C diag(scale^2) C') - log N(r; 0, 1), all windows in one vector."""
    flat, r = columns.reshape(-1, columns.shape[2]), residual.ravel()
    total = np.eye(len(r)) + (flat * scale**2) @ flat.T
    return -0.5 * np.linalg.slogdet(total)[1] - 0.5 * r @ np.linalg.solve(total, r) + 0.5 * r @ r


def ridge(columns, residual, scale):
    """The least half of squares and of the prior's squares."""
    flat = np.concatenate([columns.reshape(-1, columns.shape[2]), np.diag(1.0 / scale)])
    target = np.concatenate([residual.ravel(), np.zeros(columns.shape[2])])
    rest = target - flat @ np.linalg.lstsq(flat, target, rcond=None)[0]
    return 0.5 * float(rest @ rest)


def widened(columns, residual, scale):
    """Scales (n,) no smaller than what the columns are multiplied with under them."""
    flat = columns.reshape(-1, columns.shape[2])
    mean = np.linalg.solve(flat.T @ flat + np.diag(scale**-2.0), flat.T @ residual.ravel())
    return np.maximum(scale, np.abs(mean))


@pytest.fixture(scope="module")
def made():
    """Columns in three options, of two, one and three columns; priors of many sizes; a residual with some of them."""
    rng = np.random.default_rng(0)
    columns, scale = columns_of(rng, 6, 12, alike=0.7), rng.uniform(0.3, 20.0, 6)
    residual = noise(rng, 12) + columns @ rng.normal(size=6) * 8.0
    options = [
        Option("slope", (0, 1), None, 0.0),
        Option("turn_loss", (2,), None, 0.0),
        Option("backlash", (3, 4, 5), {"right": 0.02}, np.log(2.0)),
    ]
    return table_of(columns, residual, "abcdef", scale)._replace(options=options), columns, residual, scale


@pytest.mark.parametrize("chosen", [s for n in range(1, 4) for s in itertools.permutations(range(3), n)])
def test_log_evidence_is_that_of_a_dense_normal_distribution(made, chosen):
    table, columns, residual, scale = made
    own = [column for k in chosen for column in table.options[k].columns]
    prior = sum(ODDS - table.options[k].price for k in chosen)
    wide = widened(columns[..., own], residual, scale[own])
    wanted = dense(columns[..., own], residual, wide) + prior
    assert log_evidence(table, chosen) == pytest.approx(wanted, abs=1e-6)


def test_no_effect_is_what_others_are_held_against(made):
    assert log_evidence(made[0], []) == 0.0
    assert pytest.approx(ODDS) == CHANCE


def test_a_robot_of_another_scale_is_no_surprise():
    """An effect of twenty of its deviations costs a few units of log evidence, as a large one does in any scale: under
    the normal prior alone it would cost 200."""
    rng = np.random.default_rng(14)
    columns = columns_of(rng, 1)
    residual = noise(rng) + columns @ [60.0]
    narrow, wide = (log_evidence(table_of(columns, residual, "a", scale), [0]) for scale in (3.0, 60.0))
    assert narrow == pytest.approx(wide, abs=0.3)
    assert wide - dense(columns, residual, np.array([3.0])) > 150.0


def test_a_column_of_one_sign_has_half_the_room():
    """Where the sign is beyond doubt the prior has all of its mass there: twice the evidence."""
    rng = np.random.default_rng(1)
    columns, scale = columns_of(rng, 2), np.array([3.0, 3.0])
    residual = noise(rng) + columns @ [9.0, 9.0]
    both, one = (table_of(columns, residual, "ab", scale, sign) for sign in (False, [True, False]))
    assert log_evidence(one, [0, 1]) - log_evidence(both, [0, 1]) == pytest.approx(np.log(2.0))


def test_a_column_of_the_wrong_sign_stays_out():
    rng = np.random.default_rng(2)
    columns = columns_of(rng, 2)
    table = table_of(columns, noise(rng) + columns @ [-9.0, 9.0], "ab", 5.0, [True, False])
    assert log_evidence(table, [0]) == WRONG
    assert posterior_mean(table, [0]) == {}
    assert worth(table, [0, 1], 0).evidence == WRONG
    assert list(posterior_mean(table, [0, 1])) == [1]
    assert log_evidence(table, [0, 1]) == pytest.approx(log_evidence(table, [1]) + ODDS)
    assert best_set(table, [0]) == best_set(table, []) == [1]


def test_what_columns_are_multiplied_with_is_the_ridge_solution(made):
    table, columns, residual, scale = made
    flat, wide = columns.reshape(-1, 6), widened(columns, residual, scale)
    assert np.any(wide > scale)
    wanted = np.linalg.solve(flat.T @ flat + np.diag(wide**-2.0), flat.T @ residual.ravel())
    found = posterior_mean(table, [1, 2, 0])
    np.testing.assert_allclose([found[k] for k in range(6)], wanted, rtol=1e-8)


@pytest.mark.parametrize("option", range(3))
def test_the_gain_of_an_effect_is_the_fall_that_it_brings_beside_the_others(made, option):
    table, columns, residual, scale = made
    rest = [column for k in range(3) if k != option for column in table.options[k].columns]
    wide = widened(columns, residual, scale)
    wanted = ridge(columns[..., rest], residual, wide[rest]) - ridge(columns, residual, wide)
    assert worth(table, [0, 1, 2], option).gain == pytest.approx(wanted, rel=1e-6)


def test_where_windows_agree_an_effect_is_worth_its_evidence():
    """The spread of 400 scores is known to 7 % (one standard deviation), two columns and ten nominal parameters make
    it 3 % larger: within 30 % of what is gained, and never more than the plain difference, but for the prior's width,
    which is chosen anew without the effect."""
    rng = np.random.default_rng(3)
    columns = columns_of(rng, 2, 400, alike=0.6)
    table = table_of(columns, noise(rng, 400) + columns @ [15.0, 12.0], "ab", 20.0)
    for option, other in ((0, 1), (1, 0)):
        plain = log_evidence(table, [0, 1]) - log_evidence(table, [other])
        own = worth(table, [0, 1], option)
        assert own.gain > 30.0
        assert plain - 0.3 * own.gain < own.evidence < plain + 0.1


def test_an_effect_that_one_window_alone_pays_for_is_worth_nothing():
    rng = np.random.default_rng(4)
    columns = columns_of(rng, 2)
    residual = noise(rng)
    residual[7] += 1500.0 * columns[7, :, 0]
    table = table_of(columns, residual, "ab", 20.0)
    own = worth(table, [0], 0)
    assert log_evidence(table, [0]) > 30.0
    assert own.gain > 30.0
    assert own.evidence < 0.0
    assert best_set(table, []) == best_set(table, [0]) == []


def hidden(rng, places, size=9.0, alike=0.8):
    """A table of thirty columns, pairs of them alike, of which some make up the residual beside noise."""
    columns = columns_of(rng, alike=alike)
    return table_of(columns, noise(rng) + size * columns[..., places].sum(axis=2), NAMES, 10.0)


@pytest.mark.parametrize("seed", range(5))
def test_four_hidden_among_thirty_are_found_wherever_the_search_begins(seed):
    rng = np.random.default_rng(seed)
    places = (2 * rng.choice(COUNT // 2, 4, replace=False) + rng.integers(0, 2, 4)).tolist()
    table = hidden(rng, places)
    alike = [place + 1 - 2 * (place % 2) for place in places]
    idle = [k for k in range(COUNT) if k not in (*places, *alike)]
    for begin in ([], places[:2], alike, [*places, *idle[:2]], idle[:MOST_EFFECTS]):
        assert sorted(best_set(table, begin)) == sorted(places), begin


def test_a_look_alike_is_exchanged_in_one_move():
    """With as many effects as a set may have nothing can join before something leaves."""
    places = [0, 4, 8, 12, 16, 20]
    table = hidden(np.random.default_rng(6), places, size=15.0)
    assert len(places) == MOST_EFFECTS
    assert sorted(best_set(table, [1, *places[1:]])) == places


def test_effects_that_the_catalogue_is_to_lack_never_join():
    table = hidden(np.random.default_rng(7), [0, 4], size=15.0)
    assert set(best_set(table, [])) == {0, 4}
    found = best_set(table, [], (NAMES[0],))
    assert set(found) == {1, 4}, "its look-alike stands in"
    assert 0 not in joining(table, [4], (NAMES[0],))


def test_a_set_has_no_more_than_it_may():
    places = list(range(0, 20, 2))
    found = best_set(hidden(np.random.default_rng(8), places), [])
    assert len(found) == MOST_EFFECTS
    assert set(found) <= set(places)


def test_an_effect_takes_part_in_one_way():
    """Two points of one grid make up the residual together: one of them is taken."""
    table = hidden(np.random.default_rng(9), [0, 2, 10], alike=0.0)
    options = [option._replace(effect=NAMES[k - k % 4]) for k, option in enumerate(table.options)]
    found = best_set(table._replace(options=options), [])
    assert len(found) == 2
    assert 10 in found
    assert len({0, 2} & set(found)) == 1
    assert not {0, 1, 2, 3} & set(joining(table._replace(options=options), found))


@pytest.mark.parametrize("positive", [False, True])
def test_of_noise_hardly_a_table_has_an_effect(positive):
    """Alone an effect is chosen if z^2 g / (g + 1) > log(1 + g) - 2 log odds, its information g, z normal; if it can
    have one sign alone, log 4 less and on that side. Of thirty at most thirty times as often: 200 tables, three
    standard errors."""
    information = 9.0
    room = np.log(1.0 + information) - 2.0 * ODDS - (np.log(4.0) if positive else 0.0)
    sides = 1.0 if positive else 2.0
    most = COUNT * sides * stats.norm.sf(np.sqrt(room * (information + 1.0) / information))
    assert most < 0.05
    named = []
    for seed in range(200):
        rng = np.random.default_rng(1000 + seed)
        table = table_of(columns_of(rng), noise(rng), NAMES, np.sqrt(information), positive)
        named.append(bool(best_set(table, [])))
    assert np.mean(named) <= most + 3.0 * np.sqrt(most / len(named))


def test_evidence_above_the_odds_is_what_the_prior_says():
    """Effects drawn from the very prior, every one with the odds 1 to 1 in place of CHANCE: those whose log evidence is
    e are there in exp(e) / (1 + exp(e)) of all cases. 4,000 cases, five bins, four standard errors."""
    rng = np.random.default_rng(11)
    columns = columns_of(rng, 1, 40)
    there = rng.integers(0, 2, 4000)
    found = []
    for each in there:
        size = each * 4.0 * rng.normal()
        table = table_of(columns, noise(rng, 40) + size * columns[..., 0], "a", 4.0)
        found.append(log_evidence(table, [0]) - ODDS)
    chance = 1.0 / (1.0 + np.exp(-np.array(found)))
    edges = np.quantile(chance, np.linspace(0.0, 1.0, 6))
    for low, high in itertools.pairwise(edges):
        own = (chance >= low) & (chance <= high)
        bound = 4.0 * np.sqrt(np.mean(chance[own] * (1.0 - chance[own])) / own.sum())
        assert np.mean(there[own]) == pytest.approx(np.mean(chance[own]), abs=max(bound, 0.01))
