"""Chunks as tasks of a local Dask cluster; without Dask these are skipped."""

import os
import signal

import numpy as np
import pytest
from support.studies import SMALL

from jaxident.errors import InputError
from jaxident.study.cluster import connected, run_on
from jaxident.study.dataset import study_arrays

pytest.importorskip("distributed")


def test_what_is_no_scheduler_is_refused():
    for text in ("local", "local:0", "local:x", "nothing"):
        with pytest.raises(InputError, match="--scheduler"), connected(text):
            pass


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_worker_that_is_killed_is_survived():
    """Killed with the first chunk in hand; the chunks are those of one process, bit by bit."""
    study = SMALL._replace(seeds=200)
    whole = study_arrays(study)["estimate"].values
    found = np.full_like(whole, np.nan)
    with connected("local:2") as client:
        from jaxident.study.engine import chunks

        cut = chunks(study)
        for count, (number, outcome) in enumerate(run_on(client, study, range(len(cut)))):
            if count == 0:
                os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
            found[cut[number].cut] = outcome.estimate
    np.testing.assert_array_equal(found, whole)
