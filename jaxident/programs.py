"""Programs that are traced once per machine, as code is compiled once: what `start_jax` keeps in the cache folder.

JAX keeps compiled code between processes, but each process traces a function and lowers it before it can look for that
code. For a fit under slip this takes 3 s, and the fit itself 0.6 s. A kept program is written as StableHLO
(`jax.export`) by the first process, and read by all later ones.
"""

import contextlib
import functools
import hashlib
import inspect
import os
import pathlib
import tempfile
from collections.abc import Callable
from typing import Any

import jax
import jax.export
import jaxlib

FEW = 64
"""Blocks in all, such as windows of rows, up to which `roomy` keeps two binary digits of a count, so that few programs
serve all short logs; beyond it keeps four, for there a program runs longer than it compiles. Three runs of 600 to 720
rows take `identify` 35 s and `diagnose` 20 s on two cores if they need new programs, 3 and 9 s if they find them. No
other numbers were tried."""
DIGEST = hashlib.sha256().digest_size
_named: set[type] = set()


def kept_program(*tuples: type, static: tuple[str, ...] = ()) -> Callable[[Callable], Callable]:
    """Like `jax.jit` with some `static` arguments, for a function that users wait for; a decorator.

    tuples: every NamedTuple that its arguments and results hold, for a file names them; one that is left out raises
    ValueError at the first call. Within another traced function, without a cache folder, and where the program calls
    what may change with the version of JAX, it is plain `jax.jit`.
    """
    for one in tuples:
        if one not in _named:
            _named.add(one)
            jax.export.register_namedtuple_serialization(one, serialized_name=f"{one.__module__}.{one.__qualname__}")

    def wrap(function: Callable) -> Callable:
        compiled, signature = jax.jit(function, static_argnames=static), inspect.signature(function)
        programs: dict[tuple, Callable] = {}

        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            own = {}
            if static:
                kwargs = signature.bind(*args, **kwargs).arguments
                own, args = {name: kwargs.pop(name) for name in static if name in kwargs}, ()
            leaves, tree = jax.tree.flatten((args, kwargs))
            folder = jax.config.jax_compilation_cache_dir  # type: ignore[attr-defined]
            if not folder or any(isinstance(leaf, jax.core.Tracer) for leaf in leaves):
                return compiled(*args, **kwargs, **own)
            key = folder, tuple(own.items()), tree, tuple(map(_shape, leaves))
            program = programs.get(key)
            if program is None:
                name = f"{function.__module__}.{function.__qualname__}"
                path = pathlib.Path(folder) / f"program-{_digest(name, *map(str, key)).hex()}"
                program = programs[key] = _program(functools.partial(compiled, **own), args, kwargs, path)
            return program(*args, **kwargs)

        call._cache_size = lambda: len(programs) + compiled._cache_size()  # type: ignore[attr-defined]
        return call

    return wrap


def roomy(count: int, whole: int | None = None) -> int:
    """The count that a program is compiled for where `count` are needed, one side of a rectangle of `whole` in all.

    1, 2, 3, 4, 6, 8, 12, ..., by which at most half is added; where `whole` is beyond FEW at most an eighth.
    """
    grain = 1 << max(count.bit_length() - (2 if (whole or count) <= FEW else 4), 0)
    return -(-count // grain) * grain


def _shape(leaf: Any) -> tuple:
    try:
        return leaf.shape, leaf.dtype
    except AttributeError:  # a number
        return jax.numpy.shape(leaf), jax.numpy.result_type(leaf)


def _program(function: Callable, args: tuple, kwargs: dict[str, Any], path: pathlib.Path) -> Callable:
    """The program of a function at some arguments: from a file, or kept in it where that is possible.

    It is compiled for shapes, not for the arguments themselves. For these, JAX compiles again where one was an array of
    NumPy and the next is one of JAX, or the other way: two programs of `identify`, 4 of 29 s of a first call.
    """
    traced = _read(path)
    if traced is None:
        program = jax.jit(function)
        try:
            traced = jax.export.export(program)(*args, **kwargs)
        except ValueError:  # it calls a library in a way that may change
            return program
        _write(path, bytes(traced.serialize()))
    args, kwargs = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(*_shape(leaf)), (args, kwargs))
    return jax.jit(traced.call).lower(*args, **kwargs).compile()


def _read(path: pathlib.Path) -> jax.export.Exported | None:
    """What a file keeps of a program, or None where there is none or it is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    if hashlib.sha256(data[DIGEST:]).digest() != data[:DIGEST]:
        return None
    return jax.export.deserialize(bytearray(data[DIGEST:]))


def _write(path: pathlib.Path, data: bytes) -> None:
    """Write a file as a whole or not at all; a folder that takes nothing more is no reason to stop."""
    with contextlib.suppress(OSError):
        number, name = tempfile.mkstemp(dir=path.parent)
        try:
            with os.fdopen(number, "wb") as file:
                file.write(hashlib.sha256(data).digest() + data)
            os.replace(name, path)
        except OSError:
            os.unlink(name)


def _digest(*parts: str) -> bytes:
    """What tells programs apart: function, arguments, device, versions, and the source of the package."""
    device = f"{jax.default_backend()} {jax.config.jax_enable_x64}"  # type: ignore[attr-defined]
    return hashlib.sha256(repr((*parts, device, jax.__version__, jaxlib.__version__, _source())).encode()).digest()


@functools.cache
def _source() -> list[tuple[str, int, int]]:
    """Name, size and time of every file of the package's source."""
    files = sorted(pathlib.Path(__file__).parent.rglob("*.py"))
    return [(str(file), file.stat().st_size, file.stat().st_mtime_ns) for file in files]
