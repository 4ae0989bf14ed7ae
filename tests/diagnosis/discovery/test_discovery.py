"""The search for curves: the algebra on made Gram matrices, and whole searches on simulated robots."""

import dataclasses

import jax
import numpy as np
import pytest

import jaxident as ji
from jaxident.diagnosis.causes.finding import find_effects
from jaxident.diagnosis.discovery.curves import bend, precision, solved
from jaxident.diagnosis.discovery.fit import Curve, as_law, prior_of
from jaxident.diagnosis.discovery.forms import beyond, form_of
from jaxident.diagnosis.discovery.search import discover
from jaxident.diagnosis.laws.candidates import SURFACE_KNOTS, Path, Turning, columns_of, hats
from jaxident.diagnosis.laws.kinds import KINDS, Kind, nominal_part
from jaxident.diagnosis.motion.responses import Responses
from jaxident.diagnosis.preparation.prepare import prepare
from jaxident.effects.coordinates import PLACES
from jaxident.log import join, make_log
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Model
from jaxident.robot.noise import Noise

KNOTS = 10
AT = np.linspace(-1.0, 1.0, KNOTS)
FLOOR = np.linspace(-0.7, 0.7, SURFACE_KNOTS)
S, T = np.meshgrid(FLOOR, FLOOR, indexing="ij")


def test_hats_add_up_to_one_and_draw_the_curve():
    s, value = np.linspace(-2.0, 2.0, 81), np.random.default_rng(0).normal(size=KNOTS)
    weights = hats(s, AT)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    np.testing.assert_allclose(weights @ value, np.interp(s, AT, value), atol=1e-12)


def windows_of(curve, rng, windows=40, rows=30):
    """Products by window of one nominal column, the hats of a signal, and white noise plus a curve of it."""
    s, nominal = rng.uniform(-1.0, 1.0, (windows, rows)), rng.normal(size=(windows, rows, 1))
    y = 2.0 * nominal + curve(s)[..., None] + rng.normal(size=(windows, rows, 1))
    whole = np.concatenate([nominal, hats(s, AT), y], axis=2)
    return whole.transpose(0, 2, 1) @ whole


def test_a_curve_in_the_data_is_found_and_its_values_are_near():
    by_window = windows_of(lambda s: 0.5 * np.sin(3.0 * s), np.random.default_rng(1))
    found = bend(by_window, np.zeros(by_window.shape[1:]), precision((AT,), np.zeros((KNOTS, 0))))
    assert found.evidence > 20.0
    assert found.held_out > 20.0
    values = solved(by_window.sum(axis=0), 1 + KNOTS)
    assert abs(values[0] - 2.0) < 0.1
    assert np.abs(values[1:] - 0.5 * np.sin(3.0 * AT)).max() < 0.4


def test_noise_alone_brings_no_curve():
    """Of 200 signals without any part in the data one in fifty may seem to be worth 2, none the 9 that are asked."""
    found = [
        bend(by_window, np.zeros(by_window.shape[1:]), precision((AT,), np.zeros((KNOTS, 0))))
        for by_window in (windows_of(np.zeros_like, np.random.default_rng(k), 12) for k in range(200))
    ]
    worth = np.array([min(one.evidence, one.held_out) for one in found])
    assert np.mean(worth > 2.0) <= 0.02
    assert worth.max() < 9.0


def curve_of(kind: Kind, value) -> Curve:
    turning = Turning(0.2, 0.1, np.zeros(1), 9.0, 1.0) if kind.signal == "own angle" else None
    return Curve(kind, (AT,), value, np.full(KNOTS, 0.01), 1.0, np.ones(KNOTS), turning=turning)


def surface_of(kind: Kind, value) -> Curve:
    """A surface on an even floor."""
    value = np.ravel(value)
    return Curve(kind, (FLOOR, FLOOR), value, np.full(value.size, 0.01), 1.0, np.ones(value.size))


@pytest.mark.parametrize(
    ("kind", "value", "form"),
    [
        (Kind("acceleration along", "v", "w"), 0.3 - 0.7 * np.abs(AT), "c |s|"),  # the rate takes the constant
        (Kind("acceleration along", "1", "v"), 0.5 * AT - 2.0 * AT * np.abs(AT), "c s |s|"),
        (Kind("speed sideways", "v", "w"), 0.1 * AT, "c s"),
        (Kind("acceleration in heading", "1", "time"), 0.4 * (AT > 0.1), "c from s0 on"),
        (Kind("pose ahead", "1", "heading"), 0.02 * np.sin(AT), "c s"),  # as good over so few radians
    ],
)
def test_simple_forms_are_recognised(kind, value, form):
    curve = curve_of(kind, value)
    found = form_of(as_law(curve), curve.density)
    assert found is not None
    assert found.form == form
    assert found.part_explained > 0.95


