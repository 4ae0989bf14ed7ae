"""How much faster is a graphics card than a processor, and does it find the same?

    JAX_PLATFORMS=cpu python -m experiments.gpu measure --out cpu.json
    python -m experiments.gpu measure --out gpu.json
    python -m experiments.gpu compare cpu.json gpu.json

`measure` writes after every part, so that what is cut off keeps what it has:

* bench: the figures of `jaxident bench`, and the memory that a whole trial takes on the device.
* single: the stages in single precision, and how far their results are from double precision.
* study: trials of `million.toml`, as many as there is time for, and the estimates of the first ones.
* simulator: the full simulator with three effects, many runs at once.
* diagnosis: six runs of 1000 rows of a robot that loses speed in turns, the first call and the second.

`compare` prints a table, and the largest departure of estimates that both have found.
"""

import argparse
import json
import pathlib
import time
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import jaxident as ji
from experiments.growth import record
from jaxident.array_types import AT_REST, Array
from jaxident.effects.apply import sized
from jaxident.effects.catalogue import CATALOGUE, to_vector
from jaxident.effects.full import run_full, substeps_for
from jaxident.estimation.increments import recursive
from jaxident.estimation.increments.observations import complete_observations
from jaxident.files.studies import read_study
from jaxident.parallel import trials_at_once
from jaxident.robot.excitation import multilevel
from jaxident.robot.model import difference_vector
from jaxident.robot.path_length import path_length
from jaxident.robot.simulate import run_physical
from jaxident.study import bench
from jaxident.study.engine import block_size, chunks, run_chunk

ROBOT = ji.load_model("published")
COMPARED = 64
"""Trials in which single precision is compared with double."""
KEPT = 1000
"""Trials of the study whose estimates are kept for `compare`."""
ROWS, RUN_BYTES = 1000, 4e6
"""Rows of a run of the full simulator, and the memory that one takes on a card."""
ACTING = ("quadratic_drag", "slope", "turn_loss")


def figures(_: float) -> dict[str, Any]:
    """`jaxident bench`, and the bytes of a whole trial and of a fit in a small batch."""
    trial = jax.jit(jax.vmap(lambda key: bench.trial(ROBOT, key)))
    needs = trial.lower(jax.random.split(jax.random.key(0), 1024)).compile().memory_analysis()
    found = bench.bench(ROBOT)
    return found._asdict() | {"parts": bench.parts(found), "trial_bytes": needs.temp_size_in_bytes / 1024}


def single(_: float) -> dict[str, Any]:
    """The stages in single precision; departures of paths and estimates from double precision, relative to their size:
    root mean square, and for estimates the median over trials of the largest of twelve."""
    keys = jax.random.split(jax.random.key(1), COMPARED)
    command = jax.tree.map(np.asarray, jax.jit(jax.vmap(lambda key: multilevel(key, bench.SAMPLES), out_axes=-1))(keys))
    results = {}
    try:
        for double in (True, False):  # for all threads: a block of code has its own switch in the thread that enters it
            jax.config.update("jax_enable_x64", double)
            results[double] = jax.tree.map(np.asarray, jax.jit(stages_of)(jax.tree.map(jnp.asarray, command)))
        speed = bench.stages(ROBOT, jax.random.key(0), bench.device_sizes())
    finally:
        jax.config.update("jax_enable_x64", True)
    (exact, estimate), (rough, other) = results[True], results[False]
    paths = [np.sqrt(np.mean((a - b) ** 2) / np.mean(a**2)) for a, b in zip(exact, rough, strict=True)]
    off = np.median(np.max(np.abs(other / estimate - 1.0), axis=0))
    return speed | {"increments": paths, "estimates": off}


def stages_of(command: Any) -> tuple[Any, Array]:
    """Path increments of commands (samples, trials), and the estimates (12, trials) from them, without noise."""
    pose = run_physical(ROBOT, command, jnp.asarray(ROBOT.sample_period), AT_REST).pose
    increments = path_length(pose)
    seen = complete_observations(command, increments)
    early = jax.tree.map(lambda column: column[: bench.SETUP_ROWS], seen)
    zone = jnp.asarray(ROBOT.dead_zone, command.right.dtype)

    def start(setup: Any) -> Any:
        return recursive.start(ROBOT.difference, zone, setup, bench.D_MAX, 1.0)

    begin = jax.vmap(start, in_axes=-1, out_axes=-1)(early)
    last = recursive.run_to_end(begin, seen)
    return increments, jax.vmap(lambda e: difference_vector(*recursive.parameters(e)), in_axes=-1, out_axes=-1)(last)


def study(seconds: float) -> dict[str, Any]:
    """Chunks of a million trials, until the time is used up."""
    file = pathlib.Path(__file__).with_name("million.toml")
    whole = read_study(file)._replace(chunk=50_000)
    todo, begin = iter(chunks(whole)), time.perf_counter()
    first = run_chunk(whole, next(todo))
    compiled, done = time.perf_counter(), 0
    for piece in todo:
        done += run_chunk(whole, piece).reason[..., 0].size
        if time.perf_counter() - compiled > seconds:
            break
    rate = done / (time.perf_counter() - compiled)
    kept = first.estimate.reshape(-1, 12)[:KEPT].tolist()
    return {"trials_per_s": rate, "trials": done, "first_s": compiled - begin, "block": block_size(whole), "kept": kept}


