"""Other people's tools on the records that `compare.py draw` wrote.

    python3 -m venv peers_env && peers_env/bin/pip install -r experiments/peers/requirements.txt
    peers_env/bin/python -m experiments.peers.peers --data peers/data.npz --out peers/theirs.npz

Unknown are two rates, four gains and two dead zones; wherever a tool allows it, the five start states too. What a tool
lacks it is given: the simulator below, the camera's noise, and a start about half off: each number times exp(z / 2), z
normal.
"""

import argparse
import time

import jax
import jax.numpy as jnp
import mujoco.sysid as ms
import numpy as np
import padasip
from jax_sysid.models import Model
from scipy import optimize, signal

KEPT = ("method", "record", "found", "half", "ok", "seconds")
PARAMETERS, STATES = 8, 5
NODES, WEIGHTS = (0.1127016653792583, 0.5, 0.8872983346207417), (5 / 18, 8 / 18, 5 / 18)
LARGEST_ZONE = 0.9


def passed(u, zone, xp):
    """What of the commands passes the dead zones."""
    return u - xp.clip(u, -zone, zone)


def simulate(parameters, start, u, period):
    """Poses (samples, 3) of the nominal robot under held commands (samples, 2): speeds exactly, position by three
    Gauss nodes a step."""
    rate, gain, zone = parameters[:2], parameters[2:6].reshape(2, 2), parameters[6:8]
    steady = passed(u, zone, np)[:-1] @ gain.T / rate
    keep = np.exp(-rate * period)
    speed = np.empty((len(u), 2))
    for k in range(2):
        speed[:, k] = np.concatenate(
            [[start[3 + k]], signal.lfilter([1 - keep[k]], [1, -keep[k]], steady[:, k], zi=[keep[k] * start[3 + k]])[0]]
        )
    away = speed[:-1] - steady
    turn = steady[:, 1] * period + away[:, 1] * (1 - keep[1]) / rate[1]
    theta = start[2] + np.concatenate([[0.0], np.cumsum(turn)])
    step = np.zeros((len(u) - 1, 2))
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        left = np.exp(-rate * period * node)
        v = steady[:, 0] + away[:, 0] * left[0]
        direction = theta[:-1] + steady[:, 1] * period * node + away[:, 1] * (1 - left[1]) / rate[1]
        step += weight * period * (v * np.array([np.cos(direction), np.sin(direction)])).T
    place = start[:2] + np.concatenate([np.zeros((1, 2)), np.cumsum(step, axis=0)])
    return np.column_stack([place, theta])


def first_start(pose, period):
    """Start state (5,) from the first poses."""
    ahead = pose[5] - pose[0]
    speed = np.hypot(*ahead[:2]) / (5 * period) * np.sign(ahead[:2] @ [np.cos(pose[0, 2]), np.sin(pose[0, 2])])
    return np.array([*pose[0], speed, ahead[2] / (5 * period)])


def problem(case):
    """Residuals in units of the camera's deviations, a point to begin at, and its bounds."""
    first = first_start(case["pose"], case["period"])
    zone = case["start"][6:8]
    point = np.concatenate([case["start"], first])
    low, high = np.full(len(point), -np.inf), np.full(len(point), np.inf)
    low[:2], low[6:8], high[6:8] = 1e-2, 0.0, LARGEST_ZONE
    point[6:8] = np.clip(zone, 1e-3, LARGEST_ZONE - 1e-3)

    def residual(x):
        error = (simulate(x[:PARAMETERS], x[PARAMETERS:], case["u"], case["period"]) - case["pose"]) / case["sigma"]
        return np.nan_to_num(error.ravel(), nan=1e6, posinf=1e6, neginf=-1e6)

    return residual, point, low, high


def scipy_least_squares(case):
    """Output error by `scipy.optimize.least_squares`; intervals from its Jacobian."""
    residual, point, low, high = problem(case)
    found = optimize.least_squares(residual, point, bounds=(low, high), x_scale=np.maximum(np.abs(point), 1e-2))
    inverse = np.linalg.pinv(found.jac.T @ found.jac)
    spread = np.sqrt(np.diagonal(inverse) * 2.0 * found.cost / (found.fun.size - len(point)))
    return found.x[:PARAMETERS], 1.96 * spread[:PARAMETERS], found.success


