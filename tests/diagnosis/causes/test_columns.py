"""The table of a search about fits of a small robot: what its columns and cross products say."""

import numpy as np
import pytest
from support.small_robot import LAW, VECTOR, nominal_fit, robot_with, windows_of

from jaxident.diagnosis.causes.columns import AMPLITUDE, FAR, _Column, _in_order, answers_of, tabulate
from jaxident.diagnosis.causes.evidence import log_evidence, posterior_mean, worth
from jaxident.diagnosis.causes.moves import fit_options, stands
from jaxident.diagnosis.causes.points import differences, points_of, seeded, sizes_of
from jaxident.diagnosis.fit.nominal import first_starts
from jaxident.diagnosis.fit.refit import Data, refit
from jaxident.diagnosis.motion.linear import follow, linearise
from jaxident.diagnosis.noise.law import Law, white_whitener
from jaxident.effects.coordinates import ACCELERATIONS, COORDINATES, NOMINAL, PLACES, SILENT, SMOOTH, sizes

SIZES = {("slope", "x"): 0.3, ("slope", "y"): -0.2, ("transport_delay", "delay"): 0.08}
FAINT = {("turn_loss", "loss"): 0.1, ("slope", "x"): 0.004}


@pytest.fixture(scope="module")
def plain():
    """Windows of a robot without effects: data, the fit and the table about it."""
    data, nominal = nominal_fit(windows_of(VECTOR))
    return data, nominal, tabulate(data, nominal, ())


@pytest.fixture(scope="module")
def explained():
    """A robot with slope and delay, fitted with both: data, fit and effects."""
    windows = windows_of(robot_with(SIZES))
    data, nominal = nominal_fit(windows)
    effects = ("slope", "transport_delay")
    return data, refit(data, nominal.vector, nominal.starts, effects), effects


def option_of(table, effect):
    return next(k for k, option in enumerate(table.options) if option.effect == effect)


def freed(data, linear, columns, more=None):
    """Whitened columns (numbers of all windows, n), of which least squares has taken all that start states, the nominal
    parameters and further columns can do; the slow way."""
    count, numbers = linear.residual.shape
    common = linear.slopes[..., : len(NOMINAL)] if more is None else np.concatenate(
        [linear.slopes[..., : len(NOMINAL)], more], axis=2)  # fmt: skip
    base = np.zeros((count * numbers, 5 * count + common.shape[2]))
    for k in range(count):
        own = slice(k * numbers, (k + 1) * numbers)
        base[own, 5 * k : 5 * k + 5] = data.whitener[k] @ linear.starts[k]
        base[own, 5 * count :] = data.whitener[k] @ common[k]
    base /= np.linalg.norm(base, axis=0)
    target = (data.whitener @ columns).reshape(count * numbers, -1)
    return target - base @ np.linalg.lstsq(base, target, rcond=None)[0]


def agrees(table, own, rest):
    """Whether sums over windows are those of columns, the residual last, that are freed of all else."""
    size = np.linalg.norm(rest[:, :-1], axis=0)
    products, cross = table.products.sum(axis=0)[np.ix_(own, own)], table.cross.sum(axis=0)[own]
    np.testing.assert_allclose(products / np.outer(size, size), rest[:, :-1].T @ rest[:, :-1] / np.outer(size, size),
                               atol=1e-4)  # fmt: skip
    np.testing.assert_allclose(cross / size, rest[:, :-1].T @ rest[:, -1] / size, atol=1e-3)


def test_every_effect_has_a_way_to_take_part_and_pays_for_each_point_of_its_grid(plain):
    data, nominal, table = plain
    assert {option.effect for option in table.options} == set(COORDINATES)
    for name in COORDINATES:
        own = [option for option in table.options if option.effect == name]
        slopes, points = ([o for o in own if (o.point is None) == sloped] for sloped in (True, False))
        assert len(slopes) == (name in SMOOTH)
        assert all(o.price == 0.0 and len(o.columns) == len(sizes_of(name)) for o in slopes)
        assert [o.point for o in points] == [point for point in points_of(name, data, nominal) if point]
        assert all(o.price == pytest.approx(np.log(len(points))) and len(o.columns) == 1 for o in points)
    places = [column for option in table.options for column in option.columns]
    assert places == list(range(table.cross.shape[1])), "every column belongs to one option"
    assert table.here == {}


