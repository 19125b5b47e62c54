"""Dask clusters: worker processes of this computer, or a scheduler that runs already."""

from __future__ import annotations

import logging
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any, TypeVar

from workbench.campaign.identity import ENVIRONMENT
from workbench.model.errors import BadInputError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

Started = TypeVar("Started")
LOOPBACK = "127.0.0.1"
MOST_DEATHS = 10
"""Number of workers that one chunk may take with it before it is given up: then the chunk is the cause."""
WATCHED_S = 2.0
"""Time between two looks for dead workers."""
CONNECT_S = 10.0
"""Longest wait for a scheduler."""


@contextmanager
def local_client(workers: int) -> Iterator[Client]:
    """Client of worker processes of this computer, one thread each; no socket beyond the loopback device.

    Connections are encrypted with a key of this run: tasks are pickled, and another user of this computer
    must not be able to send one.

    Raises:
        BadInputError: the extra `campaign` is not installed.
    """
    _require_distributed()
    import dask
    from distributed import Client, Security

    settings = {
        "distributed.scheduler.allowed-failures": MOST_DEATHS,
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
        "distributed.admin.tick.limit": "1h",  # a compilation holds the interpreter for seconds
        # Dask's value of 64 KiB returns the memory of every array to the kernel, and so ends the growth of
        # glibc's thresholds: the page faults take as long as the work itself.
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
    }
    with (
        dask.config.set(settings),
        tempfile.TemporaryDirectory(prefix="workbench-campaign-") as scratch,
        _local_cluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host=LOOPBACK,
            dashboard_address=f"{LOOPBACK}:0",
            security=Security.temporary(),
            env=ENVIRONMENT,
            memory_limit=0,
            local_directory=scratch,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        _dead_workers_replaced(cluster, workers),
        Client(cluster) as client,
    ):
        yield client


@contextmanager
def _local_cluster(**arguments: Any) -> Iterator[LocalCluster]:
    """Start a cluster, and close it at the end.

    Workers that do not end in Dask's time on a busy computer are no error: all chunks are on the disk, and
    the processes end with this one.
    """
    from distributed import LocalCluster

    cluster = _without_interrupts(LocalCluster, **arguments)
    try:
        yield cluster
    finally:
        with suppress(TimeoutError):
            cluster.close()


@contextmanager
def remote_client(address: str) -> Iterator[Client]:
    """Client of a scheduler that runs already.

    Raises:
        BadInputError: it does not answer, or the extra `campaign` is not installed.
    """
    _require_distributed()
    from distributed import Client

    try:
        client = Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise BadInputError(
            f"--scheduler {address}: expected a Dask scheduler, such as tcp://192.168.0.10:8786, got no"
            f" answer ({error})"
        ) from None
    with client:
        yield client


@contextmanager
def _dead_workers_replaced(cluster: LocalCluster, workers: int) -> Iterator[None]:
    """Replace workers that Dask gives up: those whose process dies while it starts."""
    from distributed.core import Status

    ended = threading.Event()

    def replace() -> None:
        if cluster.status != Status.running:  # it is being closed
            return
        for name, nanny in list(cluster.workers.items()):
            if nanny.status in {Status.closed, Status.failed}:
                del cluster.workers[name]
        cluster.scale(workers)

    def watch() -> None:
        while not ended.wait(WATCHED_S):
            if cluster.loop is not None:  # it has ended
                cluster.loop.add_callback(replace)

    thread = threading.Thread(target=watch, name="watch of workers", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _without_interrupts(start: Callable[..., Started], **arguments: Any) -> Started:
    """Start threads and processes that Ctrl-C does not reach: it stops this process, which ends them.

    They inherit the mask of the thread that starts them; so do workers that replace dead ones.
    """
    resource_tracker.ensure_running()  # at its start it would clear the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return start(**arguments)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _require_distributed() -> None:
    for package in ("cryptography", "distributed"):
        if find_spec(package) is None:
            raise BadInputError(
                f"workbench campaign: expected the package {package}, it is not installed. Do: pip install"
                " 'laser-range-workbench[campaign]'"
            )
