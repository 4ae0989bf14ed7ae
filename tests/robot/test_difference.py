"""The difference equations against an independent discretisation, a hand-worked example and a plain loop."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import ss2tf

from jaxident.array_types import AT_REST, Increment, State, Wheels
from jaxident.robot.difference import Difference, to_difference, to_physical
from jaxident.robot.drive import Physical
from jaxident.robot.model import Model
from jaxident.robot.simulate import free_run, run_difference, run_physical


def transfer_function(system, gain, output, period):
    """Numerator and denominator in z of x' = system x + gain m, y' = x[output]: matrix exponential, then the state
    space's transfer function. Shares nothing with the package."""
    order = len(system) + 1
    augmented = np.zeros((order + 1, order + 1))
    augmented[: order - 1, : order - 1] = system
    augmented[order - 1, output] = 1.0
    augmented[: order - 1, order] = gain
    discrete = expm(augmented * period)
    pick = np.eye(order)[order - 1 :]
    numerator, denominator = ss2tf(discrete[:order, :order], discrete[:order, order:], pick, [[0.0]])
    return numerator[0], denominator


def random_physical(seed: int) -> tuple[Physical, float]:
    rng = np.random.default_rng(seed)
    return Physical(rng.uniform(0.1, 20.0, 2), rng.normal(size=(2, 2))), rng.uniform(0.005, 0.2)


@pytest.mark.parametrize("seed", range(8))
def test_hold_image_is_the_z_transform(seed):
    physical, period = random_physical(seed)
    difference = to_difference(physical, period)
    for row in range(2):
        for wheel in range(2):
            gain = [physical.gain[row, wheel]]
            numerator, denominator = transfer_function([[-physical.rate[row]]], gain, 0, period)
            ours = [0.0, difference.delta[row, wheel], -difference.epsilon[row, wheel]]
            np.testing.assert_allclose(ours, numerator, rtol=1e-10, atol=1e-15)
            np.testing.assert_allclose(np.poly([1.0, difference.alpha[row]]), denominator, rtol=1e-10)


@pytest.mark.parametrize("seed", range(8))
def test_physical_to_difference_and_back(seed):
    physical, period = random_physical(seed)
    difference = to_difference(physical, period)
    back = to_physical(difference, period)
    np.testing.assert_allclose(back.rate, physical.rate, rtol=1e-12)
    np.testing.assert_allclose(back.gain, physical.gain, rtol=1e-12)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-12), to_difference(back, period), difference)


def test_free_numerators_keep_pole_and_gain_at_rest():
    """The paper's own estimate is no hold image; what is kept is the pole and the speed it settles at."""
    delta = jnp.array([[8.6728e-5, 6.6979e-5], [0.0343, -0.0335]])
    epsilon = -jnp.array([[5.4438e-5, 7.5772e-5], [0.0312, -0.0308]])
    period = 1 / 30
    physical = to_physical(Difference(jnp.array([0.9818, 0.7699]), delta, epsilon), period)
    image = to_difference(physical, period)
    np.testing.assert_allclose(image.alpha, [0.9818, 0.7699], rtol=1e-14)
    settled = (delta - epsilon) / (1 - np.array([[0.9818], [0.7699]]))
    np.testing.assert_allclose(physical.gain / physical.rate[:, None] * period, settled, rtol=1e-12)
    np.testing.assert_allclose(image.delta - image.epsilon, delta - epsilon, rtol=1e-12)


# Section VII of the paper: leading coefficient and zeros of each third-order numerator, as printed.
PUBLISHED = {
    (0, 0): (7.1181e-5, (-0.9932, 0.7724)),
    (0, 1): (7.0344e-5, (-0.9948, 0.7688)),
    (1, 0): (0.0341, (-0.9167, 0.9822)),
    (1, 1): (-0.0333, (-0.9169, 0.9819)),
}
PUBLISHED_POLES = (0.7706, 0.9821, 1.0)
LAST_DIGIT = 1e-4
"""One unit in the last printed digit of a pole, a zero, and the leading coefficients of G21 and G22."""


@pytest.mark.parametrize(("row", "wheel"), PUBLISHED)
def test_published_robot_has_the_published_transfer_functions(published, row, wheel):
    rate, gain, coupling = published.physical
    system = np.array([[-rate[0], coupling[0]], [coupling[1], -rate[1]]])
    numerator, denominator = transfer_function(system, np.asarray(gain)[:, wheel], row, 1.0)
    leading, zeros = PUBLISHED[row, wheel]
    rounding = LAST_DIGIT if row else 1e-4 * leading
    assert numerator[0] == pytest.approx(0.0, abs=1e-15)
    assert numerator[1] == pytest.approx(leading, abs=rounding)
    np.testing.assert_allclose(np.sort(np.roots(numerator[1:])), zeros, atol=LAST_DIGIT)
    np.testing.assert_allclose(np.sort(np.roots(denominator)), PUBLISHED_POLES, atol=LAST_DIGIT)


