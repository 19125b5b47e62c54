"""Connections to clusters, as far as no worker is needed."""

from __future__ import annotations

import signal
import sys
import threading

import pytest

from workbench.campaign.cluster import _local_cluster, _without_interrupts, local_client, remote_client
from workbench.model.errors import BadInputError


@pytest.mark.parametrize("package", ["distributed", "cryptography"])
def test_without_the_extra_its_installation_is_named(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with (
        pytest.raises(
            BadInputError, match=rf"package {package}.*pip install 'laser-range-workbench\[campaign"
        ),
        local_client(1),
    ):
        pass


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.campaign.cluster.CONNECT_S", 0.2)
    with (
        pytest.raises(BadInputError, match=r"--scheduler tcp://127\.0\.0\.1:9: expected a Dask scheduler"),
        remote_client("tcp://127.0.0.1:9"),
    ):
        pass


def test_threads_that_start_workers_do_not_get_interrupts() -> None:
    masks: list[set[int]] = []

    def start() -> None:
        thread = threading.Thread(
            target=lambda: masks.append({*signal.pthread_sigmask(signal.SIG_BLOCK, ())})
        )
        thread.start()
        thread.join()

    _without_interrupts(start)
    start()
    assert [signal.SIGINT in mask for mask in masks] == [True, False]


def test_workers_that_do_not_end_in_time_are_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[bool] = []

    class Busy:
        def close(self) -> None:
            closed.append(True)
            raise TimeoutError

    monkeypatch.setattr("distributed.LocalCluster", Busy)
    with _local_cluster():
        assert not closed
    assert closed
