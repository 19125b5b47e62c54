"""Automatic exposure, gain or white balance: the background darkens while a laser is on."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np

from workbench.calibration.data.spot_rows import prior_scanline
from workbench.devices.protocols import LaserBank, StreamingCamera
from workbench.model.arrays import BoolArray
from workbench.model.rig import Rig
from workbench.procedure.capture.latency import LEASE_S

PAIRS = 4
SETTLING_FRAMES = 6
"""Frames that pass after each switching, beyond those that are stale: automatic controls act over several."""
SIGNIFICANT_SD = 5.0
"""Least mean change of the background in standard errors over the pairs."""
LEAST_CHANGE_DN = 1.0
LEAST_SHARE = 0.01
"""Least relative darkening that matters: smaller ones are compensated with the ambient light."""


def darkening(lasers: LaserBank, camera: StreamingCamera, rig: Rig) -> float | None:
    """Relative darkening of the background while the first laser is on; None where there is none.

    A sensor with fixed settings adds the light of the laser, and a lamp flickers in both directions. Only a
    camera that adjusts itself to the spot darkens the rest of the image, each time.

    Raises:
        RigNotReadyError: a device does not answer.
    """
    backgrounds = [[_background(lasers, camera, rig, on) for on in (False, True)] for _ in range(PAIRS)]
    off, on = np.array(backgrounds).T
    change = off - on
    error = max(float(change.std(ddof=1)), 1e-3) / PAIRS**0.5
    mean = float(change.mean())
    if mean < LEAST_CHANGE_DN or mean < SIGNIFICANT_SD * error or mean < LEAST_SHARE * float(off.mean()):
        return None
    return mean / float(off.mean())


def _background(lasers: LaserBank, camera: StreamingCamera, rig: Rig, on: bool) -> float:
    """Mean of a frame outside the band of the first laser, DN."""
    first = rig.lasers[0]
    with lasers.lit([first.id], for_s=LEASE_S) if on else nullcontext():
        for _ in range(SETTLING_FRAMES):
            camera.read()
        image = camera.grab().image
    return float(image[_outside(rig, image.shape)].mean())


def _outside(rig: Rig, shape: tuple[int, ...]) -> BoolArray:
    """(height, width) whether a pixel is outside the band of the first laser, or everywhere if none is."""
    line = prior_scanline(rig, rig.lasers[0])
    v, u = np.indices(shape)
    length = float(np.hypot(line.du, line.dv))
    outside = np.abs((u - line.u0_px) * line.dv - (v - line.v0_px) * line.du) > line.half_width_px * length
    return np.asarray(outside if outside.any() else ~outside)
