"""Calibration with four faults, for the viewer.

A placement 9 mm off, a target turned by 6 deg, a laser whose spot is saturated, and a reflection beside a
spot.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np

from tests.crash.short import CALLER, ROOT
from workbench.devices.protocols import Frame
from workbench.emulator.camera import EmulatedCamera, Exposure
from workbench.model import event as ev
from workbench.model.errors import WorkbenchError
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.run import run
from workbench.session.journal import read_journal
from workbench.viewer.recording import RecordingConsumer

MOVED, TURNED, SATURATED, REFLECTED = 600, 280, 900, 400
"""Standoffs of the faults, mm."""
SATURATED_LASER, REFLECTED_LASER = "L2", "L3"
TOO_BRIGHT = 6.0
REFLECTION_PX = np.array([14.0, 3.0])
"""From the spot to its reflection."""
RIG = f"""
emulator:
  seed: 2001
  truth:
    placements:
      faults.1/{MOVED}mm: {{error_mm: 9.0}}
      faults.1/{TURNED}mm: {{yaw_deg: 6.0}}
"""
PROCEDURE = """\
format: 1
procedure: faults
title: Calibrate on a flat target
steps:
  - step: capture_grid
    standoffs_mm: [125, 160, 210, 280, 400, 600, 900, 1400, 2200, 3200, 4500]
    repeats: 3
  - step: fit
"""


def write_session(folder: Path) -> Path:
    """Run the session, record it, and return its folder. Its fit is refused."""
    rig = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    rig = rig[: rig.index("\nemulator:")] + RIG
    (folder / "rig.yaml").write_text(rig)
    (folder / "faults.yaml").write_text(PROCEDURE)
    plan = Plan.load(folder / "rig.yaml", [folder / "faults.yaml"])
    session = folder / "faults"
    with faulty_camera():
        try:
            run(plan, session, [], CALLER, lambda: None)
        except WorkbenchError as error:
            print(error)
    with RecordingConsumer(session, plan.rig) as consumer:
        for record in read_journal(session):
            consumer(record)
    return session


@contextmanager
def faulty_camera() -> Iterator[None]:
    """The bench's camera, with one laser's spot too bright at a placement, and one with a reflection."""
    develop, expose = EmulatedCamera._develop, EmulatedCamera._expose

    def brighter(camera: EmulatedCamera, lit: tuple[str, ...]) -> Exposure:
        exposure = expose(camera, lit)
        too_bright = f"/{SATURATED}mm/{SATURATED_LASER}/" in exposure.key and exposure.lit
        return replace(exposure, exposure_s=TOO_BRIGHT * exposure.exposure_s) if too_bright else exposure

    def reflected(camera: EmulatedCamera, exposure: Exposure) -> Frame:
        frame = develop(camera, exposure)
        if f"/{REFLECTED}mm/{REFLECTED_LASER}/" not in exposure.key or not exposure.lit:
            return frame
        image = frame.image.astype(np.float64)
        dark = np.median(image)
        image += 0.6 * np.roll(np.clip(image - dark - 20, 0, None), REFLECTION_PX.astype(int)[::-1], (0, 1))
        return replace(frame, image=np.clip(image, 0, 255).astype(np.uint8))

    with (
        mock.patch.object(EmulatedCamera, "_develop", reflected),
        mock.patch.object(EmulatedCamera, "_expose", brighter),
    ):
        yield


def capture_numbers(session: Path) -> dict[str, int]:
    """Number of a capture of each fault, as the viewer counts them."""
    wanted = {
        "moved": f"/{MOVED}mm/L4/02",
        "turned": f"/{TURNED}mm/L4/02",
        "saturated": f"/{SATURATED}mm/{SATURATED_LASER}/00",
        "reflection": f"/{REFLECTED}mm/{REFLECTED_LASER}/00",
    }
    events = (record.event for record in read_journal(session))
    keys = [event.key for event in events if isinstance(event, ev.CaptureTaken)]
    return {
        name: 1 + next(n for n, key in enumerate(keys) if key.endswith(end)) for name, end in wanted.items()
    }
