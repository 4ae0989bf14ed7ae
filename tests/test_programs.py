"""Programs that are kept between processes: the same results, read instead of traced, and made anew when in doubt."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxident import programs
from jaxident.programs import FEW, kept_program, roomy


class Pair(NamedTuple):
    a: Any
    b: Any


class Traces:
    """A function that counts how often it is traced; every `program` of it is what a new process would have."""

    def __init__(self):
        self.count = 0

    def program(self):
        def function(pair, power, offset=1.0):
            self.count += 1
            return Pair(pair.a**power + offset, None if pair.b is None else jnp.linalg.solve(pair.b, pair.a))

        return kept_program(Pair, static=("power",))(function)


@pytest.fixture(autouse=True)
def folder(tmp_path):
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield tmp_path
    jax.config.update("jax_compilation_cache_dir", before)


PAIR = Pair(jnp.array([1.0, 2.0]), jnp.array([[3.0, 1.0], [0.0, 2.0]]))


def test_a_second_process_traces_nothing_and_finds_the_same(folder):
    traces = Traces()
    first, second = (traces.program()(PAIR, power=3) for _ in range(2))
    assert traces.count == 1
    assert len(list(folder.glob("program-*"))) == 1
    assert isinstance(second, Pair)
    for one, other, own in zip(first, second, (PAIR.a**3 + 1.0, jnp.array([0.0, 1.0])), strict=True):
        assert one.tolist() == other.tolist() == own.tolist()


def test_each_shape_type_setting_and_tree_has_its_own(folder):
    traces = Traces()
    program = traces.program()
    program(PAIR, 3)
    program(PAIR, power=3)
    program(Pair(PAIR.a + 1.0, PAIR.b), 3)
    assert (traces.count, program._cache_size()) == (1, 1)
    program(PAIR, 2)
    program(Pair(jnp.ones(3), jnp.eye(3)), 3)
    program(Pair(jnp.ones(2, int), PAIR.b), 3)
    program(Pair(PAIR.a, None), 3)
    assert program(PAIR, 3, 5.0).a.tolist() == [6.0, 13.0]
    assert program._cache_size() == 6
    assert len(list(folder.glob("program-*"))) == 6


def test_arrays_of_numpy_and_of_jax_have_one_compiled_program(caplog):
    program, numpy_pair = Traces().program(), Pair(np.asarray(PAIR.a), np.asarray(PAIR.b))
    with jax.log_compiles():
        results = [program(pair, 3, 1.0) for pair in (PAIR, numpy_pair, program(PAIR, 3, 1.0)._replace(b=PAIR.b))]
    assert results[0].a.tolist() == results[1].a.tolist() == [2.0, 9.0]
    compiled = [record for record in caplog.records if record.message.startswith("Compiling jit(call)")]
    assert len(compiled) == 1


def test_a_damaged_file_is_made_anew(folder):
    traces = Traces()
    whole = traces.program()(PAIR, 3)
    (path,) = folder.glob("program-*")
    data = path.read_bytes()
    for number, damaged in enumerate((data[:-1], data[:20], b"", data[:50] + b"x" + data[51:])):
        path.write_bytes(damaged)
        assert traces.program()(PAIR, 3).a.tolist() == whole.a.tolist()
        traces.program()(PAIR, 3)
        assert traces.count == 2 + number


def test_a_folder_that_takes_nothing_costs_only_time(folder):
    jax.config.update("jax_compilation_cache_dir", str(folder / "missing"))
    traces = Traces()
    assert traces.program()(PAIR, 3).a.tolist() == [2.0, 9.0]
    assert traces.program()(PAIR, 3).a.tolist() == [2.0, 9.0]
    assert traces.count == 2
    jax.config.update("jax_compilation_cache_dir", None)
    assert traces.program()(PAIR, 3).a.tolist() == [2.0, 9.0]


def test_what_cannot_be_put_in_its_place_leaves_nothing_behind(folder):
    (folder / "program").mkdir()
    programs._write(folder / "program", b"data")
    assert [path.name for path in folder.iterdir()] == ["program"]


class Unlisted(NamedTuple):
    a: Any


def test_a_tuple_that_is_not_listed_is_told():
    with pytest.raises(ValueError, match="Unlisted"):
        kept_program(Pair)(lambda pair: Unlisted(pair.a))(PAIR)


def test_within_another_program_it_is_a_plain_function(folder):
    program = Traces().program()
    many = jax.vmap(lambda a: program(Pair(a, None), 3).a)(jnp.arange(6.0).reshape(3, 2))
    slope = jax.grad(lambda a: program(Pair(a, None), 3).a.sum())(PAIR.a)
    assert many.tolist() == (jnp.arange(6.0).reshape(3, 2) ** 3 + 1.0).tolist()
    assert slope.tolist() == [3.0, 12.0]
    assert not list(folder.glob("program-*"))


def test_counts_have_room_for_more():
    few = {0: 0, 1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 7: 8, 9: 12, 13: 16, 24: 24, 25: 32, 64: 64}
    assert {count: roomy(count) for count in few} == few
    for count in range(1, 40 * FEW):
        assert count <= roomy(count) == roomy(roomy(count)) <= (1.5 if count <= FEW else 1.125) * count
        assert count <= roomy(count, 1000 * count) <= 1.125 * max(count, 8)