@pytest.mark.parametrize("instant", [-0.35, 0.25, 0.4])
def test_a_step_is_placed_between_the_knots_where_it_is(instant):
    """A curve has the mean of the step over each knot's hat."""
    fine = np.linspace(-1.3, 1.3, 4001)
    weight = hats(fine, AT)
    value = (weight * (fine >= instant)[:, None]).sum(axis=0) / weight.sum(axis=0)
    law = as_law(curve_of(Kind("acceleration along", "v", "time"), value))
    found = form_of(law, np.full(len(AT), 9))
    assert found is not None
    assert found.form == "c from s0 on"
    assert abs(found.parameters["s0"] - instant) < 0.5 * (AT[1] - AT[0])


def test_what_the_nominal_robot_has_as_well_is_taken_away():
    law = as_law(curve_of(Kind("push of each wheel", "1", "own push"), 0.4 * AT - 0.3 * AT**3))
    left = beyond(law, np.ones(KNOTS))
    assert abs(np.sum(left * AT)) < 1e-9
    np.testing.assert_allclose(np.diff(left, 2), np.diff(-0.3 * AT**3, 2), atol=1e-12)
    camera = as_law(curve_of(Kind("pose ahead", "1", "x"), 0.02 * AT))
    np.testing.assert_array_equal(beyond(camera, np.ones(KNOTS)), 0.02 * AT)


@pytest.mark.parametrize(
    ("kind", "value", "form"),
    [
        (Kind("acceleration along", "v", "x", "y"), -2.0 * (np.hypot(S - 0.1, T + 0.1) < 0.35), "c within a circle"),
        (Kind("acceleration along", "sin heading", "x", "y"), -0.5 * T, "c t"),
        (Kind("acceleration in heading", "1", "v", "w"), 0.4 * S - T - 3.0 * S * T, "c s t"),  # straight ones are rates
        (Kind("acceleration along", "1", "v", "w"), -3.0 * S * np.abs(T), "c s |t|"),
    ],
)
def test_simple_forms_of_surfaces_are_recognised(kind, value, form):
    surface = surface_of(kind, value)
    found = form_of(as_law(surface), surface.density)
    assert found is not None
    assert found.form == form
    assert found.part_explained > (0.8 if "circle" in form else 0.999)
    if "circle" in form:
        assert np.hypot(found.parameters["x0"] - 0.1, found.parameters["y0"] + 0.1) < 0.15
        assert abs(found.parameters["radius"] - 0.35) < 0.15


def test_a_surface_answers_as_its_knots_say():
    """Columns of a surface times its values are the answer to the surface itself, between the knots and beyond."""
    rng = np.random.default_rng(4)
    x, y, v = rng.uniform(-1.0, 1.0, (3, 2, 30))
    answer = rng.normal(size=(2, 90, 30))
    path = Path({"x": x, "y": y, "v": v}, {}, np.eye(2), np.ones(2), np.ones((2, 90)), x, y, x)
    columns = columns_of(Kind("acceleration along", "v", "x", "y"), (FLOOR, FLOOR), path, Responses(answer, None, None))
    value = rng.normal(size=(SURFACE_KNOTS, SURFACE_KNOTS))
    rows = np.array([np.interp(np.ravel(y), FLOOR, row) for row in value])
    there = [np.interp(s, FLOOR, column) for s, column in zip(np.ravel(x), rows.T, strict=True)]
    np.testing.assert_allclose(
        columns @ np.ravel(value), np.einsum("wnr,wr->wn", answer, v * np.reshape(there, x.shape))
    )


def test_a_surface_that_is_flat_costs_next_to_nothing():
    """A prior on first differences along both signals: what is not known of a place is what its neighbours are."""
    whole = precision((FLOOR, FLOOR), np.zeros((S.size, 0)))
    flat, tilted = np.ones(S.size), np.ravel(S - S.min()) / np.ptp(S)
    assert flat @ whole @ flat < 0.1
    assert tilted @ whole @ tilted > flat @ whole @ flat
    np.testing.assert_allclose(whole, whole.T)


def test_a_wild_curve_looks_like_nothing():
    curve = curve_of(Kind("pose ahead", "1", "x"), np.cos(np.pi * np.arange(KNOTS)))
    assert form_of(as_law(curve), curve.density) is None


def test_every_kind_can_be_run():
    from jaxident.effects.law_kinds import check_discovered

    for kind in KINDS:
        check_discovered([as_law(surface_of(kind, S) if kind.second_signal else curve_of(kind, AT))])
        assert kind.site in ("actuation", "drive", "contact", "time", "camera")


STEP, ROWS, RUNS = 1.0 / 30.0, 450, 6
NOISE = Noise(3e-4, 2e-3, None, slip_along=0.004, slip_heading=0.02)
ROBOT = Model(STEP, Physical(np.array([3.0, 5.0]), np.array([[0.8, 0.78], [9.0, -9.2]])), np.array([0.08, 0.1]), NOISE)


