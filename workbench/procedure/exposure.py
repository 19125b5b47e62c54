"""The exposure at which the brightest spot is bright and not clipped, found with a few trial pairs.

A pixel's number is its pedestal plus what it is lit with times the exposure, until it is clipped. Scaling
the exposure by (aim / number) therefore closes in on the aim: the pedestal alone, some hundredths of full
scale, is scaled wrongly, and the next trial sees how much that was. Of a clipped pixel nothing else is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from workbench.devices.protocols import Bench, ExposableCamera, Image
from workbench.model.event import ExposureSet
from workbench.model.rig import Rig
from workbench.procedure.latency import LEASE_S

AIM = 0.65
"""Of full scale."""
GOOD = (0.55, 0.7)
"""A quarter of the range and more is left for what differs from frame to frame."""
DIM = 0.25
"""Of full scale; below it a person is told."""
BOLDEST = 8.0
"""Largest factor from one trial to the next."""
MOST_TRIALS = 8
"""Four go from the middle of a range of 1 : 10^7 to its ends; as many are left to close in."""


def set_exposure(
    bench: Bench, rig: Rig, placement_key: str, begin: Callable[[str], None]
) -> ExposureSet | None:
    """Set the camera's exposure for all lasers of the rig on the target as it stands.

    They are lit together: no laser by itself is brighter, and one pair of frames tells. The first trial is
    always the same, so that what is found at a placement does not depend on where the target was before.

    Args:
        bench: its camera and lasers.
        rig: tells which lasers, and the camera's full scale.
        placement_key: of the placement.
        begin: called with the key of each trial before it.

    Returns:
        What was set; None where the camera's exposure is not to be set.

    Raises:
        LaserOffNotConfirmedError: a beam stays on.
        RigNotReadyError: a device does not answer.
    """
    if (settable := _settable(bench)) is None:
        return None
    camera, limits = settable
    full_scale = 2**rig.camera.bits - 1

    def peak_at(exposure: float, trial: int) -> tuple[float, float]:
        begin(f"{placement_key}/exposure/{trial:02d}")
        taken = camera.set_exposure(exposure)
        with bench.lasers.lit(rig.laser_ids, for_s=LEASE_S):
            on = camera.grab().image
        return taken, brightest_lit_dn(on, camera.grab().image) / full_scale

    tried = search_exposure(limits, peak_at)
    exposure, peak = best_of(tried)
    if exposure != tried[-1][0]:
        exposure = camera.set_exposure(exposure)
    return ExposureSet(
        key=placement_key,
        exposure=exposure,
        unit=camera.exposure_unit,
        peak=peak,
        verdict="clipped" if peak >= 1 else "dim" if peak < DIM else "good",
        trials=len(tried),
    )


def restore_exposure(bench: Bench, known: ExposureSet) -> None:
    """Set it as it was found before the session ended early.

    Raises:
        RigNotReadyError: the camera does not take it.
    """
    if (settable := _settable(bench)) is not None:
        settable[0].set_exposure(known.exposure)


def _settable(bench: Bench) -> tuple[ExposableCamera, tuple[float, float]] | None:
    camera = bench.camera
    if not isinstance(camera, ExposableCamera) or camera.exposure_limits is None:
        return None
    return camera, camera.exposure_limits


def search_exposure(
    limits: tuple[float, float], peak_at: Callable[[float, int], tuple[float, float]]
) -> list[tuple[float, float]]:
    """Try exposures until one is good, or the next would be one that was tried.

    Args:
        limits: shortest and longest exposure.
        peak_at: makes the trial of that number at an exposure; returns the exposure as the camera took it,
            and the brightest pixel as a share of full scale.

    Returns:
        (exposure as taken, share) of every trial.
    """
    asked: list[float] = []
    tried: list[tuple[float, float]] = []
    following = _within(limits, math.sqrt(limits[0] * limits[1]))
    while following not in asked and len(tried) < MOST_TRIALS:
        asked.append(following)
        taken, peak = peak_at(following, len(tried))
        tried.append((taken, peak))
        if GOOD[0] <= peak <= GOOD[1]:
            break
        factor = 1 / BOLDEST if peak >= 1 else AIM / max(peak, AIM / BOLDEST)
        following = _within(limits, taken * factor)
    return tried


def _within(limits: tuple[float, float], exposure: float) -> float:
    """Three digits are finer than any aim, and can be read."""
    return min(max(float(f"{exposure:.3g}"), limits[0]), limits[1])


def best_of(tried: list[tuple[float, float]]) -> tuple[float, float]:
    """The longest exposure that was not too bright; where all were, the shortest."""
    sound = [trial for trial in tried if trial[1] <= GOOD[1]]
    return max(sound) if sound else min(tried)


def brightest_lit_dn(on: Image, off: Image) -> int:
    """Number in `on` of the pixel that the lasers light most: a lamp or a hot pixel is in both frames."""
    lit = on.astype(np.int32) - off
    return int(on.flat[int(lit.argmax())])
