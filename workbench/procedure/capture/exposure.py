"""The exposure at which the brightest spot is bright and not clipped, found with a few trials.

A pixel's number is its pedestal plus what it is lit with times the exposure, until it is clipped. Scaling
the exposure by (aim / number) therefore closes in on the aim: the pedestal alone, some hundredths of full
scale, is scaled wrongly, and the next trial sees how much that was. Of a clipped pixel nothing else is known.

Not every pixel is clipped at full scale: where a camera of colours makes grey by itself, a red spot is
clipped when it is at 30 % of that. A longer exposure gives no more then; that number is taken for full scale.
Or the number jumps to full scale, where the driver tells of such a pixel: the search ends below the jump.

Where no laser is seen, the light is the room's alone: it is too little, or so much that it hides the lasers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workbench.devices.protocols import Bench, Camera, ExposableCamera, StreamingCamera, settable
from workbench.model.arrays import Image
from workbench.model.errors import RigNotReadyError
from workbench.model.event import ExposureSet
from workbench.model.exposure import AIM, CLIPPED, GOOD, verdict_of
from workbench.model.rig import Rig
from workbench.procedure.capture.brightness import Brightness, measure_brightness, searched_pixels
from workbench.procedure.capture.latency import LEASE_S

BOLDEST = 8.0
"""Largest factor from one trial to the next."""
MOST_TRIALS = 9
"""Four go from the middle of a range of 1 : 10^7 to its ends; four are left to close in, one to step down."""
LIT_FRAMES = 2
"""Of a trial."""
TELLING = 1.4
"""Ratio of two exposures from which on their peaks tell whether they grow."""
LEAST_GROWTH = 0.3
"""As which power of the exposure a peak grows at least: 1 where it is linear, 0.45 with a gamma of 2.2."""
GROWTH_SD = 4.0
SAME_STEP = 1.05
"""Ratio up to which two exposures are not worth two trials."""
NEAR = 1.35
"""Ratio of the shortest exposure that was clipped to the longest that was not, which is near enough."""
STEP_DOWN = 0.7
"""From the longest exposure below a jump, where a colour may be all but clipped, to one with room left."""
LEFT = 0.75
"""Of that longest exposure, at most: a quarter is left, however coarse the camera's steps."""
SAME = 0.005
"""Relative difference below which an exposure was taken as in its trial."""
FLAT = 0.03
"""How much clipped numbers differ where it is not at full scale: they were averaged, or compressed."""


@dataclass(frozen=True)
class ExposureTrial:
    """An exposure as the camera took it, and what the lasers lit with it."""

    exposure: float
    seen: Brightness


def set_exposure(
    bench: Bench, rig: Rig, placement_key: str, begin: Callable[[str], None]
) -> ExposureSet | None:
    """Set the camera's exposure for all lasers of the rig on the target as it stands.

    They are lit together: no laser by itself is brighter, and one trial tells. The first trial is
    always the same, so that what is found at a placement does not depend on where the target was before.

    Args:
        bench: its camera and lasers.
        rig: tells which lasers, where their spots may lie, and the camera's full scale.
        placement_key: of the placement.
        begin: called with the key of each trial before it.

    Returns:
        What was set; None where the camera's exposure is not to be set.

    Raises:
        LaserOffNotConfirmedError: a beam stays on.
        RigNotReadyError: a device does not answer, or takes another exposure than in its trial.
    """
    if (found := settable(bench.camera)) is None:
        return None
    camera, limits = found
    searched = searched_pixels(rig)

    def look(exposure: float, number: int) -> ExposureTrial:
        begin(f"{placement_key}/exposure/{number:02d}")
        taken = camera.set_exposure(exposure)
        before = camera.grab().image
        with bench.lasers.lit(rig.laser_ids, for_s=LEASE_S):
            on = [camera.grab().image, _next_frame(camera)]
        off = [before, camera.grab().image]
        return ExposureTrial(taken, measure_brightness(on, off, searched, 2**rig.camera.bits - 1))

    tried = search_exposure(limits, look)
    best = best_of(tried)
    if best is not tried[-1]:
        _set_again(camera, best.exposure)
    peak = share_of(best, tried)
    return ExposureSet(
        key=placement_key,
        exposure=best.exposure,
        unit=camera.exposure_unit,
        peak=peak,
        verdict=verdict_of(peak, seen=best.seen.lit > 0),
        trials=len(tried),
    )


def _next_frame(camera: Camera) -> Image:
    """After a grab; nothing was switched since then."""
    return (camera.read() if isinstance(camera, StreamingCamera) else camera.grab()).image


def _set_again(camera: ExposableCamera, exposure: float) -> None:
    """What was found holds for the exposure of its trial, and for no other.

    Raises:
        RigNotReadyError: the camera does not take it this time.
    """
    came = camera.set_exposure(exposure)
    if abs(came - exposure) > SAME * exposure:
        raise RigNotReadyError(
            f"camera: exposure: expected {exposure:g} as it was taken in a trial, the camera says {came:g}"
            " now; does another program set it? Leave exposure_limits out if the camera keeps none"
        )


