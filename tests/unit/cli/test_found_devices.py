"""Cameras and serial ports of a computer."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from workbench.cli import found_devices
from workbench.cli.found_devices import FoundDevice, found_cameras, found_ports


@pytest.fixture
def computer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setattr(found_devices, "DEVICES", tmp_path)
    monkeypatch.setattr(found_devices, "VIDEO_CLASS", tmp_path / "class")
    return tmp_path


def add_camera(computer: Path, number: int, name: str, index: int) -> None:
    (computer / f"video{number}").touch()
    described = computer / f"class/video{number}"
    described.mkdir(parents=True)
    (described / "name").write_text(f"{name}\n")
    (described / "index").write_text(f"{index}\n")


def test_cameras_are_listed_by_number_without_their_metadata(computer: Path) -> None:
    for number, name, index in ((10, "Other", 0), (2, "Grey", 0), (3, "Grey", 1)):
        add_camera(computer, number, name, index)
    (computer / "video1").touch()  # one about which the kernel states nothing
    assert found_cameras() == [
        FoundDevice(str(computer / "video1"), "camera"),
        FoundDevice(str(computer / "video2"), "Grey"),
        FoundDevice(str(computer / "video10"), "Other"),
    ]


def test_no_camera(computer: Path) -> None:
    assert found_cameras() == []


class Port(SimpleNamespace):
    def __lt__(self, other: Port) -> bool:
        return bool(self.device < other.device)


def test_ports_of_boards_have_their_stable_names(computer: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ports = [
        Port(device=str(computer / "ttyACM1"), description="Other", vid=1),
        Port(device=str(computer / "ttyACM0"), description="Uno", vid=0x2341),
        Port(device=str(computer / "ttyS0"), description="n/a", vid=None),
    ]
    for port in ports:
        Path(port.device).touch()
    stable = computer / "serial/by-id/usb-Arduino_Uno"
    stable.parent.mkdir(parents=True)
    stable.symlink_to("../../ttyACM0")
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: ports)
    assert found_ports() == [FoundDevice(str(stable), "Uno"), FoundDevice(ports[0].device, "Other")]
