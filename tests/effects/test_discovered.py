"""Discovered laws in both integrators, against effects and closed forms that do the same."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxident as ji
from jaxident.array_types import AT_REST, Pose
from jaxident.diagnosis.laws.kinds import KINDS
from jaxident.effects.catalogue import BY_KIND
from jaxident.effects.discovered import shifted, with_laws
from jaxident.effects.law_arrays import laws_of
from jaxident.effects.law_kinds import ACTS, MOST_KNOTS, MOST_LAWS, MOST_SURFACE_KNOTS, check_discovered
from jaxident.effects.past import past_of
from jaxident.errors import InputError
from jaxident.estimation.ahead.beyond_range import beyond_range, signals
from jaxident.estimation.ahead.stretches import Starts, every
from jaxident.log import make_log
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.drive import Physical
from jaxident.robot.model import Discovered, Effect, Model
from jaxident.robot.simulate import run_physical

STEP, ROWS = 0.04, 200
ROBOT = Model(STEP, Physical(np.array([3.0, 5.0]), np.array([[0.8, 0.78], [9.0, -9.2]])), np.array([0.08, 0.1]))
TURNS, PUSHES = np.linspace(-4.0, 4.0, 9), np.linspace(-1.0, 1.0, 9)
HEATS, SINCE = np.linspace(0.0, 0.5, 9), np.linspace(0.0, 2.0, 9)
ROUND = np.linspace(-np.pi, np.pi, 9)
AROUND = ("own angle", ROUND, 0.3 * np.sin(ROUND), None, "", None)
SURFACE = np.random.default_rng(8).normal(size=(5, 5))


def drive():
    """A log of both wheels at many levels."""
    rng, t = np.random.default_rng(3), STEP * np.arange(ROWS)
    u = np.repeat(rng.uniform(-1.0, 1.0, (ROWS // 10, 2)), 10, axis=0)
    return make_log(t, u[:, 0], u[:, 1], *np.zeros((3, ROWS)))


def with_law(*law) -> Model:
    return dataclasses.replace(ROBOT, discovered=(Discovered(*law),))


LAWS = (
    ("acceleration along", "v", "w", TURNS, -0.5 * np.abs(TURNS)),
    ("acceleration in heading", "1", "time", np.linspace(0.0, 8.0, 9), np.linspace(0.0, 3.0, 9)),
    ("speed sideways", "v", "w", TURNS, 0.05 * TURNS),
    ("push of each wheel", "1", "own push", PUSHES, 0.2 * PUSHES**3),
    ("push of each wheel", "1", "own speed", PUSHES, -0.2 * PUSHES * np.abs(PUSHES)),
    ("pose ahead", "1", "x", PUSHES, 0.1 * PUSHES**2),
    ("pose to the left", "1", "heading", TURNS[1:-1], 0.03 * np.sin(TURNS[1:-1])),
    ("reported heading", "1", "y", PUSHES, 0.1 * PUSHES),
    ("push of each wheel", "own push", "own heat 3 s", HEATS, -0.5 * HEATS),
    ("push of each wheel", "1", "own speed", PUSHES[::2], 0.2 * SURFACE, None, "own push", PUSHES[::2]),
    ("push of each wheel", "own change 0.1 s", "v", PUSHES, -2.0 * np.abs(PUSHES)),
    ("push of each wheel", "1", "own change 0.3 s", 2.0 * PUSHES, -np.abs(PUSHES)),
    ("push of each wheel", "own sense", "own push", PUSHES, -0.1 - 0.1 * PUSHES**2),
    ("acceleration along", "v", "since reversal", SINCE, -3.0 * np.exp(-SINCE / 0.4)),
    ("acceleration in heading", "direction 0.3 s", "since reversal 0.3 s", SINCE, 5.0 * np.exp(-SINCE / 0.4)),
    ("acceleration along", "v", "x", PUSHES[::2], SURFACE, None, "y", PUSHES[::2]),
    ("acceleration along", "sin heading", "x", PUSHES[::2], SURFACE, None, "y", PUSHES[::2]),
    ("acceleration in heading", "v sin heading", "x", PUSHES[::2], 9.0 * SURFACE, None, "y", PUSHES[::2]),
    ("speed sideways", "v", "x", PUSHES[::2], 0.1 * SURFACE, None, "y", PUSHES[::2]),
    ("push of the right wheel", "own push", *AROUND, 0.13, 0.1),
    ("push of the left wheel", "1", *AROUND, 0.13, -0.1),
    ("rolling of the right wheel", "own speed", *AROUND, 0.13, 0.1),
    ("rolling of the left wheel", "own speed", *AROUND, 0.13, -0.1),
)


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS, ids=lambda law: " by ".join([law[0], law[2], *law[6:7]]))
def test_a_robot_with_a_law_is_predicted_by_its_own_model_alone(law):
    """The full integrator drives, the fast one predicts; without the law the prediction is at least ten times worse."""
    model = with_law(*law)
    seen = ji.simulate(model, drive())
    own, without = (ends_apart(each, seen) for each in (model, ROBOT))
    assert own < 0.1 * without, (own, without)


def ends_apart(model: Model, log) -> float:
    found = ji.predict(model, log, 20, burn_in=60)
    last = np.flatnonzero(found.step == 20)
    rows = found.start[last] + 20
    apart = [np.asarray(column)[last] - np.asarray(getattr(log, name))[rows] for name, column in (
        ("x", found.x), ("y", found.y), ("theta", found.theta))]  # fmt: skip
    apart[2] = (apart[2] + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.sqrt(np.mean(np.square(apart))))


def test_a_law_that_does_what_an_effect_does_moves_the_robot_as_the_effect():
    loss = 0.5
    as_effect = dataclasses.replace(ROBOT, effects=(Effect("turn_loss", {"loss": loss}),))
    plain, law, effect = (
        ji.simulate(each, drive())
        for each in (ROBOT, with_law("acceleration along", "v", "w", TURNS, -loss * np.abs(TURNS)), as_effect)
    )
    moved = np.abs(np.asarray(effect.x) - np.asarray(plain.x)).max()
    assert np.abs(np.asarray(law.x) - np.asarray(effect.x)).max() < 0.02 * moved


def test_a_straight_line_of_the_wheels_push_is_a_larger_gain():
    louder = dataclasses.replace(ROBOT, dynamics=ROBOT.dynamics._replace(gain=1.2 * ROBOT.dynamics.gain))
    wide = 2.0 * PUSHES
    law = ji.simulate(with_law("push of each wheel", "1", "own push", wide, 0.2 * wide), drive())
    np.testing.assert_allclose(law.x, ji.simulate(louder, drive()).x, atol=1e-7)


def test_commands_in_another_unit_move_the_robot_alike():
    """A law in the user's unit and the same for commands over the largest."""
    given = Discovered("push of each wheel", "1", "own push", 100.0 * PUSHES, 20.0 * PUSHES**3)
    mine = Discovered("push of each wheel", "1", "own push", PUSHES, 0.2 * PUSHES**3)
    for one, other in zip(laws_of([given], 100.0), laws_of([mine]), strict=True):
        np.testing.assert_allclose(one, other)