def drive(model: Model, seed: int):
    """Six runs of a robot with noise."""
    rng, t, logs, passed = np.random.default_rng(seed), STEP * np.arange(ROWS), [], 0.0
    for run in range(RUNS):
        u = np.repeat(rng.uniform(-1.0, 1.0, (ROWS // 15, 2)), 15, axis=0)
        log = make_log(t, u[:, 0], u[:, 1], *np.zeros((3, ROWS)))
        logs.append(ji.simulate(model, log, key=jax.random.key(10 * seed + run), session_time=passed))
        passed += t[-1]
    return join(logs)


def searched(model: Model, seed: int):
    return discover(find_effects(prepare(drive(model, seed), None))[1])


@pytest.mark.slow
def test_a_speed_that_falls_with_the_square_of_the_turn_rate_is_discovered():
    """The catalogue's turn loss goes with |w|, and no wheel knows w^2: the search names it for the straight part, and
    the curve is the rest. Together they are the law."""
    at = np.linspace(-3.0, 3.0, 16)
    law = Discovered("acceleration along", "v", "w", at, -0.25 * at**2)
    found = searched(dataclasses.replace(ROBOT, discovered=(law,)), 1)
    assert found
    first = found[0].curves[0]
    (at,) = first.at
    assert first.kind == Kind("acceleration along", "v", "w")
    assert first.alike == ()
    here = first.value - np.interp(0.0, at, first.value)  # the rate may take a constant
    loss = found[0].fit.vector[PLACES["turn_loss", "loss"]]
    apart = np.abs(here - loss * np.abs(at) + 0.25 * at**2)
    assert np.all(apart < 4.0 * first.deviation)
    assert apart.mean() < 0.2


@pytest.mark.slow
def test_laws_that_explain_as_much_are_named():
    """The product of both speeds is w times a straight line of v, and v times one of w."""
    at = np.linspace(-0.4, 0.4, 9)
    law = Discovered("acceleration along", "w", "v", at, 0.8 * at)
    first = searched(dataclasses.replace(ROBOT, discovered=(law,)), 3)[0].curves[0]
    both = {Kind("acceleration along", "w", "v"), Kind("acceleration along", "v", "w")}
    assert both <= {first.kind, *first.alike}


@pytest.mark.slow
@pytest.mark.parametrize(("act", "times"), [(act, times) for act, times, signal, *_ in KINDS if signal == "own angle"])
def test_what_comes_once_per_turn_of_a_wheel_is_discovered(act, times):
    """Every run begins at an angle of its own, which nobody tells."""
    at = np.linspace(-np.pi, np.pi, 10)
    half = 0.089 if "right" in act else -0.089  # as far from the middle as the gains say
    law = Discovered(act, times, "own angle", at, 0.2 * np.cos(at), period=0.16, half_track=half)
    first = searched(dataclasses.replace(ROBOT, discovered=(law,)), 4)[0].curves[0]
    assert first.kind == Kind(act, times, "own angle")
    assert first.turning.period == pytest.approx(0.16, rel=0.02)  # of some seven turns in a run
    assert first.turning.half_track == pytest.approx(half, rel=0.1)
    assert np.abs(first.value - 0.2 * np.cos(at)).max() < 0.06


@pytest.mark.slow
def test_robots_with_nothing_to_discover_have_no_curve():
    assert [len(searched(ROBOT, seed)) for seed in range(2, 8)] == [0] * 6


def test_a_law_has_nothing_that_the_nominal_robot_has():
    """Values of 1 at all knots, times v, are a rate: the prior holds their mean over the rows at 0, that of a law of
    1000 times the unit's variance, too. Held 1000 times less firmly, a rate fell from 4.4 to 0.1 1/s beside a law."""
    kind = Kind("acceleration along", "v", "w")
    curve = curve_of(kind, AT)._replace(density=np.arange(KNOTS, dtype=float))
    whole = prior_of(curve)
    spread = np.linalg.inv(whole)
    weight = curve.density / np.linalg.norm(curve.density)
    assert 1000.0 * weight @ spread @ weight < 2e-3
    free = np.linalg.inv(precision((AT,), np.zeros((KNOTS, 0))))
    bent = np.sin(3.0 * AT) - np.sum(curve.density * np.sin(3.0 * AT)) / curve.density.sum()
    assert bent @ np.linalg.inv(spread) @ bent == pytest.approx(bent @ np.linalg.inv(free) @ bent, rel=1e-6)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: " ".join(kind.names))
def test_the_nominal_part_of_a_law_is_what_the_linear_robot_has(kind):
    at = (FLOOR, FLOOR) if kind.second_signal else (AT,)
    forces = kind.acts_on.startswith(("acceleration", "push"))
    linear = sum(name in ("v", "w", "push right", "push left", "own speed", "own push") for name in kind.names[2:])
    columns = {"1": linear, "v": 1, "w": 1, "own push": 1}.get(kind.times, 0) if forces else 0
    columns = 1 if kind.signal == "own angle" else columns  # a mean over a turn is no matter of the angle
    assert nominal_part(kind, at).shape == (int(np.prod([len(each) for each in at])), columns)