def test_sums_over_windows_are_those_of_least_squares_with_starts_and_nominal_parameters_free(plain):
    data, nominal, table = plain
    names = ("turn_loss", "slope", "stiction")
    picked = [table.options[option_of(table, name)] for name in names]
    places = [*range(len(NOMINAL)), *(PLACES[name, c.name] for name in names[:2] for c in COORDINATES[name])]
    linear = linearise(nominal.vector, nominal.starts, data.windows, places)
    point = seeded(nominal.vector, "stiction", picked[2].point)
    jump = linear.residual - follow(point[None], nominal.starts[None], data.windows)[0]
    columns = np.concatenate([linear.slopes[..., 10:], jump[..., None], linear.residual[..., None]], axis=2)
    agrees(table, [column for option in picked for column in option.columns], freed(data, linear, columns))


@pytest.mark.parametrize("pair", FAINT)
def test_a_faint_effect_shows_with_its_size_in_the_table_about_the_nominal_fit(pair):
    """Within four of its standard deviations, which the table's own products say."""
    data, nominal = nominal_fit(windows_of(robot_with({pair: FAINT[pair]})))
    table = tabulate(data, nominal, ())
    option = option_of(table, pair[0])
    column = table.options[option].columns[0]
    deviation = np.linalg.inv(table.products.sum(axis=0)[np.ix_(*[table.options[option].columns] * 2)])[0, 0] ** 0.5
    assert deviation < 0.3 * FAINT[pair], "else it would not be told from none"
    assert posterior_mean(table, [option])[column] == pytest.approx(FAINT[pair], abs=4.0 * deviation)
    assert log_evidence(table, [option]) > 0.0


def test_an_effect_that_the_fit_has_shows_with_its_own_size(explained):
    """From the table alone: cross products are those of the robot without it."""
    data, fit, effects = explained
    table = tabulate(data, fit, effects)
    here = [table.here[name] for name in effects]
    assert table.effects(here) == effects
    found = posterior_mean(table, here)
    keys = [(name, c.name) for name in effects for c in COORDINATES[name]]
    columns = [column for k in here for column in table.options[k].columns]
    for pair, column in zip(keys, columns, strict=True):
        place = PLACES[pair]
        spread = fit.covariance[fit.places.index(place), fit.places.index(place)] ** 0.5
        assert found[column] == pytest.approx(fit.vector[place], abs=0.5 * spread), pair
        assert abs(fit.vector[place]) > 20.0 * spread
        assert table.scale[column] == sizes()[place]
    others = [option for option in table.options if option.effect in effects]
    assert len(others) == len(effects), "what the fit has takes part as it is, and in no other way"


def test_answers_that_are_known_make_the_same_table(explained):
    data, fit, effects = explained
    rest = np.random.default_rng(0).normal(size=(*fit.linear.residual.shape, 2))
    known = answers_of(data, fit, effects)
    for kind in ({}, {"free": True, "owners": effects[:1]}):
        fresh, again = (tabulate(data, fit, effects, rest, answers=one, **kind) for one in (None, known))
        assert fresh.options == again.options
        assert fresh.here == again.here
        for one, other in zip(fresh[2:], again[2:], strict=True):
            np.testing.assert_array_equal(one, other)


def test_an_effect_without_a_derivative_that_the_fit_has_is_there_once():
    windows = windows_of(robot_with({("input_saturation", "level"): 0.6}))
    data, nominal = nominal_fit(windows)
    first = tabulate(data, nominal, ())
    best = max((k for k, o in enumerate(first.options) if o.effect == "input_saturation"),
               key=lambda k: log_evidence(first, [k]))  # fmt: skip
    assert first.options[best].point == {"level": 0.6, "soft": 0.0}
    found = fit_options(data, first, stands(nominal, ()), [best])
    assert found.fit.vector[PLACES["input_saturation", "level"]] == pytest.approx(0.6, abs=1e-3)
    table = tabulate(data, found.fit, found.effects)
    option = table.here["input_saturation"]
    (column,) = table.options[option].columns
    assert posterior_mean(table, [option])[column] == pytest.approx(1.0, abs=0.05)
    assert table.scale[column] == AMPLITUDE
    assert table.positive[column]


def test_only_one_sided_coordinates_have_one_sign(plain):
    _, _, table = plain
    for name in SMOOTH:
        option = table.options[option_of(table, name)]
        coordinates = [c for c in COORDINATES[name] if (name, c.name) not in SILENT]
        assert table.positive[list(option.columns)].tolist() == [c.low == c.neutral for c in coordinates]


def test_points_have_both_signs_only_where_the_effect_has(plain):
    """A payload may be loaded or unloaded, and a lens bend either way; a limit multiplied with something is another."""
    _, _, table = plain
    for option in (option for option in table.options if option.point is not None):
        (column,), first = option.columns, COORDINATES[option.effect][0]
        both = option.effect in ("payload_change", "lens_distortion")
        assert bool(table.positive[column]) != both, option.effect
        scale = first.size / abs(option.point[first.name]) if both else AMPLITUDE
        assert table.scale[column] == pytest.approx(scale), option.effect


