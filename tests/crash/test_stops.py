"""Sessions that end early without a kill: a disk that is full, a stop between shots; and how they go on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.crash.short import CALLER, PROCEDURE, begin, go_on, results, story, write_files
from tests.support.killed_session import wait_for_capture
from workbench.model import event as ev
from workbench.model.errors import StoppedError
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.run import run
from workbench.session.journal import read_journal
from workbench.session.state import session_status

SCRIPT = Path(sys.executable).with_name("workbench")
CAPTURES_ONLY = PROCEDURE[: PROCEDURE.index("  - step: fit")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    write_files(folder, CAPTURES_ONLY)
    begin(folder, folder / "s")
    return folder / "s"


def assert_goes_on(session: Path, whole: Path) -> None:
    go_on(session)
    assert story(session) == story(whole)
    assert results(session) == results(whole)


@pytest.mark.parametrize(
    ("n", "room"),
    [
        *((0, 0), (3, 40), (7, 0), (12, 40)),
        *(pytest.param(*case, marks=pytest.mark.thorough) for case in ((0, 40), (3, 0), (7, 40), (12, 0))),
    ],
)
def test_a_journal_that_finds_no_room(
    tmp_path: Path, whole: Path, monkeypatch: pytest.MonkeyPatch, n: int, room: int
) -> None:
    """The disk takes `room` bytes of record `n`, then nothing; it has room again when the session goes on."""
    real, written = os.write, [0]

    def write(handle: int, data: bytes) -> int:
        if not data.startswith(b'{"n":'):
            return real(handle, data)
        written[0] += 1
        if written[0] <= n:
            return real(handle, data)
        if room:
            real(handle, data[:room])
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("workbench.session.journal.os.write", write)
        with pytest.raises(StoppedError, match="No space left"):
            begin(whole.parent, tmp_path / "s")
    assert len(list(read_journal(tmp_path / "s"))) == n
    assert (tmp_path / "s/journal.jsonl").read_bytes().count(b"\n") == n
    assert session_status(tmp_path / "s").unfinished
    assert_goes_on(tmp_path / "s", whole)


def test_frames_that_find_no_room(tmp_path: Path, whole: Path) -> None:
    """The kernel refuses files beyond a size: the first frame cannot be written whole."""
    frame = min(p.stat().st_size for p in (whole / "frames").rglob("*.png"))

    blocks = frame // 2 // 512
    command = [str(SCRIPT), "run", str(whole.parent / "p.yaml"), "--rig", str(whole.parent / "rig.yaml")]
    limited = ["sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh", *command, "--sessions", str(tmp_path)]
    done = subprocess.run(limited, capture_output=True, text=True)
    assert done.returncode == 5, done.stderr
    assert "cannot be written" in " ".join(done.stderr.split())
    assert "workbench resume" in done.stderr
    (session,) = [p for p in tmp_path.iterdir() if p.is_dir()]
    assert not list((session / "frames").rglob("*.png")), "half a frame is no frame"
    assert session_status(session).state == "stopped"
    go_on(session)
    assert results(session) == results(whole)


@pytest.mark.parametrize("shots", [0, 1, 3])
def test_a_stop_between_shots_is_resumed(tmp_path: Path, whole: Path, shots: int) -> None:
    taken: list[ev.Record] = []

    def count(record: ev.Record) -> None:
        if isinstance(record.event, ev.CaptureTaken):
            taken.append(record)

    plan = Plan.load(whole.parent / "rig.yaml", [whole.parent / "p.yaml"])
    with pytest.raises(StoppedError, match="enough"):
        run(plan, tmp_path / "s", [count], CALLER, lambda: "enough" if len(taken) >= shots else None)
    assert len(taken) == shots, "the shot under way is finished, no other begins"
    assert_goes_on(tmp_path / "s", whole)


def test_from_the_command_line(tmp_path: Path) -> None:
    """Stopped by a signal, listed, resumed without naming it, listed again."""
    write_files(tmp_path, CAPTURES_ONLY.replace("repeats: 1", "repeats: 20"))
    process = subprocess.Popen(
        [SCRIPT, "run", "p.yaml", "--rig", "rig.yaml"], cwd=tmp_path, stderr=subprocess.PIPE
    )
    sessions = tmp_path / "sessions"
    wait_for_capture(sessions, "short.2/600mm", process)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 5
    assert "stopped" in listed(tmp_path)
    done = subprocess.run([SCRIPT, "resume"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "resumed" in done.stderr
    assert "finished" in listed(tmp_path)
    again = subprocess.run([SCRIPT, "resume"], cwd=tmp_path, capture_output=True, text=True)
    assert again.returncode == 2
    assert "no unfinished session" in again.stderr
    (session,) = [p for p in sessions.iterdir() if p.is_dir()]
    first = [r.event for r in read_journal(session) if isinstance(r.event, ev.CaptureTaken)]
    assert sum(e.placement_key.endswith("/300mm") for e in first) == 40, "what is whole is not taken again"


def listed(folder: Path) -> str:
    done = subprocess.run([SCRIPT, "sessions"], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout
