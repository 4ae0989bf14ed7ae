"""The exact hold solution against a fine integration of the differential equations, and its gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from jaxident.array_types import AT_REST, State, Wheels
from jaxident.robot.drive import Force, Physical, force, hold
from jaxident.robot.simulate import run_forces

RATE, GAIN, COUPLING = np.array([2.0, 6.0]), np.array([[1.2, 1.1], [120.0, -110.0]]), np.array([0.02, -0.5])
START = State(0.3, -0.2, 2.9, 0.4, -12.0)
STEPS = 30
EVEN = np.array(1 / 30)
UNEVEN = np.random.default_rng(0).uniform(0.002, 0.08, STEPS)
PULL = Force(*(np.random.default_rng(1).uniform(-1, 1, (STEPS, 2)) @ GAIN.T).T)

weights = jax.jit(hold)


def held(physical, pull, step, start):
    """States before and after each held force; the last row of a log holds none, which must not matter."""
    return run_forces(hold(physical, step), Force(*(jnp.append(p, jnp.nan) for p in pull)), start)


run = jax.jit(held)


def integrate(rate, coupling, pull: Force, step, start: State) -> np.ndarray:
    """States (samples + 1, 5) by an eighth-order Runge-Kutta method with error control, one call per held force."""
    states = [np.array(start)]
    for along, heading, h in zip(*pull, np.broadcast_to(step, len(pull.along)), strict=True):

        def slope(_, s, along=along, heading=heading):
            _, _, theta, v, w = s
            speeds = -rate * [v, w] + coupling * [w, v] + [along, heading]
            return [v * np.cos(theta), v * np.sin(theta), w, *speeds]

        states.append(solve_ivp(slope, (0, h), states[-1], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1])
    return np.array(states)


@pytest.mark.parametrize("step", [EVEN, UNEVEN], ids=["even", "uneven"])
@pytest.mark.parametrize("coupling", [None, COUPLING], ids=["uncoupled", "coupled"])
def test_exact_hold_is_the_fine_integration(step, coupling):
    """Turns reach 0.3 rad per step; the position may be 1e-9 m off, speeds and heading are exact."""
    ours = np.stack(run(Physical(RATE, GAIN, coupling), PULL, step, START), axis=1)
    reference = integrate(RATE, np.zeros(2) if coupling is None else coupling, PULL, step, START)
    assert np.max(np.abs(np.diff(reference[:, 2]))) > 0.3
    np.testing.assert_allclose(ours[:, :2], reference[:, :2], atol=1e-9)
    np.testing.assert_allclose(ours[:, 2:], reference[:, 2:], atol=1e-10)


def test_coupling_of_zero_is_no_coupling():
    one, other = (run(Physical(RATE, GAIN, c), PULL, EVEN, START) for c in (None, np.zeros(2)))
    np.testing.assert_allclose(np.stack(one), np.stack(other), rtol=1e-12, atol=1e-12)


def test_rate_of_zero_is_an_integrator():
    pull = Force(np.resize([1.0, -2.0], STEPS), np.zeros(STEPS))
    state = run(Physical(np.zeros(2), GAIN), pull, np.array(0.5), AT_REST)
    np.testing.assert_allclose(state.v[:4], [0.0, 0.5, -0.5, 0.0], atol=1e-15)
    np.testing.assert_allclose(state.x[:4], [0.0, 0.125, 0.125, 0.0], atol=1e-15)


def test_a_split_step_ends_where_the_whole_one_does():
    half = STEPS // 2
    halves = Force(*(np.repeat(p[:half], 2) for p in PULL))
    whole = run(Physical(RATE, GAIN, COUPLING), PULL, UNEVEN, START)
    split = run(Physical(RATE, GAIN, COUPLING), halves, np.repeat(UNEVEN[:half] / 2, 2), START)
    np.testing.assert_allclose(np.stack(split)[:, ::2], np.stack(whole)[:, : half + 1], atol=1e-9)


def test_settles_where_force_and_damping_balance():
    pull = Force(np.full(STEPS, 1.5), np.full(STEPS, -3.0))
    for coupling in (None, COUPLING):
        state = run(Physical(RATE, GAIN, coupling), pull, np.array(0.5), START)
        across = np.zeros(2) if coupling is None else coupling
        system = np.array([[RATE[0], -across[0]], [-across[1], RATE[1]]])
        np.testing.assert_allclose([state.v[-1], state.w[-1]], np.linalg.solve(system, [1.5, -3.0]), rtol=1e-10)


@pytest.mark.parametrize("coupling", [None, COUPLING, np.array([1.0, -20.0])], ids=["none", "weak", "oscillating"])
def test_weights_are_those_of_the_matrix_exponential(coupling):
    """From a microsecond to a pause of a minute, where rate times step is 360."""
    across = np.zeros(2) if coupling is None else coupling
    system = np.zeros((5, 5))  # v, w, turn and the held forces
    system[:2] = [[-RATE[0], across[0], 0, 1, 0], [across[1], -RATE[1], 0, 0, 1]]
    system[2, 1] = 1.0
    steps = np.array([1e-6, 1e-3, 1 / 30, 0.3, 2.0, 60.0])
    solution = weights(Physical(RATE, GAIN, coupling), steps)
    for index, step in enumerate(steps):
        exact = expm(system * step)[:3][:, [0, 1, 3, 4]]
        for response, expected in zip((solution.v, solution.w, solution.turn), exact, strict=True):
            found = [0.0 if weight is None else float(weight[index]) for weight in response]
            np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-16)


@pytest.mark.parametrize(("step", "size"), [(EVEN, 6), (UNEVEN, 8)], ids=["uncoupled even", "coupled uneven"])
def test_gradients(step, size):
    """Against central differences of step 1e-5, whose truncation and rounding leave about 1e-9; finite at rest, with
    zero speed, zero turn and zero force at once."""
    weights = np.random.default_rng(3).normal(size=(3, STEPS + 1))

    def score(parameters, start, commands):
        physical = Physical(parameters[:2], parameters[2:6].reshape(2, 2), parameters[6:8] if size == 8 else None)
        state = held(physical, force(physical, Wheels(*commands)), step, State(*start))
        return jnp.sum(weights * jnp.stack(state.pose))

    commands = np.random.default_rng(2).uniform(-1, 1, (2, STEPS))
    point = np.concatenate([RATE, GAIN.ravel(), COUPLING])[:size], np.array(START)
    both = jax.jit(jax.value_and_grad(score, argnums=(0, 1)))
    for which, slope in enumerate(both(*point, commands)[1]):
        for index, found in enumerate(slope):
            up, down = (both(*moved(point, which, index, change), commands)[0] for change in (1e-5, -1e-5))
            assert float(found) == pytest.approx(float(up - down) / 2e-5, rel=1e-6, abs=1e-6)
    _, at_rest = both(point[0], np.zeros(5), np.zeros((2, STEPS)))
    assert np.all(np.isfinite(np.concatenate(at_rest)))
    assert float(at_rest[1][0]) == pytest.approx(weights[0].sum())


def moved(point, which, index, change):
    """The point with one number of one of its arrays changed."""
    arrays = [array.copy() for array in point]
    arrays[which][index] += change
    return arrays


def test_force_is_the_gain_times_what_passed():
    pull = force(Physical(RATE, GAIN), Wheels(np.array([1.0, 0.0]), np.array([0.0, 2.0])))
    np.testing.assert_allclose(np.stack(pull), GAIN * [1.0, 2.0])
