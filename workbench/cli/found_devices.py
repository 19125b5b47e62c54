"""Cameras and serial ports that are connected to this computer."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

DEVICES = Path("/dev")
VIDEO_CLASS = Path("/sys/class/video4linux")
"""Folder with one folder for each V4L2 device, which contains its name and index."""


@dataclass(frozen=True)
class FoundDevice:
    """Device with the name that it reports."""

    path: str
    name: str


def found_cameras() -> list[FoundDevice]:
    """V4L2 devices that deliver frames, in the order of their numbers.

    A camera has further devices for its metadata; those have an index above 0.
    """
    found = []
    for device in sorted(DEVICES.glob("video[0-9]*"), key=lambda path: (len(path.name), path.name)):
        described = VIDEO_CLASS / device.name
        if _content(described / "index") in ("", "0"):
            found.append(FoundDevice(str(device), _content(described / "name") or "camera"))
    return found


def found_ports() -> list[FoundDevice]:
    """Serial ports of USB devices, those of known boards by their stable names."""
    from serial.tools.list_ports import comports

    return [
        FoundDevice(_stable_path(port.device), port.description or "serial port")
        for port in sorted(comports())
        if port.vid is not None
    ]


def _content(path: Path) -> str:
    with suppress(OSError):
        return path.read_text(encoding="utf-8", errors="replace").strip()
    return ""


def _stable_path(device: str) -> str:
    """Path in /dev/serial/by-id of a port, which stays when other boards are connected; else its own."""
    with suppress(OSError):
        for link in sorted((DEVICES / "serial/by-id").iterdir()):
            if str(link.resolve()) == str(Path(device).resolve()):
                return str(link)
    return device