def test_heat_of_commands_in_another_unit_moves_the_robot_alike():
    """Heat goes with the square of the command; a part of the push has no unit."""
    given = Discovered("push of each wheel", "own push", "own heat 3 s", 1e4 * HEATS, -0.5 * HEATS)
    mine = Discovered("push of each wheel", "own push", "own heat 3 s", HEATS, -0.5 * HEATS)
    for one, other in zip(laws_of([given], 100.0), laws_of([mine]), strict=True):
        np.testing.assert_allclose(one, other)
    t, command = STEP * np.arange(ROWS), np.random.default_rng(0).normal(size=(ROWS, 2))
    np.testing.assert_allclose(past_of(t, 100.0 * command).heat, 1e4 * past_of(t, command).heat)


def test_a_curve_is_straight_between_its_knots_and_constant_beyond():
    at, value = np.array([-1.0, 0.0, 2.0]), np.array([1.0, 3.0, -1.0])
    settings = with_laws({}, laws_of([Discovered("reported heading", "1", "x", at, value)]))
    x = jnp.array([-9.0, -1.0, -0.5, 0.0, 0.5, 2.0, 9.0])
    pose = Pose(x, jnp.zeros_like(x), jnp.zeros_like(x))
    np.testing.assert_allclose(shifted(settings, pose, pose).theta, np.interp(x, at, value))


def test_a_surface_is_straight_between_its_knots_along_both_signals_and_constant_beyond():
    at, second = np.array([-1.0, 0.0, 2.0]), np.array([0.0, 1.0])
    value = np.array([[1.0, 2.0], [3.0, -1.0], [0.0, 0.5]])
    law = Discovered("reported heading", "1", "x", at, value, None, "y", second)
    settings = with_laws({}, laws_of([law, Discovered("reported heading", "1", "heading", at, np.full(3, 0.25))]))
    x = jnp.array([-9.0, -0.5, 1.0, 9.0, 1.0, 0.5])
    y = jnp.array([-1.0, 0.5, 9.0, 0.5, 0.25, 0.75])
    there = [np.interp(b, second, [np.interp(a, at, column) for column in value.T]) for a, b in zip(x, y, strict=True)]
    found = shifted(settings, Pose(x, y, jnp.zeros_like(x)), Pose(x, y, jnp.zeros_like(x))).theta
    np.testing.assert_allclose(found, 0.25 + np.array(there))


def test_a_surface_with_the_same_values_along_one_signal_is_a_curve_of_the_other():
    curve = with_law("acceleration along", "v", "w", PUSHES[:8], -np.abs(PUSHES[:8]))
    flat = np.repeat(-np.abs(PUSHES[:8])[:, None], 4, axis=1)
    surface = with_law("acceleration along", "v", "w", PUSHES[:8], flat, None, "x", PUSHES[:4])
    np.testing.assert_allclose(ji.simulate(surface, drive()).x, ji.simulate(curve, drive()).x, atol=1e-9)


def test_the_file_of_a_model_with_a_surface_reads_back(tmp_path):
    law = Discovered("acceleration along", "v", "x", PUSHES[:3], SURFACE[:3], np.abs(SURFACE[:3]), "y", PUSHES[:5])
    ji.save_model(dataclasses.replace(ROBOT, discovered=(law,)), tmp_path / "model.json")
    (back,) = ji.load_model(tmp_path / "model.json").discovered
    assert back.second_signal == "y"
    for one, other in ((back.second_at, law.second_at), (back.value, law.value),
                       (back.standard_deviation, law.standard_deviation)):  # fmt: skip
        np.testing.assert_array_equal(one, other)


def test_no_prediction_is_beyond_the_angles_of_a_wheel():
    log, starts, pose = driven_ahead()
    assert beyond_range(with_law(*LAWS[-1]), log, starts, pose, 0.0) == []


@pytest.mark.slow  # its programs take 25 s to compile; `test_paths` looks at the angle in windows
def test_a_wheel_begins_at_the_angle_that_it_had_there():
    """Poses before a start tell the angle: a free run from far within a run ends near the robot, though nobody says how
    far the wheel had turned."""
    robot = dataclasses.replace(with_law(*LAWS[-3]), noise=ji.Noise(position=2e-4, heading=1e-3))
    late = ji.simulate(robot, drive(), key=jax.random.key(2)).rows(60, ROWS)
    assert ends_apart(robot, late) < 0.05 * ends_apart(ROBOT, late)


