"""A module of drivers of another package: lasers, a camera and a target, none of which the workbench knows.

The line is on when it is opened, writes each change to a log with its time, fails as the file `<log>.fault`
says (the calls that fail; `exit-<call>`: by SystemExit; `numpy`: state in numpy's types), and has no leases.
The camera shows a spot for each laser that the log says is on.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.support.driver_package import put_on_path, write_driver

MODULE = "lab_drivers"
ENTRY_POINTS = {
    "workbench.lasers": {
        "lab_lasers": f"{MODULE}:Line",
        "lab_broken": f"{MODULE}:Missing",
        "lab_unloadable": f"{MODULE}_unloadable:Line",
    },
    "workbench.cameras": {"lab_camera": f"{MODULE}:Camera"},
    "workbench.targets": {"lab_rail": f"{MODULE}:Rail"},
}
SOURCE = """
import time
from pathlib import Path
from workbench.model.device_block import DeviceBlock


class LineBlock(DeviceBlock):
    log: str


class Line:
    settings_type = LineBlock
    has_leases = False

    def __init__(self, settings, lasers, alarm):
        print("a library that greets on standard output", flush=True)
        self._log = Path(settings.log)
        self._mask = (1 << lasers) - 1
        self._fail("open")
        self._write(self._mask)  # left on

    def identify(self, boot_s):
        self._fail("identify")
        return "lab lasers"

    def light(self, mask, lease_ms):
        print("chatter", flush=True)
        self._fail("light")
        self._write(mask)

    def all_off(self):
        self._fail("off")
        self._write(0)

    def state(self):
        self._fail("state")
        if self._fault() == "numpy":
            import numpy as np
            return np.uint8(self._mask), np.bool_(True)
        return self._mask, True

    def _write(self, mask):
        self._mask = mask
        with self._log.open("a") as file:
            file.write(f"{time.monotonic_ns()} {mask}\\n")

    def _fault(self):
        fault = Path(f"{self._log}.fault")
        return fault.read_text() if fault.exists() else ""

    def _fail(self, what):
        if what in self._fault().split():
            raise ZeroDivisionError(f"a defect of the driver in {what}")
        if f"exit-{what}" in self._fault().split():
            raise SystemExit(0)


class CameraBlock(DeviceBlock):
    log: str
    brightness: float = 180.0


class Camera:
    settings_type = CameraBlock

    @classmethod
    def open(cls, settings, rig, beat):
        return cls(settings, rig, beat)

    def __init__(self, settings, rig, beat):
        self._settings, self._rig, self._beat = settings, rig, beat

    def grab(self):
        import numpy as np
        from workbench.devices.protocols import Frame
        self._beat()
        mask = int(Path(self._settings.log).read_text().split()[-1])
        image = np.full((self._rig.camera.height_px, self._rig.camera.width_px), 12, np.uint8)
        for line in range(8):
            if mask >> line & 1:
                image[100, 40 + 40 * line] = self._settings.brightness
        return Frame(image, time.time_ns())

    grab_ambient = grab

    def close(self):
        pass


class RailBlock(DeviceBlock):
    steps_per_mm: float


class Rail:
    settings_type = RailBlock

    @classmethod
    def open(cls, settings, rig):
        return cls()

    def place(self, placement):
        return placement.model_copy(update={"standoff_mm": placement.standoff_mm + 0.25})
"""


def install_drivers(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install them for this process and those that it starts."""
    write_driver(folder, MODULE, SOURCE, ENTRY_POINTS)
    (folder / f"{MODULE}_unloadable.py").write_text("import ctypes\nctypes.CDLL('libno_such_vendor.so')\n")
    put_on_path(folder, monkeypatch)


def write_rig(path: Path, devices: Sequence[str], driver: str | None = None) -> Path:
    """A rig file of two lasers with these lines in its block `devices`; none: without the block."""
    head = ["format: 1", "rig: lab", *([f"driver: {driver}"] if driver else [])]
    block = ["devices:", *(f"  {line}" for line in devices)] if devices else []
    camera = """\
camera:
  width_px: 320
  height_px: 240
  f_px: {value: 270.0, sd: 10.0}
  cx_px: {value: 159.5, sd: 20.0}
  cy_px: {value: 119.5, sd: 20.0}
lasers:
  - {id: L1, axis: u, x_mm: {value: -60.0, sd: 0.2}, y_mm: {value: 0.0, sd: 0.2}}
  - {id: L2, axis: u, x_mm: {value: 60.0, sd: 0.2}, y_mm: {value: 0.0, sd: 0.2}}
"""
    path.write_text("\n".join([*head, *block, camera]))
    return path
