"""Chunks as tasks of a local Dask cluster; without Dask these are skipped."""

import gc
import http.client
import os
import signal
import urllib.request

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


def test_a_client_that_nobody_answers_is_gone_at_once():
    """Collected later, while another client starts, it would wait for a lock that this one holds, and the other way."""
    from distributed import Client

    gc.disable()
    try:
        with pytest.raises(InputError, match="nobody answers"), connected("nothing"):
            pass
        assert not [one for one in gc.get_objects() if isinstance(one, Client)]
    finally:
        gc.enable()


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


@pytest.mark.filterwarnings("ignore")
def test_everything_listens_on_the_loopback_and_shows_no_page():
    """The scheduler's and the workers' web servers too, which Dask opens to the network by itself."""
    psutil = pytest.importorskip("psutil")
    with connected("local:1"):
        own = psutil.Process()
        processes = [own, *own.children(recursive=True)]
        sockets = [one.laddr for process in processes for one in process.net_connections() if one.status == "LISTEN"]
        assert len(sockets) >= 4
        assert {ip for ip, _ in sockets} == {"127.0.0.1"}
        assert all(port != 8787 for _, port in sockets)
        for ip, port in sockets:
            try:
                urllib.request.urlopen(f"http://{ip}:{port}/health", timeout=5)
            except (OSError, http.client.HTTPException):
                continue
            pytest.fail(f"port {port} shows a page")