def test_three_samples_by_hand():
    """a = (0.5, 0.25); dead zones 0.25 and 0.5 let pass m_r = 0.75, -0.25, 0 and m_l = 0, 0.25, -0.5:

    dl_1 = 0.5 * 0.2   + 0.4 * 0.75                                            =  0.4
    dl_2 = 0.5 * 0.4   - 0.4 * 0.25 + 0.1 * 0.75 + 0.2 * 0.25                  =  0.225
    dl_3 = 0.5 * 0.225              - 0.1 * 0.25 - 0.2 * 0.5  - 0.05 * 0.25    = -0.025
    dt_1 = 0.25 * 0.4    + 1 * 0.75                                            =  0.85
    dt_2 = 0.25 * 0.85   - 1 * 0.25 + 0.5 * 0.75 - 1 * 0.25                    =  0.0875
    dt_3 = 0.25 * 0.0875            - 0.5 * 0.25 + 1 * 0.5    - 0.5 * 0.25     =  0.271875
    """
    difference = Difference(
        jnp.array([0.5, 0.25]), jnp.array([[0.4, 0.2], [1.0, -1.0]]), jnp.array([[-0.1, 0.05], [-0.5, 0.5]])
    )
    command = Wheels(jnp.array([1.0, -0.5, 0.2, jnp.nan]), jnp.array([0.5, 0.75, -1.0, jnp.nan]))
    increment = free_run(difference, jnp.array([0.25, 0.5]), command, Increment(0.2, 0.4))
    np.testing.assert_allclose(increment.length, [0.4, 0.225, -0.025], rtol=1e-14)
    np.testing.assert_allclose(increment.turn, [0.85, 0.0875, 0.271875], rtol=1e-14)


def loop(difference, width, u_r, u_l, before):
    """PAPER (13)-(14), line by line in NumPy."""
    (a1, a2), delta, epsilon = (np.asarray(p) for p in difference)
    m_r, m_l = (np.sign(u) * np.maximum(np.abs(u) - d, 0.0) for u, d in zip((u_r, u_l), width, strict=True))
    dl, dtheta = [before[0]], [before[1]]
    for k in range(1, len(u_r)):
        new, old = np.array([m_r[k - 1], m_l[k - 1]]), np.array([m_r[k - 2], m_l[k - 2]]) if k > 1 else np.zeros(2)
        dl.append(a1 * dl[-1] + delta[0] @ new - epsilon[0] @ old)
        dtheta.append(a2 * dtheta[-1] + delta[1] @ new - epsilon[1] @ old)
    return np.array(dl[1:]), np.array(dtheta[1:])


def test_scan_is_the_loop():
    rng = np.random.default_rng(3)
    u_r, u_l = rng.uniform(-1, 1, (2, 200))
    difference = Difference(np.array([0.98, 0.77]), rng.normal(size=(2, 2)), rng.normal(size=(2, 2)))
    width = np.array([0.25, 0.2])
    increment = jax.jit(free_run)(difference, width, Wheels(u_r, u_l), Increment(0.1, -0.2))
    for ours, reference in zip(increment, loop(difference, width, u_r, u_l, (0.1, -0.2)), strict=True):
        np.testing.assert_allclose(ours, reference, rtol=1e-12, atol=1e-12)


def test_both_forms_turn_alike():
    """Without coupling, (14) and the exact drive give the same headings from rest, and nearly the same positions."""
    period = 1 / 30
    physical = Physical(jnp.array([2.0, 8.0]), jnp.array([[1.0, 0.9], [30.0, -28.0]]))
    width = jnp.array([0.25, 0.2])
    u = Wheels(*np.random.default_rng(4).uniform(-1, 1, (2, 100)))
    exact = jax.jit(run_physical)(Model(period, physical, width), u, period, AT_REST)
    image = jax.jit(run_difference)(to_difference(physical, period), width, u, AT_REST, period)
    np.testing.assert_allclose(image.theta, exact.theta, atol=1e-12)
    np.testing.assert_allclose(np.stack([image.x, image.y]), np.stack([exact.x, exact.y]), atol=1e-4)


def test_start_speed_carries_over():
    """Without commands the first increment is the pole times what the start's speed covers in a period."""
    difference = Difference(jnp.array([0.9, 0.8]), jnp.ones((2, 2)), jnp.zeros((2, 2)))
    still = Wheels(jnp.zeros(3), jnp.zeros(3))
    pose = run_difference(difference, jnp.zeros(2), still, State(1.0, 2.0, 0.0, 0.5, 0.0), 0.1)
    np.testing.assert_allclose(pose.x, 1.0 + 0.05 * np.array([0.0, 0.9, 0.9 + 0.81]), rtol=1e-14)
    np.testing.assert_allclose(pose.y, 2.0)
