"""Latency of a camera: number of frames in its stream that are older than the last laser switching."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from functools import partial

import numpy as np

from workbench.calibration.data.spot_rows import prior_scanline
from workbench.devices.protocols import LaserBank, StreamingCamera, settable
from workbench.model.arrays import Image
from workbench.model.errors import RigNotReadyError
from workbench.model.rig import Rig
from workbench.spots import Spot, find_spots

SERIES_LEASE_S = 10.0
"""Longest emission for a series of some twenty frames, s."""
LEASE_S = 2.0
"""Longest emission for one capture: enough for many frames, short for eye safety."""
PHASES = (0.0, 0.5, 0.95)
"""Delays of switching after the last frame, in frame periods. A free-running camera is already exposing the
next frame: the later the switching, the smaller its lit part. Captures switch at any phase."""
WHOLE = 0.9
"""Least light, relative to the next frame, of a frame whose exposure began after the switching."""
NOISE_SD = 3.0
"""Tolerance of that comparison in standard deviations of the noise."""
STEP = 16.0
"""Ratio of consecutive exposures; the range from too dim to clipped is wider."""


def count_latency(lasers: LaserBank, camera: StreamingCamera, rig: Rig, most_frames: int) -> int:
    """Number of frames from switching the first laser on to the first frame lit throughout.

    The result is the largest of several trials at different phases. The method does not depend on a known
    latency: it uses the present exposure and, if that shows no spot, others that are far apart. Before each
    trial more frames pass in the dark than can be late.

    Raises:
        RigNotReadyError: none of `most_frames` frames shows the laser at any exposure.
    """
    lasers.all_off()
    first = rig.lasers[0]
    _load_search(rig, camera.grab().image)
    for _ in _exposures(camera):
        if (frames := _count(lasers, camera, rig, most_frames, PHASES[0])) is not None:
            later = [_count(lasers, camera, rig, most_frames, phase) for phase in PHASES[1:]]
            return max([frames, *(more for more in later if more is not None)])
    raise RigNotReadyError(
        f"camera: expected laser {first.id} within {most_frames} frames after switching it on, got no spot;"
        " check that its beam hits the target and that the spot lies in the image"
    )


def _load_search(rig: Rig, dark: Image) -> None:
    """Find a drawn spot, with all lasers off: code of a search is compiled on its first use.

    That takes a second in a process and a minute on a new computer. With a laser on it would end the lease.
    """
    line = prior_scanline(rig, rig.lasers[0])
    height, width = dark.shape
    u, v = np.clip(line.u0_px, 8, width - 9), np.clip(line.v0_px, 8, height - 9)
    rows, columns = np.mgrid[0:height, 0:width]
    full = np.iinfo(dark.dtype).max
    light = full / 2 * np.exp(-((columns - u) ** 2 + (rows - v) ** 2) / (2 * 1.5**2))
    lit: Image = np.minimum(dark + light, full).astype(dark.dtype)
    find_spots(lit, dark, scanlines=[line], expected=1, speckle_sd_px=rig.noise.speckle_sd_px)


def _exposures(camera: StreamingCamera) -> Iterator[None]:
    """Set exposures one after the other: the present one, then from the middle of the limits outwards."""
    yield
    if (found := settable(camera)) is None:
        return
    exposable, (shortest, longest) = found
    middle = math.sqrt(shortest * longest)
    for step in range(math.ceil(math.log(longest / middle, STEP)) + 1):
        for exposure in {min(middle * STEP**step, longest), max(middle / STEP**step, shortest)}:
            exposable.set_exposure(exposure)
            yield


def _count(
    lasers: LaserBank, camera: StreamingCamera, rig: Rig, most_frames: int, phase: float
) -> int | None:
    first = rig.lasers[0]
    find = partial(
        find_spots,
        scanlines=[prior_scanline(rig, first)],
        expected=1,
        speckle_sd_px=rig.noise.speckle_sd_px,
    )
    # Drop buffered frames, then frames that were exposed before this call.
    camera.grab()
    for _ in range(most_frames + 1):
        camera.read()
    # The maximum over several dark frames covers a flickering lamp.
    began = time.monotonic()
    dark: Image = np.maximum.reduce([camera.read().image for _ in range(most_frames + 1)])
    time.sleep(phase * (time.monotonic() - began) / (most_frames + 1))
    before: Spot | None = None
    with lasers.lit([first.id], for_s=SERIES_LEASE_S):
        for frames in range(most_frames + 2):
            spots = find(camera.read().image, dark).spots
            if before and spots:
                counted = frames - 1 if _is_whole(before, spots[0]) else frames
                return counted if counted <= most_frames else None
            before = spots[0] if spots else None
    return None


def _is_whole(spot: Spot, later: Spot) -> bool:
    """Whether the frame of `spot` has as much of its light as the next one, within the noise.

    True if both spots are clipped: then neither's light is known.
    """
    if "saturated" in spot.flags & later.flags:
        return True
    # With shot noise alone, the relative sd of the flux equals the sd of the centre in units of the width.
    noise = math.hypot(*(it.flux_dn * it.u_sd_px / it.width_px for it in (spot, later)))
    return spot.flux_dn >= WHOLE * later.flux_dn - NOISE_SD * noise