def mujoco_sysid(case):
    """The same residuals by `mujoco.sysid.optimize`, with its own intervals."""
    residual, point, low, high = problem(case)
    width = 3.0 * np.maximum(np.abs(point), 0.3)
    low, high = np.maximum(low, point - width), np.minimum(high, point + width)
    parameters = ms.ParameterDict({"all": ms.Parameter("all", point, low, high)})

    def columns(x, _):  # the optimiser asks for several points at once, a column each
        return [np.stack([residual(point) for point in np.reshape(x, (len(point), -1)).T], axis=1)], None, None

    found, result = ms.optimize(parameters, columns, optimizer="mujoco", verbose=False)
    x = found.as_vector()
    _, half = ms.calculate_intervals([residual(x)], np.asarray(result.jac))
    return x[:PARAMETERS], half[:PARAMETERS], True


def jax_sysid(case):
    """`jax_sysid.Model` with the robot as its state function, Adam and L-BFGS as its documentation has it."""
    period, sigma, scale = case["period"], jnp.array(case["sigma"]), jnp.array(np.abs(case["start"]) + 1e-3)
    first = first_start(case["pose"], period)

    def step(x, u, params):
        parameters = params[0] * scale
        rate, gain, zone = parameters[:2], parameters[2:6].reshape(2, 2), jnp.abs(parameters[6:8])
        steady = gain @ passed(u, zone, jnp) / rate
        away = x[3:] - steady
        dx = dy = 0.0
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            left = jnp.exp(-rate * period * node)
            v = steady[0] + away[0] * left[0]
            direction = x[2] + steady[1] * period * node + away[1] * (1 - left[1]) / rate[1]
            dx, dy = dx + weight * period * v * jnp.cos(direction), dy + weight * period * v * jnp.sin(direction)
        keep = jnp.exp(-rate * period)
        turn = steady[1] * period + away[1] * (1 - keep[1]) / rate[1]
        return jnp.concatenate([x[:3] + jnp.array([dx, dy, turn]), steady + away * keep])

    model = Model(STATES, 3, 2, state_fcn=step, output_fcn=lambda x, u, params: x[:3] / sigma)
    model.init(params=[case["start"] / np.asarray(scale)], x0=first)
    model.loss(rho_x0=0.0, rho_th=0.0)
    model.optimization(adam_epochs=500, lbfgs_epochs=2000, iprint=-1)
    model.fit(case["pose"] / case["sigma"], case["u"])
    found = np.asarray(model.params[0]) * np.asarray(scale)
    found[6:8] = np.abs(found[6:8])
    return found, np.full(PARAMETERS, np.nan), bool(np.all(np.isfinite(found)))


def padasip_rls(case):
    """`padasip.filters.FilterRLS` on the difference equations, the true dead zones given; rates and gains from its pole
    and the sum of its numerators."""
    pose, period = case["pose"], case["period"]
    middle = 0.5 * (pose[1:, 2] + pose[:-1, 2])
    step = np.diff(pose, axis=0)
    signals = np.column_stack([step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle), step[:, 2]])
    m = passed(case["u"], case["truth"][6:8], np)
    rate, gain = np.zeros(2), np.zeros((2, 2))
    for k in range(2):
        columns = np.column_stack([signals[:-1, k], m[1 : len(signals)], m[: len(signals) - 1]])
        size = np.sqrt(np.mean(columns**2, axis=0))
        rls = padasip.filters.FilterRLS(5, mu=1.0, eps=1e-6, w="zeros")
        rls.run(signals[1:, k], columns / size)
        pole, *numerators = rls.w / size
        pole = np.clip(pole, 1e-6, 1 - 1e-9)
        rate[k] = -np.log(pole) / period
        gain[k] = (np.array(numerators[:2]) + numerators[2:]) / (1 - pole) * rate[k] / period
    found = np.concatenate([rate, gain.ravel(), case["truth"][6:8]])
    return found, np.full(PARAMETERS, np.nan), bool(np.all(np.isfinite(found)))


METHODS = {
    "scipy least_squares": scipy_least_squares,
    "mujoco.sysid": mujoco_sysid,
    "jax-sysid": jax_sysid,
    "padasip RLS": padasip_rls,
}


def main() -> None:
    """Every tool on every record; what fails is kept as not ok."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    data, rows = np.load(options.data), []
    for name in options.methods:
        for number in range(len(data["u"])):
            case = {key: data[key][number] for key in ("u", "pose", "start", "truth", "sigma")}
            case["period"] = float(data["period"])
            begin = time.perf_counter()
            try:
                found, half, ok = METHODS[name](case)
            except (ValueError, FloatingPointError, np.linalg.LinAlgError) as error:
                print(f"{name}, record {number}: {error}", flush=True)
                found, half, ok = np.full(PARAMETERS, np.nan), np.full(PARAMETERS, np.nan), False
            rows.append((name, number, found, half, ok, time.perf_counter() - begin))
        print(name, "done", flush=True)
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    np.savez(options.out, **dict(zip(KEPT, columns, strict=True)))


if __name__ == "__main__":
    main()
