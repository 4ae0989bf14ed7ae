"""How fast the pipeline is on this machine: its stages alone, whole trials, and the start values."""

import dataclasses
import statistics
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import AT_REST, Array, Pose, Wheels
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.initialise import Setup, initialise
from jaxident.estimation.increments.observations import Observations, complete_observations, observe_log, tail
from jaxident.estimation.poses.maximum_likelihood import Fit, fit_runs
from jaxident.estimation.poses.runs import Runs
from jaxident.log import Log, make_log
from jaxident.numerics import require_float64
from jaxident.origin import versions
from jaxident.parallel import card_memory, in_parallel, trials_at_once
from jaxident.robot.drive import Physical
from jaxident.robot.excitation import multilevel
from jaxident.robot.model import Model, difference_vector, require_physical
from jaxident.robot.noise import Noise, draw_noise, observe
from jaxident.robot.path_length import path_length
from jaxident.robot.simulate import run_physical

SAMPLES, TRIAL_SAMPLES, SETUP_ROWS, FIT_SAMPLES, D_MAX = 2000, 1000, 200, 1000, 0.9
CAMERA = Noise(1e-5, 1e-4)
REPEATS, FIT_REPEATS, STEPS = 7, 3, 1000


class Sizes(NamedTuple):
    """Trials of the stages and of a block of them, whole trials of a block, fits and those of a block."""

    trials: int
    block: int
    trial_block: int
    fits: int
    fit_block: int


ON_CPU = Sizes(1024, 512, 125, 64, 16)
"""Blocks of a CPU: enough trials to pay for the start of each kernel, few enough to stay in the cache. The search for
start values takes fewer of them at once by itself."""

ROW_BYTES, TRIAL_BYTES, FIT_BYTES = 1e3, 5e6, 1e7
"""What a graphics card is given for a row of the stages, a whole trial and a fit; a trial took 0.3 MB on an H200."""

LARGEST = 1 << 16
"""Trials of a block on a graphics card at most: more of them are no faster each."""

C_NS = {"simulate_ns": 2.5, "path_length_ns": 2.1, "rls_ns": 6.2}
"""Nanoseconds per trial-sample of the same stages in C written by hand, one trial per SIMD lane, on two cores of an AMD
EPYC with AVX-512 (`experiments/speed.md`), recorded for comparison."""

STAGES = ("simulate_ns", "path_length_ns", "rls_ns", "noise_ns")


def device_sizes() -> Sizes:
    """Those of this process's devices: what fits a CPU's cache, or a card's memory."""
    if card_memory() is None:
        return ON_CPU
    block = min(LARGEST, trials_at_once(ON_CPU.block, ROW_BYTES * SAMPLES))
    trials = min(LARGEST, trials_at_once(ON_CPU.trial_block, TRIAL_BYTES))
    fits = min(LARGEST, trials_at_once(ON_CPU.fit_block, FIT_BYTES))
    return Sizes(block, block, trials, fits, fits)


class Bench(NamedTuple):
    """Nanoseconds per trial-sample of each stage (2000 samples, double precision), whole trials per second (1000
    samples each, noise drawn, start values searched), milliseconds per search for start values, each the median of
    REPEATS; microseconds that one robot waits for `recursive.step` on one row of plain numbers, the call included;
    milliseconds per maximum-likelihood fit in a batch of runs of 1000 samples of a robot without coupling, the median
    of FIT_REPEATS; seconds that the whole trial took to compile; devices and versions; trials: the sizes of all these
    batches, larger on a graphics card than on a CPU."""

    simulate_ns: float
    path_length_ns: float
    rls_ns: float
    noise_ns: float
    trials_per_s: float
    initialise_ms: float
    step_us: float
    maximum_likelihood_ms: float
    compile_s: float
    trials: dict[str, int]
    devices: list[str]
    versions: dict[str, str]


def stages(robot: Model, key: Array, sizes: Sizes) -> dict[str, float]:
    """Nanoseconds per trial-sample of the simulation, the path length, both recursions and the noise draws."""
    period = jnp.asarray(robot.sample_period)
    keys = [(block,) for block in jax.random.split(key, (sizes.trials // sizes.block, sizes.block))]
    commands = in_parallel(jax.jit(jax.vmap(lambda k: multilevel(k, SAMPLES), out_axes=-1)), keys)

    run = jax.jit(lambda command: run_physical(robot, command, period, AT_REST).pose)
    poses, simulate_s = _time(run, [(command,) for command in commands])
    increments, path_s = _time(path_length, [(pose,) for pose in poses])
    observations = [complete_observations(*pair) for pair in zip(commands, increments, strict=True)]
    first = jax.jit(jax.vmap(lambda setup: _at(robot, setup), in_axes=-1, out_axes=-1))
    starts = [first(jax.tree.map(lambda column: column[:SETUP_ROWS], o)) for o in observations]
    _, rls_s = _time(jax.jit(recursive.run_to_end), list(zip(starts, observations, strict=True)))
    _, noise_s = _time(jax.jit(jax.vmap(lambda k: draw_noise(k, SAMPLES))), keys)
    seconds = {"simulate_ns": simulate_s, "path_length_ns": path_s, "rls_ns": rls_s, "noise_ns": noise_s}
    return {name: 1e9 * second / (sizes.trials * SAMPLES) for name, second in seconds.items()}


def _at(robot: Model, setup: Observations) -> recursive.Estimate:
    """The estimate that the recursion starts from: the robot's own parameters."""
    return recursive.start(robot.difference, jnp.asarray(robot.dead_zone), setup, D_MAX, 1.0)


def trial(robot: Model, key: Array, samples: int = TRIAL_SAMPLES) -> tuple[Array, Array]:
    """One whole trial of `samples` rows: own excitation, simulation, camera noise, start values, recursion. Estimate
    (12,), and ok."""
    key_input, key_noise = jax.random.split(key)
    period = jnp.asarray(robot.sample_period)
    command = multilevel(key_input, samples)
    pose = run_physical(robot, command, period, AT_REST).pose
    pose = observe(pose, CAMERA, draw_noise(key_noise, samples), period)
    setup = start_values(command, pose, period)
    observations = complete_observations(command, path_length(pose))
    early = jax.tree.map(lambda column: column[: SETUP_ROWS - 2], observations)
    first = recursive.start(setup.difference, setup.dead_zone, early, D_MAX, 1.0)
    last = recursive.run_to_end(first, tail(observations, SETUP_ROWS - 2))
    return difference_vector(*recursive.parameters(last)), setup.ok


def start_values(command: Wheels, pose: Pose, period: Array) -> Setup:
    """Start values from the first SETUP_ROWS rows of a trial."""
    rows = jnp.arange(SETUP_ROWS)
    early = jax.tree.map(lambda column: column[:SETUP_ROWS], (*command, *pose))
    u_r, u_l, x, y, theta = early
    log = Log(rows * period, u_r, u_l, x, y, theta, jnp.zeros_like(rows))
    return initialise(observe_log(log), d_max=D_MAX)


def whole_trials(robot: Model, key: Array, count: int, block: int) -> tuple[float, float]:
    """Whole trials per second, and the seconds to compile them."""
    keys = [(block,) for block in jax.random.split(key, (count // block, block))]
    program = jax.jit(jax.vmap(lambda k: trial(robot, k)))
    begin = time.perf_counter()
    compiled = program.lower(*keys[0]).compile()
    compile_s = time.perf_counter() - begin
    return count / _time(compiled, keys)[1], compile_s


def noisy_runs(robot: Model, key: Array, samples: int, count: int, block: int) -> list[tuple[Wheels, Pose]]:
    """Blocks of noisy runs (block, samples), `count` in all, each under commands of its own."""
    period = jnp.asarray(robot.sample_period)

    def one(key: Array) -> tuple[Wheels, Pose]:
        key_input, key_noise = jax.random.split(key)
        command = multilevel(key_input, samples)
        pose = run_physical(robot, command, period, AT_REST).pose
        return command, observe(pose, CAMERA, draw_noise(key_noise, samples), period)

    keys = jax.random.split(key, (count // block, block))
    return in_parallel(jax.jit(jax.vmap(one)), [(row,) for row in keys])


def start_value_ms(robot: Model, key: Array, count: int, block: int) -> float:
    """Milliseconds that the search for start values takes per trial in a batch of `count`."""
    period = jnp.asarray(robot.sample_period)
    blocks = noisy_runs(robot, key, SETUP_ROWS, count, block)
    search = jax.jit(jax.vmap(lambda command, pose: start_values(command, pose, period)))
    return 1e3 * _time(search, blocks)[1] / count


def step_us(robot: Model, key: Array) -> float:
    """Microseconds per jitted `recursive.step`, one after the other as rows come from a camera."""
    [(command, pose)] = noisy_runs(robot, key, SETUP_ROWS + 1, 1, 1)
    columns = [column[0] for column in (*command, *pose)]
    log = make_log(jnp.arange(SETUP_ROWS + 1) * robot.sample_period, *columns)
    state = recursive.init(log.rows(0, SETUP_ROWS), d_max=D_MAX)
    sample = recursive.Sample(*(float(column[-1]) for column in columns))
    step = jax.jit(recursive.step)

    def take_rows() -> recursive.State:
        after = state
        for _ in range(STEPS):
            after, _info = step(after, sample)
        return after

    return 1e6 * _time(take_rows, [()])[1] / STEPS


def maximum_likelihood_ms(robot: Model, key: Array, count: int, block: int) -> float:
    """Milliseconds that a maximum-likelihood fit takes per run in a batch of `count` runs of FIT_SAMPLES samples.

    The runs are those of the robot without its coupling, which the fit leaves out as well: a model that does not fit
    takes two to five times as many steps.
    """
    period = jnp.asarray(robot.sample_period)
    robot = dataclasses.replace(robot, dynamics=Physical(*require_physical(robot)[:2]))

    def fit(command: Wheels, pose: Pose) -> Fit:
        command, pose = jax.tree.map(lambda column: column[None], (command, pose))
        return fit_runs(Runs(period, command, pose, jnp.ones((1, FIT_SAMPLES), bool)), jnp.asarray(D_MAX))

    blocks = noisy_runs(robot, key, FIT_SAMPLES, count, block)
    return 1e3 * _time(jax.jit(jax.vmap(fit)), blocks, FIT_REPEATS)[1] / count


def bench(robot: Model, *, trials: int = 1000, seed: int = 0, sizes: Sizes | None = None) -> Bench:
    """All figures; `trials` whole trials, rounded up to whole blocks; `sizes`: those of the device unless said. Needs
    double precision."""
    require_float64("bench")
    sizes = sizes or device_sizes()
    trials = -(-trials // sizes.trial_block) * sizes.trial_block
    keys = jax.random.split(jax.random.key(seed), 4)
    per_second, compile_s = whole_trials(robot, keys[1], trials, sizes.trial_block)
    return Bench(
        **stages(robot, keys[0], sizes),
        trials_per_s=per_second,
        initialise_ms=start_value_ms(robot, keys[2], trials, sizes.trial_block),
        step_us=step_us(robot, keys[2]),
        maximum_likelihood_ms=maximum_likelihood_ms(robot, keys[3], sizes.fits, sizes.fit_block),
        compile_s=compile_s,
        trials={"stages": sizes.trials, "whole": trials, "fits": sizes.fits},
        devices=[str(device) for device in jax.devices()],
        versions=versions(),
    )


def parts(figures: Bench) -> dict[str, float]:
    """What every stage takes of a whole trial, as fractions; `rest` is what none of them is: commands, camera, copies,
    and that a stage alone runs in blocks that suit it."""
    whole = 1.0 / figures.trials_per_s
    found = {name: 1e-9 * getattr(figures, name) * TRIAL_SAMPLES / whole for name in STAGES}
    found["initialise_ms"] = 1e-3 * figures.initialise_ms / whole
    return found | {"rest": 1.0 - sum(found.values())}


def _time(
    function: Callable[..., Any], blocks: list[tuple[Any, ...]], repeats: int | None = None
) -> tuple[list[Any], float]:
    """The results on all blocks, and the median of some times [s], REPEATS unless said, after a first call."""
    results = in_parallel(function, blocks)
    seconds = []
    for _ in range(repeats or REPEATS):
        begin = time.perf_counter()
        in_parallel(function, blocks)
        seconds.append(time.perf_counter() - begin)
    return results, statistics.median(seconds)