def simulator(_: float) -> dict[str, Any]:
    """Nanoseconds per row and run of the full simulator."""
    effects, count = frozenset(ACTING), min(1 << 14, trials_at_once(64, RUN_BYTES))
    vector = jnp.asarray(to_vector(tuple(ji.Effect(name, sized(CATALOGUE[name], 1.0)) for name in ACTING)))
    t = ROBOT.sample_period * jnp.arange(ROWS)

    def run(key: Array) -> Any:
        command = multilevel(key, ROWS)
        return run_full(ROBOT.dynamics, jnp.asarray(ROBOT.dead_zone), vector, t, command, AT_REST, key=key,
                        substeps=substeps_for(effects), parts=effects)  # fmt: skip

    keys = jax.random.split(jax.random.key(2), count)
    begin = time.perf_counter()
    program = jax.jit(jax.vmap(run)).lower(keys).compile()
    compiled = time.perf_counter() - begin
    seconds = bench._time(program, [(keys,)], 3)[1]
    return {"ns": 1e9 * seconds / (count * ROWS), "runs": count, "compile_s": compiled}


def diagnosis(_: float) -> dict[str, Any]:
    """Seconds of a diagnosis, first call and second, and what it says."""
    logs, seconds = record(6, 1000), []
    for _call in range(2):
        begin = time.perf_counter()
        found = ji.diagnose(logs)
        seconds.append(time.perf_counter() - begin)
    return {"first_s": seconds[0], "second_s": seconds[1], "verdict": found.verdict, "named": list(found.selected)}


PARTS: dict[str, Callable[[float], dict[str, Any]]] = {
    "bench": figures, "single": single, "study": study, "simulator": simulator, "diagnosis": diagnosis,
}  # fmt: skip


def measure(options: argparse.Namespace) -> None:
    """One part after the other; each is written when it is done, and an error in one is told and stops no other."""
    told: dict[str, Any] = {"device": str(jax.devices()[0].device_kind), "backend": jax.default_backend()}
    for name in options.parts or PARTS:
        begin = time.perf_counter()
        try:
            told[name] = PARTS[name](options.seconds)
        except Exception as error:  # the next part is wanted all the same
            told[name] = {"error": f"{type(error).__name__}: {error}"[:400]}
        told[name]["seconds"] = time.perf_counter() - begin
        print(name, json.dumps({k: v for k, v in told[name].items() if k != "kept"}, default=float), flush=True)
        options.out.write_text(json.dumps(told, default=float))


def rows(cpu: dict[str, Any], gpu: dict[str, Any]) -> Iterator[tuple[str, float, float, float]]:
    """Name, figure of either, and how many times faster the second is."""
    for path, slower in FIGURES.items():
        one, other = (walk(found, path) for found in (cpu, gpu))
        if one is not None and other is not None:
            yield path, one, other, one / other if slower else other / one


FIGURES = {
    **{f"bench.{name}": True for name in (*bench.STAGES, "initialise_ms", "step_us", "maximum_likelihood_ms")},
    "bench.trials_per_s": False, "bench.compile_s": True,
    **{f"single.{name}": True for name in bench.STAGES},
    "study.trials_per_s": False, "study.first_s": True,
    "simulator.ns": True,
    "diagnosis.first_s": True, "diagnosis.second_s": True,
}  # fmt: skip
"""Figures of the table; True where less is better."""


def walk(found: dict[str, Any], path: str) -> Any:
    """The entry at a path of names with dots between; None where there is none."""
    place: Any = found
    for name in path.split("."):
        place = place.get(name) if isinstance(place, dict) else None
    return place


def compare(options: argparse.Namespace) -> None:
    """The table, and how far the estimates of the same trials are apart."""
    cpu, gpu = (json.loads(path.read_text()) for path in (options.cpu, options.gpu))
    print(f"| figure | {cpu['device']} | {gpu['device']} | times faster |\n|---|---|---|---|")
    for name, one, other, ratio in rows(cpu, gpu):
        print(f"| {name} | {one:.4g} | {other:.4g} | {ratio:.3g} |")
    kept = [np.array(found["study"]["kept"]) for found in (cpu, gpu)]
    off = np.abs(kept[1] / kept[0] - 1.0)
    print(f"estimates of {len(off)} trials: median {np.nanmedian(off):.1e}, 99 % {np.nanquantile(off, 0.99):.1e}, "
          f"largest {np.nanmax(off):.1e}")  # fmt: skip


def main() -> None:
    """Measure, or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    which = parser.add_subparsers(required=True)
    one = which.add_parser("measure")
    one.add_argument("--out", type=pathlib.Path, required=True)
    one.add_argument("--seconds", type=float, default=30.0, help="of the study, once compiled")
    one.add_argument("--parts", nargs="*", choices=list(PARTS))
    one.set_defaults(call=measure)
    two = which.add_parser("compare")
    two.add_argument("cpu", type=pathlib.Path)
    two.add_argument("gpu", type=pathlib.Path)
    two.set_defaults(call=compare)
    options = parser.parse_args()
    options.call(options)


if __name__ == "__main__":
    ji.start_jax()
    main()