def unnamed(data):
    """A term in no catalogue, a wave of half a second along x in the world (windows, numbers, 1)."""
    windows = data.windows
    time = windows.session[windows.run] + np.cumsum(windows.step, axis=0)
    columns = np.zeros((*windows.pose.shape[:2], 3))
    columns[..., 0] = np.sin(2.0 * np.pi * time / 0.5)
    return columns.transpose(1, 0, 2).reshape(len(windows.run), -1, 1)


def wavy(data, fit, term, size):
    """The fit's residual with so much of the term in it."""
    linear = fit.linear._replace(residual=fit.linear.residual + size * term[..., 0])
    pose = np.array(data.windows.pose)
    pose[..., 0] += size * term[:, 0::3, 0].T
    return data._replace(windows=data.windows._replace(pose=pose)), fit._replace(linear=linear)


@pytest.fixture(scope="module")
def beside(explained):
    """A fit with a term in the poses that no effect explains: data, fit, effects, the term, and the table without."""
    data, fit, effects = explained
    term = unnamed(data)
    data, fit = wavy(data, fit, term, 2e-3)
    return data, fit, effects, term, tabulate(data, fit, effects)


def columns_of(table, effects):
    return [column for name in effects for column in table.options[table.here[name]].columns]


def moves(one, other):
    """By how many of its standard deviations each well-known column is moved between two tables, inf for others."""
    size = np.sqrt(np.diagonal(one.products.sum(axis=0)))
    known = size * one.scale > 30.0  # from poses far better than by the prior
    return np.where(known, np.abs(other.cross.sum(axis=0) - one.cross.sum(axis=0)) / size, np.inf)


def test_what_is_in_no_catalogue_never_competes_with_a_name(beside):
    """It is freed first of all that the catalogue can do: sums and products of names stay what they were. Were it free
    itself it would move the slope by 27 standard deviations."""
    data, fit, effects, term, alone = beside
    table = tabulate(data, fit, effects, term)
    np.testing.assert_allclose(table.products, alone.products, rtol=1e-6, atol=1e-6 * np.abs(alone.products).max())
    moved = moves(alone, table)
    assert np.isfinite(moved).sum() > 50
    assert np.max(moved[np.isfinite(moved)]) < 0.1
    assert np.max(moved[columns_of(table, effects)]) < 0.01


def test_what_windows_say_spreads_less_once_the_rest_is_taken_away(beside):
    data, fit, effects, term, alone = beside

    def spread(table):
        mean = posterior_mean(table, [table.here[name] for name in effects])
        columns = columns_of(table, effects)
        scores = table.cross - table.products[:, :, columns] @ [mean[column] for column in columns]
        return np.sum(scores[:, columns] ** 2, axis=0)

    along_x, along_y, delay = spread(tabulate(data, fit, effects, term)) / spread(alone)
    assert delay < 0.6
    assert along_y < 1.0
    assert along_x < 1.1, "the wave goes along x, and what a slope can do of it stays a slope's"


def test_a_rest_that_is_free_stands_in_for_names(beside):
    """Columns and cross products are then those of least squares with the term free as well."""
    data, fit, effects, term, alone = beside
    table = tabulate(data, fit, effects, term, free=True)
    places = [*range(len(NOMINAL)), *(PLACES[name, c.name] for name in effects for c in COORDINATES[name])]
    linear = linearise(fit.vector, fit.starts, data.windows, places)
    answers = linear.slopes[..., len(NOMINAL) :]
    target = linear.residual + answers @ fit.vector[places[len(NOMINAL) :]]
    columns = np.concatenate([answers, target[..., None]], axis=2)
    own = columns_of(table, effects)
    agrees(table, own, freed(data, linear, columns, term))
    agrees(alone, own, freed(data, linear, columns))
    assert moves(alone, table)[own[0]] > 10.0, "a slope along x"


def test_a_rest_that_does_nothing_changes_nothing(explained):
    data, fit, effects = explained
    one, other = (tabulate(data, fit, effects, rest) for rest in (None, np.zeros((*fit.linear.residual.shape, 2))))
    np.testing.assert_allclose(other.cross, one.cross, rtol=1e-9, atol=1e-9)


def test_louder_noise_says_less(plain):
    """Twice the noise: a quarter of the products."""
    data, nominal, table = plain
    law = LAW._replace(position=2.0 * LAW.position, heading=2.0 * LAW.heading)
    loud = tabulate(Data(data.windows, white_whitener(law, data.windows)), nominal, ())
    np.testing.assert_allclose(loud.products.sum(axis=0).diagonal(), 0.25 * table.products.sum(axis=0).diagonal(),
                               rtol=1e-6)  # fmt: skip


