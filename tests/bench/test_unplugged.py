"""Camera or controller unplugged in the middle of a session: firmware on a pty, a camera on the network.

The session ends with the name of what is missing, its journal can be read, and it goes on once the part is
plugged in again. A new plug is a new device: the rig file names a link, as those of udev.
"""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.bench.test_guided_session import Says
from tests.crash.short import CALLER, RESUMER
from tests.firmware.parts import Running, build, hurried
from tests.support.command_line import SCRIPT
from tests.support.mjpeg import Picture, Stream
from tests.support.terminal import AT_TERMINAL, Terminal
from tests.unit.devices.test_real_bench import Scene, write_rig
from tests.unit.procedure.engine.test_check import PROCEDURE
from workbench.model import event as ev
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError, WorkbenchError
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.resume import resume
from workbench.procedure.engine.run import run
from workbench.session.journal import read_journal
from workbench.session.state import effective, placement_captures, session_status

SHOTS = 8


class Room:
    """Controller and camera, which can be unplugged and plugged in again."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.while_lit: Callable[[], None] | None = None
        """Done once, by the camera's own thread, when it sees a laser lit."""
        build("host", folder)
        self._plugs = 0
        self.plug_controller()
        self.stream = Stream(self._picture)

    def plug_controller(self) -> None:
        self._plugs += 1
        self.controller = Running("host", self.folder, self.folder / f"pins{self._plugs}.log")
        link = self.folder / "tty-laser"
        link.unlink(missing_ok=True)
        link.symlink_to(self.controller.port)
        self._scene = Scene(self.controller)

    def unplug_controller(self) -> None:
        self.controller.stop()

    def silence_camera(self) -> None:
        self.stream.goes_on.clear()

    def cut_camera(self) -> None:
        self.stream.unplugged = True

    def plug_camera(self) -> None:
        self.stream.unplugged = False
        self.stream.goes_on.set()

    def _picture(self) -> Picture:
        deed = self.while_lit
        if deed is not None and self.controller.lines():
            self.while_lit = None
            deed()
        return self._scene.picture()

    def close(self) -> None:
        self.stream.close()
        self.controller.stop()


@pytest.fixture
def room(tmp_path: Path) -> Iterator[Room]:
    with hurried():
        room = Room(tmp_path)
        yield room
        room.close()


def files(room: Room) -> Plan:
    rig = write_rig(room.folder, str(room.folder / "tty-laser"), room.stream.url)
    (room.folder / "p.yaml").write_text(PROCEDURE)
    return Plan.load(rig, [room.folder / "p.yaml"])


def begin(room: Room, after: int, deed: Callable[[], None]) -> WorkbenchError:
    """Run; after so many captures comes the deed. How it ended."""
    taken = 0

    def consumer(record: ev.Record) -> None:
        nonlocal taken
        if isinstance(record.event, ev.CaptureTaken):
            taken += 1
            if taken == after:
                deed()

    with pytest.raises(WorkbenchError) as caught:
        run(files(room), room.folder / "s", [consumer], CALLER, lambda: None, Says())
    return caught.value


def goes_on(room: Room, error: WorkbenchError) -> None:
    """What is kept is whole and tells why it ended; resumed, every shot is there."""
    session = room.folder / "s"
    records = list(read_journal(session))
    last = records[-1].event
    assert isinstance(last, ev.SessionFinished)
    assert (last.exit_code, last.message) == (error.exit_code, str(error))
    assert session_status(session).state == "failed"
    whole = [key for key, group in placement_captures(records).items() if group.complete]
    assert whole == ["p.1/300mm"]
    operator = Says()
    resume(session, (), RESUMER, lambda: None, operator)
    assert [p.key for p in operator.asked] == ["safety", "p.1/600mm"], "what is whole is not asked for again"
    assert session_status(session).state == "finished"
    told = [record.event for record in effective(read_journal(session))]
    taken = [e for e in told if isinstance(e, ev.CaptureTaken)]
    spots = [e for e in told if isinstance(e, ev.SpotsFound)]
    assert len({e.key for e in taken}) == SHOTS
    assert all((session / frame.path).exists() for e in taken for frame in (e.on, e.off) if frame)
    assert [len(e.spots) for e in spots] == [1] * SHOTS
    assert room.controller.lines() == 0


@pytest.mark.parametrize("lit", [False, True])
@pytest.mark.parametrize("how", ["silence_camera", "cut_camera"])
def test_the_camera(room: Room, how: str, lit: bool) -> None:
    unplug: Callable[[], None] = getattr(room, how)
    error = begin(room, 5, (lambda: setattr(room, "while_lit", unplug)) if lit else unplug)
    assert isinstance(error, RigNotReadyError)
    assert error.exit_code == 4
    assert "camera http" in str(error)
    assert "check its cable" in str(error)
    assert room.controller.lines() == 0
    room.plug_camera()
    goes_on(room, error)


@pytest.mark.parametrize("lit", [False, True])
def test_the_controller(room: Room, lit: bool) -> None:
    """Nobody can confirm that the lasers are off any more: exit 7, whenever it came."""
    unplug = room.unplug_controller
    error = begin(room, 5, (lambda: setattr(room, "while_lit", unplug)) if lit else unplug)
    assert isinstance(error, LaserOffNotConfirmedError)
    assert error.exit_code == 7
    assert "treat the beams as on" in str(error)
    assert str(room.folder / "tty-laser") in str(error)
    room.plug_controller()
    goes_on(room, error)


def test_at_the_terminal(room: Room) -> None:
    """Said in red, with the way to go on, which is then gone."""
    files(room)
    environment = {k: v for k, v in os.environ.items() if k not in {"CI", "NO_COLOR"}}
    environment |= {"COLUMNS": "80", "TERM": "xterm-256color"}

    slaves: list[int] = []

    def called(*command: str) -> Terminal:
        master, slave = pty.openpty()
        process = subprocess.Popen(
            [sys.executable, "-c", AT_TERMINAL, os.ttyname(slave), str(SCRIPT), *command],
            cwd=room.folder,
            env=environment,
            start_new_session=True,
        )
        slaves.append(slave)
        return Terminal(process, master)

    begun = called("run", "p.yaml", "--rig", "rig.yaml")
    begun.type("yes")
    begun.type("")
    begun.wait_for("Place the target at 600 mm")
    room.while_lit = room.unplug_controller
    begun.type("")
    assert begun.end() == 7, begun.text
    assert "Traceback" not in begun.text
    red = " ".join(begun.text.partition("\x1b[31m")[2].split())
    assert "error: the lasers may be on" in red
    assert "treat the beams as on" in red
    assert "workbench resume" in begun.text
    room.plug_controller()
    resumed = called("resume")
    resumed.type("yes")
    resumed.type("")
    assert resumed.end() == 0, resumed.text
    for handle in (begun.master, resumed.master, *slaves):
        os.close(handle)