def test_the_file_of_a_law_of_a_wheel_reads_back(tmp_path):
    ji.save_model(with_law(*LAWS[-1]), tmp_path / "model.json")
    (back,) = ji.load_model(tmp_path / "model.json").discovered
    assert (back.signal, back.period, back.half_track) == ("own angle", 0.13, -0.1)


def test_the_file_of_a_model_with_a_law_reads_back(tmp_path):
    law = Discovered("speed sideways", "v", "w", TURNS, 0.05 * TURNS, 0.01 * np.ones(9))
    ji.save_model(dataclasses.replace(ROBOT, discovered=(law,)), tmp_path / "model.json")
    (back,) = ji.load_model(tmp_path / "model.json").discovered
    assert (back.acts_on, back.times, back.signal) == ("speed sideways", "v", "w")
    for one, other in ((back.at, law.at), (back.value, law.value), (back.standard_deviation, law.standard_deviation)):
        np.testing.assert_array_equal(one, other)


GOOD = {"acts_on": "acceleration along", "times": "1", "signal": "v", "at": TURNS, "value": TURNS}
OF_A_WHEEL = {"acts_on": "push of the left wheel", "signal": "own angle", "period": 0.1, "half_track": 0.1}
BAD = (
    ({"acts_on": "acceleration up"}, "acts_on is 'acceleration up'"),
    ({"signal": "weather"}, "signal is 'weather'"),
    ({"times": "u"}, "times is 'u'"),
    ({"at": TURNS[::-1]}, "knots are out of order"),
    ({"value": TURNS[1:]}, "9 knots and 8 values"),
    ({"second_signal": "w", "second_at": np.arange(10.0)}, f"10 knots; 2 to {MOST_SURFACE_KNOTS}"),
    ({"second_signal": "v", "second_at": TURNS[:3]}, "two signals are needed"),
    ({"second_signal": "weather", "second_at": TURNS[:3]}, "second_signal is 'weather'"),
    ({"at": TURNS[:4], "second_signal": "w", "second_at": TURNS[:3]}, "4 x 3 knots and 9 values"),
    ({"value": np.full(9, np.nan)}, "not finite"),
    ({"at": TURNS[:1], "value": TURNS[:1]}, "1 knots"),
    ({"at": np.arange(99.0), "value": np.zeros(99)}, f"2 to {MOST_KNOTS}"),
    ({"acts_on": "pose ahead"}, "error of the camera"),
    ({"acts_on": "push of each wheel"}, "push of each wheel"),
    ({"signal": "own push"}, "push of each wheel"),
    ({"times": "own push"}, "push of each wheel"),
    ({"signal": "own angle", "period": 0.1, "half_track": 0.1}, "push of each wheel"),
    ({"period": 0.1, "half_track": 0.1}, "has a period above 0 and a half_track"),
    (OF_A_WHEEL | {"signal": "own speed"}, "for one wheel is a curve of its own angle"),
    (OF_A_WHEEL | {"half_track": None}, "has a period above 0 and a half_track"),
    (OF_A_WHEEL | {"period": 0.0}, "has a period above 0"),
    (OF_A_WHEEL | {"second_signal": "own push", "second_at": TURNS[:3], "value": np.zeros((9, 3))}, "for one wheel"),
)


@pytest.mark.parametrize(("change", "words"), BAD, ids=lambda value: str(value)[:30])
def test_a_law_that_no_program_can_run_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        check_discovered([Discovered(**{**GOOD, **change})])


def test_effects_name_the_laws_in_whose_place_they_act():
    assert "turn_loss" in BY_KIND["acceleration along", "v", "w"]
    for kind in BY_KIND:
        assert kind in {known.names for known in KINDS}


def test_too_many_laws_are_refused():
    with pytest.raises(InputError, match=f"at most {MOST_LAWS}"):
        check_discovered([Discovered(**GOOD)] * (MOST_LAWS + 1))


def test_every_place_has_a_law_that_was_tried():
    assert {law[0] for law in LAWS} == set(ACTS)


