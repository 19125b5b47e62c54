"""Campaigns whose workers and client are killed end with the same results to the bit."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import psutil
import pytest

from tests.crash.campaigns import LONGEST_S, finished, kill_workers, results, start, wait_for, workers
from tests.crash.short import PROCEDURE, write_files
from tests.support.campaigns import SIMULATE, write_campaign
from workbench.campaign.cluster import local_client
from workbench.campaign.identity import ENVIRONMENT

CHUNKS = 24
ALLOCATOR = "MALLOC_TRIM_THRESHOLD_"
"""Variable that Dask sets for workers, which makes them slow."""
SESSIONS_TEXT = """format: 1
campaign: virtual
title: Virtual sessions
work: {kind: sessions, rig: rig.yaml, procedures: [p.yaml], sensors: 4}
"""
NAMES = [f"{item:06d}-short" for item in range(4)]
TEXT = SIMULATE.replace("sensors: 40", f"sensors: {16 * CHUNKS}")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_campaign(tmp_path_factory.mktemp("campaign"), TEXT)


@pytest.fixture(scope="module")
def undisturbed(campaign: Path) -> dict[str, str]:
    """Results of one worker."""
    out = campaign.parent / "undisturbed"
    process = start(campaign, out, "--workers", "1")
    assert (process.communicate()[1], process.returncode)[1] == 0
    return whole_results(out)


def whole_results(out: Path) -> dict[str, str]:
    assert finished(out) == CHUNKS
    return results(out)


thorough = pytest.mark.thorough


@pytest.mark.parametrize(
    ("seed", "kills"), [(1, 1), *(pytest.param(seed, 3, marks=thorough) for seed in (2, 3, 4))]
)
def test_killed_workers_and_a_killed_client_change_no_bit(
    campaign: Path, undisturbed: dict[str, str], tmp_path: Path, seed: int, kills: int
) -> None:
    rng, out = np.random.default_rng(seed), tmp_path / "out"
    process = start(campaign, out, "--workers", "2")
    after = rng.choice(np.arange(1, CHUNKS // 2), kills, replace=False).tolist()
    kill_workers(process, out, after, rng, LONGEST_S)
    wait_for(lambda: finished(out) > CHUNKS // 2, process)
    orphans = workers(process.pid)
    process.kill()
    process.communicate()
    psutil.wait_procs(orphans, timeout=LONGEST_S)
    assert not any(orphan.is_running() for orphan in orphans)
    kept = {path: path.stat().st_mtime_ns for path in out.glob("chunks/*.sha256")}
    assert CHUNKS // 2 < len(kept) <= CHUNKS

    process = start(campaign, out, "--workers", "2")
    errors = process.communicate()[1]
    assert process.returncode == 0, errors
    assert f"{16 * len(kept)} done before" in errors or len(kept) == CHUNKS
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert whole_results(out) == undisturbed


def has_part_of_a_session(out: Path) -> bool:
    return any((out / "sessions").glob(".*/*/frames/*/*"))


@pytest.mark.thorough
def test_a_killed_worker_leaves_no_part_of_a_session(tmp_path: Path) -> None:
    write_files(tmp_path, PROCEDURE)
    campaign, tables = write_campaign(tmp_path, SESSIONS_TEXT), []
    for out, killed in ((tmp_path / "calm", 0), (tmp_path / "killed", 1)):
        process = start(campaign, out, "--workers", "2")
        for victim in range(killed):
            wait_for(partial(has_part_of_a_session, out), process)
            workers(process.pid)[victim].kill()
        errors = process.communicate()[1]
        assert process.returncode == 0, errors
        assert [path.name for path in sorted((out / "sessions").iterdir())] == NAMES
        tables.append(results(out))
    assert tables[0] == tables[1]


@pytest.mark.thorough
def test_a_session_that_does_not_finish_stops_the_campaign(tmp_path: Path) -> None:
    """Its controller does not confirm that the virtual lasers are off."""
    rig, _ = write_files(tmp_path, PROCEDURE)
    rig.write_text(rig.read_text() + "  controller: {fault: ignores_off}\n")
    out = tmp_path / "out"
    process = start(write_campaign(tmp_path, SESSIONS_TEXT), out, "--workers", "1")
    errors = process.communicate()[1]
    assert process.returncode == 5, errors
    assert "error: session 000000-short did not finish, and is no result: " in errors
    assert errors.splitlines()[-1].startswith("resume:  workbench campaign ")
    assert finished(out) == 0
    assert not list((out / "sessions").glob("[0-9]*"))


@pytest.mark.thorough
def test_workers_killed_while_they_start_are_replaced() -> None:
    with local_client(2) as client:
        for wait_s in (0.1, 1.0, 2.0, 0.5):
            for worker in workers():
                worker.kill()
            time.sleep(wait_s)
        client.wait_for_workers(2, timeout=LONGEST_S)
        assert client.submit(sum, [1, 2]).result(timeout=LONGEST_S) == 3
        assert {*client.run(os.getenv, ALLOCATOR).values()} == {os.getenv(ALLOCATOR)}


@pytest.mark.thorough
def test_ctrl_c_ends_cleanly_with_the_command_that_continues(campaign: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = start(campaign, out, "--workers", "1")
    wait_for(lambda: finished(out) >= 1, process)
    sockets = [
        connection.laddr.ip
        for one in [psutil.Process(process.pid), *workers(process.pid)]
        for connection in one.net_connections("inet")
        if connection.status == psutil.CONN_LISTEN
    ]
    assert set(sockets) == {"127.0.0.1"}
    os.killpg(process.pid, signal.SIGINT)
    errors = process.communicate()[1]
    assert process.returncode == 5
    assert "Traceback" not in errors
    assert errors.splitlines()[-2:] == [
        "stopped by Ctrl-C",
        f"resume:  workbench campaign {campaign} -o {out} --workers 1",
    ]


@pytest.mark.thorough
def test_two_programs_share_a_scheduler_and_a_folder_only(
    campaign: Path, undisturbed: dict[str, str], tmp_path: Path
) -> None:
    """A scheduler and two workers as `dask` starts them, each in a folder of its own."""
    bin_folder = Path(sys.executable).parent
    scheduler_file, out = tmp_path / "scheduler.json", tmp_path / "out"

    def dask(name: str, *arguments: str) -> subprocess.Popen[str]:
        (tmp_path / name).mkdir()
        command = [str(bin_folder / "dask"), *arguments, "--scheduler-file", str(scheduler_file)]
        return subprocess.Popen(
            command, cwd=tmp_path / name, env=os.environ | ENVIRONMENT, stderr=subprocess.DEVNULL, text=True
        )

    local = ("--host", "127.0.0.1", "--no-dashboard")
    others = [dask("scheduler", "scheduler", "--port", "0", *local)]
    try:
        wait_for(scheduler_file.exists, others[0])
        others += [dask(f"w{n}", "worker", "--nthreads", "1", *local) for n in (1, 2)]
        address = json.loads(scheduler_file.read_text())["address"]
        process = start(campaign, out, "--scheduler", address)
        errors = process.communicate()[1]
        assert process.returncode == 0, errors
        assert whole_results(out) == undisturbed
    finally:
        for other in reversed(others):
            other.terminate()
            other.wait()