def test_a_point_at_which_the_robot_runs_away_answers_nothing(plain):
    """A mass offset of the wrong sign turns a fast robot ever faster. It was 1e10 m off, and left no table."""
    data, nominal, _ = plain
    away = seeded(nominal.vector, "mass_offset", {"along": 0.4, "heading": 40.0})
    away[PLACES["mass_offset", "heading"]] *= -np.sign(nominal.vector[2])
    away[2:6] *= 30.0
    near = seeded(nominal.vector, "turn_loss", {"loss": 0.2})
    answers = differences(data, nominal, [away, near])
    assert np.nanmax(np.abs(answers[..., 0])) > FAR
    columns = [_Column(AMPLITUDE, True, vector=vector) for vector in (away, near)]
    kept = _in_order(columns, nominal.linear.slopes, answers)
    assert not kept[..., 0].any()
    np.testing.assert_array_equal(kept[..., 1], answers[..., 1])


def test_a_free_column_that_answers_nothing_takes_nothing(plain):
    """A term that a window never sees left a table of NaN, on which a search finds nothing."""
    data, nominal, table = plain
    empty = np.zeros((*nominal.linear.residual.shape, 1))
    found = tabulate(data, nominal, (), empty, free=True)
    np.testing.assert_allclose(found.cross, table.cross, rtol=1e-6, atol=1e-6 * np.abs(table.cross).max())


def test_what_a_term_and_an_effect_can_both_do_counts_for_an_owner(beside):
    """A term that answers as the slope does, and a wave: free, it takes the slope's worth; beside an owner, nothing."""
    data, fit, effects, term, alone = beside
    own = linearise(fit.vector, fit.starts, data.windows, [PLACES["slope", "x"]]).slopes
    term = own + term * np.std(own) / np.std(term) / 20.0
    free, owned = (tabulate(data, fit, effects, term, free=True, owners=names) for names in ((), ("slope",)))
    column = columns_of(alone, ("slope",))[0]
    left = [np.diagonal(table.products.sum(axis=0))[column] for table in (free, owned, alone)]
    assert left[0] < 0.1 * left[2]
    assert left[1] == pytest.approx(left[2], rel=0.05)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_table_tells_what_a_loss_in_turns_brings_where_a_lag_hides_the_rate(seed):
    """A Create's loss in turns was dropped so. A table that was linear in the loss itself gave that of such a robot 0.1
    to 3.8 on five seeds, where -log p rises by 290 to 450 without."""
    loss, law, effects = PLACES["turn_loss", "loss"], Law(2e-3, 2e-2), ("turn_loss", "motor_lag")
    vector = robot_with({("turn_loss", "loss"): 2.0, ("motor_lag", "time_constant"): 0.15})
    vector[0] = np.log(30.0)
    windows = windows_of(vector, seed, law=law)
    data = Data(windows, white_whitener(law, windows))
    fit = refit(data, vector, first_starts(windows), effects)
    table = tabulate(data, fit, effects)
    own = worth(table, [table.here[name] for name in effects], table.here["turn_loss"])
    without = fit_options(data, table, stands(fit, effects), [table.here["motor_lag"]])
    risen = without.fit.cost - fit.cost
    assert risen > 200.0
    assert risen / 3.0 < own.gain < 3.0 * risen
    both = [fit.places.index(place) for place in (0, loss)]
    (rate, cross), (_, size) = fit.covariance[np.ix_(both, both)]
    assert abs(cross) < 0.5 * np.sqrt(rate * size), "the loss at the typical rate is known without the rate"


def test_accelerations_stand_for_a_robot_of_the_typical_rate():
    """Robots that settle at 100 and at 200 1/s go the same way where the coordinate of an acceleration is the same."""
    assert len(ACCELERATIONS) > 4
    slow, fast = VECTOR.copy(), VECTOR.copy()
    for vector, rate in ((slow, 100.0), (fast, 200.0)):
        vector[:2], vector[2:6] = np.log(rate), 0.3 * VECTOR[2:6]
    for name, key, _ in ACCELERATIONS:
        size = {key: 0.3 * sizes()[PLACES[name, key]]}
        (plain, moved), (faster, alike) = ([way(one), way(seeded(one, name, size))] for one in (slow, fast))
        effect = np.abs(moved - plain).max()
        assert effect > 1e-5, name
        assert np.abs((alike - faster) - (moved - plain)).max() < 0.1 * effect, name


def way(vector):
    """Poses of some runs, the heading as it goes on."""
    poses = windows_of(vector, law=Law(1e-12, 1e-12)).pose.reshape(-1, 3)
    return np.column_stack([poses[:, :2], np.unwrap(poses[:, 2])])