@pytest.mark.slow
def test_a_plan_drives_the_robot_with_its_laws():
    """The room that it says the path needs is that of the simulator's path, of which the robot without laws needs
    another."""
    robot = with_law(*LAWS[0])
    found = ji.plan(robot, ("transport_delay", "motor_lag"), samples=300, batches=0)
    path = ji.simulate(robot, found.log)
    np.testing.assert_allclose(found.area, [np.ptp(path.x), np.ptp(path.y)], rtol=0.02)
    plain = ji.simulate(dataclasses.replace(robot, discovered=()), found.log)
    assert np.abs(np.array([np.ptp(plain.x), np.ptp(plain.y)]) / found.area - 1.0).max() > 0.05


def driven_ahead():
    """A log, starts in it, and poses of the next 30 rows."""
    log = drive()
    log = log._replace(**{name: np.asarray(getattr(ji.simulate(ROBOT, log), name)) for name in ("x", "y", "theta")})
    starts = every(log, 20, 40)
    starts = type(starts)(*(column[starts.row + 30 < len(log.t)] for column in starts))
    return log, starts, np.stack([np.stack(log.pose, axis=1)[row + 1 : row + 31] for row in starts.row])


def test_predictions_beyond_what_a_surface_has_seen_along_its_second_signal_are_told():
    log, starts, pose = driven_ahead()
    low, high = pose[..., 1].min(), pose[..., 1].max()
    for end, left in ((high, False), (0.5 * (low + high), True)):
        flat, wide = np.zeros((2, 2)), np.array([-9.0, 9.0])
        robot = with_law("acceleration along", "v", "x", wide, flat, None, "y", np.array([low, end]))
        lines = beyond_range(robot, log, starts, pose, 0.0)
        assert [f"m of x and {low:.3g} to {end:.3g} m of y in which" in line for line in lines] == [True] * left


@pytest.mark.parametrize("law", LAWS[:-4], ids=lambda law: " by ".join([law[0], law[2], *law[6:7]]))
def test_predictions_beyond_what_a_law_has_seen_are_told(law):
    """A curve that ends within the robot's range is left by some free runs, one that spans it by none."""
    log, starts, pose = driven_ahead()
    signal = signals(ROBOT, log, starts, pose, 0.0)[law[2]]
    low, high = np.nanmin(signal), np.nanmax(signal)
    for part, left in ((1.0, False), (0.5, True)):
        robot = with_law(*law[:3], np.linspace(low, low + part * (high - low), 5), np.zeros(5))
        lines = beyond_range(robot, log, starts, pose, 0.0)
        assert bool(lines) == left
        assert all(f"of {law[2]} in which" in line for line in lines)


def test_signals_along_predicted_poses_are_the_robots():
    log = drive()
    states = run_physical(ROBOT, log.command, STEP, AT_REST)
    log = log._replace(x=np.asarray(states.x), y=np.asarray(states.y), theta=np.asarray(states.theta))
    starts = Starts(np.array([0]), np.array([20]))
    found = signals(ROBOT, log, starts, np.stack(log.pose, axis=1)[None, 21:81], 3.0)
    middle = [0.5 * (np.asarray(column)[21:80] + np.asarray(column)[22:81]) for column in (states.v, states.w)]
    np.testing.assert_allclose(found["v"][:, 0], middle[0], atol=0.02 * np.abs(middle[0]).max())
    np.testing.assert_allclose(found["w"][:, 0], middle[1], atol=0.05 * np.abs(middle[1]).max())
    np.testing.assert_allclose(found["time"][:, 0], 3.0 + STEP * np.arange(21, 81))
    right = effective_command(log.command, ROBOT.dead_zone).right[21:81]
    np.testing.assert_allclose(found["push right"][:, 0], right)
    steady = found["own speed"].reshape(2, 59) - np.linalg.solve(
        ROBOT.physical.gain, ROBOT.physical.rate[:, None] * np.stack(middle)
    )
    assert np.abs(steady).max() < 0.1