def search_exposure(
    limits: tuple[float, float], look: Callable[[float, int], ExposureTrial]
) -> list[ExposureTrial]:
    """Try exposures until one is good, or the next would be one that was tried.

    Args:
        limits: shortest and longest exposure.
        look: makes the trial of that number at an exposure.

    Returns:
        Every trial.
    """
    asked: list[float] = []
    tried: list[ExposureTrial] = []
    following: float | None = math.sqrt(limits[0] * limits[1])
    while following is not None and (following := _within(limits, following)) not in asked:
        asked.append(following)
        tried.append(look(following, len(tried)))
        following = _after(tried) if len(tried) < MOST_TRIALS - 1 else None
    longest = _longest(tried)
    if _below_jump(longest, tried) and (lower := _within(limits, STEP_DOWN * longest.exposure)) not in asked:
        tried.append(look(lower, len(tried)))
    return tried


def _after(tried: Sequence[ExposureTrial]) -> float | None:
    """The exposure to try next; None: a good one is among them."""
    best = _longest(tried)
    if GOOD[0] <= _level(best, tried) <= GOOD[1]:
        # Half of it tells whether the number is that of a pixel clipped below full scale.
        return None if any(_tells(other, best) for other in tried) else best.exposure / 2
    last, level = tried[-1], _level(tried[-1], tried)
    following = last.exposure * (1 / BOLDEST if level >= CLIPPED else AIM / max(level, AIM / BOLDEST))
    clipped = _shortest_clipped(tried)
    dimmest = max((t.exposure for t in tried if _level(t, tried) < GOOD[0]), default=0.0)
    if clipped == math.inf or SAME_STEP * dimmest < following < clipped / SAME_STEP:
        return following
    # It jumps from below the aim to clipped, as grey does where one of its colours is clipped: in between.
    return math.sqrt(dimmest * clipped) if clipped > NEAR * dimmest else None


def _within(limits: tuple[float, float], exposure: float) -> float:
    """Three digits are finer than any aim, and can be read."""
    return min(max(float(f"{exposure:.3g}"), limits[0]), limits[1])


def best_of(tried: Sequence[ExposureTrial]) -> ExposureTrial:
    """The longest exposure that was not too bright; where all were, the shortest; well below a jump."""
    longest = _longest(tried)
    if not _below_jump(longest, tried):
        return longest
    lower = [t for t in tried if t.seen.lit > 0 and t.exposure < longest.exposure]
    return max(
        (t for t in lower if t.exposure <= LEFT * longest.exposure),
        key=_exposure,
        default=min(lower, key=_exposure, default=longest),
    )


def _longest(tried: Sequence[ExposureTrial]) -> ExposureTrial:
    """Not too bright, with the lasers seen if any trial sees them."""
    seen = [trial for trial in tried if trial.seen.lit > 0 and share_of(trial, tried) < CLIPPED]
    among = seen or tried
    sound = [trial for trial in among if _level(trial, tried) <= GOOD[1]]
    return max(sound, key=_exposure) if sound else min(among, key=_exposure)


def _below_jump(trial: ExposureTrial, tried: Sequence[ExposureTrial]) -> bool:
    """Whether a dim spot was clipped at an exposure at which light in proportion would not have been."""
    share = share_of(trial, tried)
    growth = _shortest_clipped(tried) / trial.exposure
    return trial.seen.lit > 0 and share < GOOD[0] and share * growth < CLIPPED


def _shortest_clipped(tried: Sequence[ExposureTrial]) -> float:
    return min((t.exposure for t in tried if _level(t, tried) >= CLIPPED), default=math.inf)


def _level(trial: ExposureTrial, tried: Sequence[ExposureTrial]) -> float:
    """How bright it is for the search: where no laser is seen dark, or clipped if it is as bright as that."""
    if trial.seen.lit > 0:
        return share_of(trial, tried)
    return 0.0 if trial.seen.peak <= GOOD[1] else CLIPPED


def share_of(trial: ExposureTrial, tried: Sequence[ExposureTrial]) -> float:
    """The brightest pixel as a share of the number at which it is clipped, which all trials tell."""
    ceiling = _ceiling(tried)
    share = trial.seen.peak / ceiling
    return CLIPPED if ceiling < CLIPPED and share >= 1 - FLAT else share


def _ceiling(tried: Sequence[ExposureTrial]) -> float:
    """Where peaks do not grow any more; full scale where they do."""
    flat = any(_tells(a, b) and not _grows(a, b) for a in tried for b in tried)
    return max(trial.seen.peak for trial in tried) if flat else CLIPPED


def _tells(shorter: ExposureTrial, longer: ExposureTrial) -> bool:
    """Whether two trials can tell if the peak grows: both see the lasers, at exposures that differ."""
    return longer.exposure >= TELLING * shorter.exposure and min(shorter.seen.lit, longer.seen.lit) > 0


def _grows(shorter: ExposureTrial, longer: ExposureTrial) -> bool:
    a, b = shorter.seen, longer.seen
    growth = (longer.exposure / shorter.exposure) ** LEAST_GROWTH
    sd = math.hypot(growth * a.noise, b.noise)
    return b.peak >= CLIPPED or b.lit > growth * a.lit - GROWTH_SD * sd


def _exposure(trial: ExposureTrial) -> float:
    return trial.exposure
