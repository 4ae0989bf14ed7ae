"""A study from start to end: in memory, or into a folder where it can be interrupted and go on."""

import contextlib
import math
import os
import pathlib
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

import xarray

from jaxident.errors import WorkError
from jaxident.files.atomic import Target
from jaxident.files.studies import read_study, study_from_dict
from jaxident.files.trials import finish, missing, open_trials, opened, write_chunk
from jaxident.numerics import require_float64
from jaxident.progress import UNSEEN, counting
from jaxident.study.dataset import study_arrays
from jaxident.study.design import Study, check_study
from jaxident.study.engine import Piece, run_locally


class Told(NamedTuple):
    """Who is told how a sweep goes: begin(trials, done) once, advance(trials) after each chunk, damaged(chunks) where
    some of the store were not as they were written."""

    begin: Callable[[int, int], None]
    advance: Callable[[int], None]
    damaged: Callable[[int], None]


SILENT = Told(lambda trials, done: None, lambda trials: None, lambda count: None)


def sweep(study: Study, folder: Target, *, scheduler: str | None = None, told: Told = SILENT) -> pathlib.Path:
    """Run what is missing of a study in a folder; the path of the finished store.

    scheduler: address of a Dask scheduler, or `local:N`. Stopped at any moment, the same call goes on, and ends with
    the same store. Errors as in `files.trials.opened` and `study.cluster`. Needs double precision.
    """
    require_float64("sweep")
    check_study(study)
    with opened(study, folder) as store:
        todo, damaged = missing(store)
        if damaged:
            told.damaged(len(damaged))
        left = sum(_size(store.pieces[number]) for number in todo)
        told.begin(study.trials, study.trials - left)
        with _runner(scheduler if todo else None) as run:
            for number, outcome in run(study, todo):
                write_chunk(store, number, outcome)
                told.advance(_size(store.pieces[number]))
                left -= _size(store.pieces[number])
        if left:
            raise WorkError(f"{folder}: {left} trials did not come back; the same command goes on with them")
        return finish(store)


def study(
    content: Study | Mapping[str, Any] | str | os.PathLike[str],
    *,
    out: Target | None = None,
    scheduler: str | None = None,
    seed: int = 0,
) -> xarray.Dataset:
    """Run a Monte-Carlo study. `jaxident.summarise` makes statistics of the result. Needs double precision.

    Args:
        content: a `Study` (whose own seed counts), the content of a study file as a dict, or the path of a file.
        out: a folder for the trials, which can be continued after an interruption as with `jaxident sweep`. Without it
            the trials stay in memory.
        scheduler: address of a Dask scheduler, with `out`.
        seed: the number that all random draws follow from.

    Returns:
        xarray.Dataset: every trial, with named axes, units and provenance. From a folder, trials are read when used.

    Raises:
        InputError: one line that names the key at fault.

    Examples:
        >>> import jaxident as ji
        >>> ji.start_jax()
        >>> content = {"seeds": 8, "noise": [1e-5], "robots": [{"model": "published"}], "estimators": ["batch"]}
        >>> trials = ji.study(content)
        >>> trials.sizes["seed"]
        8
    """
    if isinstance(content, str | os.PathLike):
        content = read_study(content, seed=seed)
    elif not isinstance(content, Study):
        content = study_from_dict(dict(content), seed=seed)
    with counting("trials", UNSEEN) as bar:
        if out is None:
            bar.begin(content.trials, 0)
            return study_arrays(content, bar.advance)
        return open_trials(sweep(content, out, scheduler=scheduler, told=SILENT._replace(**bar._asdict())))


@contextlib.contextmanager
def _runner(scheduler: str | None) -> Iterator[Callable[..., Any]]:
    """What computes chunks: this process, or a cluster."""
    if scheduler is None:
        yield run_locally
        return
    from jaxident.study.cluster import connected, run_on

    with connected(scheduler) as client:
        yield partial(run_on, client)


def _size(piece: Piece) -> int:
    return math.prod(piece.shape)
