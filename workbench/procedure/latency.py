"""How many frames of a camera's stream are older than what was just switched."""

from __future__ import annotations

from workbench.calibration.sightings import prior_scanline
from workbench.devices.protocols import LaserBank, StreamingCamera
from workbench.model.errors import RigNotReadyError
from workbench.model.rig import Rig
from workbench.spots import find_spots

LEASE_S = 2.0
"""Longest time that a laser may stay lit for one capture: many frames, and short for an eye."""


def count_latency(lasers: LaserBank, camera: StreamingCamera, rig: Rig, most_frames: int) -> int:
    """Frames from switching the first laser on to the first frame that shows it.

    Raises:
        RigNotReadyError: none of `most_frames` frames shows it.
    """
    lasers.all_off()
    first = rig.lasers[0]
    scanlines = [prior_scanline(rig, first)]
    # The first search in a process takes a second: a laser lit meanwhile would be put off as forgotten.
    some = camera.grab().image
    find_spots(some, some, scanlines=scanlines, expected=1)
    # Drops what has piled up, then longer than the latency: whatever a laser lit before this call has passed.
    camera.grab()
    dark = [camera.read() for _ in range(most_frames + 1)][-1].image
    with lasers.lit([first.id], for_s=LEASE_S):
        for frames in range(most_frames + 1):
            if find_spots(camera.read().image, dark, scanlines=scanlines, expected=1).spots:
                return frames
    raise RigNotReadyError(
        f"camera: expected to see laser {first.id} at most {most_frames} frames after it was switched on, saw"
        " no spot; look whether it shines on the target, and into the picture"
    )
