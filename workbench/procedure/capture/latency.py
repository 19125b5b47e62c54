"""How many frames of a camera's stream are older than what was just switched."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np

from workbench.calibration.data.spot_rows import prior_scanline
from workbench.devices.protocols import LaserBank, StreamingCamera, settable
from workbench.model.arrays import Image
from workbench.model.errors import RigNotReadyError
from workbench.model.rig import Rig
from workbench.spots import Spot, find_spots

LEASE_S = 2.0
"""Longest time that a laser may stay lit for one capture: many frames, and short for an eye."""
PHASES = (0.0, 0.5, 0.95)
"""When a trial switches, in frames after one has come. A camera that runs freely has begun the next by then:
the later, the less of it is lit. Captures are switched whenever it is their turn."""
WHOLE = 0.9
"""Least share of the next frame's light in one that was not begun before the switch."""
NOISE_SD = 3.0
"""By so much noise may a whole frame seem to have less."""
STEP = 16.0
"""Between two exposures: from too dim to be found to clipped is more than that."""


def count_latency(lasers: LaserBank, camera: StreamingCamera, rig: Rig, most_frames: int) -> int:
    """Frames from switching the first laser on to the first that was lit throughout; the most of some trials.

    Nothing that hangs on the latency is used: it is counted at the exposure that the camera has, and where
    that shows no spot at others, far apart, if they may be set. Before each trial more frames pass in the
    dark than can be late.

    Raises:
        RigNotReadyError: none of `most_frames` frames shows it, at no exposure.
    """
    lasers.all_off()
    first = rig.lasers[0]
    # The first search in a process takes a second: a laser lit meanwhile would be put off as forgotten.
    some = camera.grab().image
    find_spots(some, some, scanlines=[prior_scanline(rig, first)], expected=1)
    for _ in _exposures(camera):
        if (frames := _count(lasers, camera, rig, most_frames, PHASES[0])) is not None:
            later = [_count(lasers, camera, rig, most_frames, phase) for phase in PHASES[1:]]
            return max([frames, *(more for more in later if more is not None)])
    raise RigNotReadyError(
        f"camera: expected to see laser {first.id} at most {most_frames} frames after it was switched on, saw"
        " no spot; look whether it shines on the target, and into the picture"
    )


def _exposures(camera: StreamingCamera) -> Iterator[None]:
    """Set one after the other: as it is, then from the middle of the limits out to them."""
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
    scanlines = [prior_scanline(rig, first)]
    # Drops what has piled up; then whatever a laser lit before this call passes.
    camera.grab()
    for _ in range(most_frames + 1):
        camera.read()
    # A lamp that flickers is no brighter later than in the brightest of them.
    began = time.monotonic()
    dark: Image = np.maximum.reduce([camera.read().image for _ in range(most_frames + 1)])
    time.sleep(phase * (time.monotonic() - began) / (most_frames + 1))
    before: Spot | None = None
    with lasers.lit([first.id], for_s=LEASE_S):
        for frames in range(most_frames + 2):
            spots = find_spots(camera.read().image, dark, scanlines=scanlines, expected=1).spots
            if before and spots:
                counted = frames - 1 if _is_whole(before, spots[0]) else frames
                return counted if counted <= most_frames else None
            before = spots[0] if spots else None
    return None


def _is_whole(spot: Spot, later: Spot) -> bool:
    """Whether the frame of `spot` has no less of its light than the next one, as far as noise lets one tell.

    Where both are clipped, neither's light is known.
    """
    if "saturated" in spot.flags & later.flags:
        return True
    # With shot noise alone the relative deviation of the light is that of the place, in widths.
    noise = math.hypot(*(it.flux_dn * it.u_sd_px / it.width_px for it in (spot, later)))
    return spot.flux_dn >= WHOLE * later.flux_dn - NOISE_SD * noise
