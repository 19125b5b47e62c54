"""Search for the exposure at which the brightest spot is bright and not clipped.

The value of a pixel is its pedestal plus irradiance times exposure, until it is clipped. Scaling the exposure
by (aim / value) therefore converges to the aim: only the pedestal, some hundredths of full scale, is scaled
wrongly, and the next trial exposure corrects that. A clipped pixel gives only a bound.

Not every pixel is clipped at full scale. In a colour camera that converts to grey itself, a red spot is
clipped at 30 % of full scale. A longer exposure then gives no higher value, which is taken as full scale. If
the driver reports such a pixel as clipped, the value jumps to full scale; the search then ends below the
jump.

If no laser is seen, only room light is visible: it is too dark, or so bright that it hides the lasers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workbench.devices.attempts import within_lease
from workbench.devices.protocols import Bench, Camera, ExposableCamera, StreamingCamera, settable
from workbench.model.arrays import Image
from workbench.model.errors import RigNotReadyError
from workbench.model.event import ExposureSet
from workbench.model.exposure import AIM, CLIPPED, GOOD, verdict_of
from workbench.model.rig import Rig
from workbench.procedure.capture.brightness import Brightness, measure_brightness, searched_pixels
from workbench.procedure.capture.latency import LEASE_S

LARGEST_FACTOR = 8.0
"""Largest ratio of consecutive trial exposures."""
MOST_TRIALS = 9
"""Largest number of trial exposures: four from the middle of a range of 1 : 10^7 to an end, four to converge,
one to step down below a jump."""
LIT_FRAMES = 2
"""Number of frames with lasers on in a trial exposure."""
DECISIVE_RATIO = 1.4
"""Least ratio of two exposures whose peaks show whether the peak grows with the exposure."""
LEAST_GROWTH = 0.3
"""Least exponent of the growth of a peak with the exposure: linear 1, gamma of 2.2 0.45."""
GROWTH_SD = 4.0
"""Tolerance of that comparison in standard deviations of the noise."""
SAME_STEP = 1.05
"""Ratio below which two exposures count as equal."""
NEAR = 1.35
"""Ratio of the shortest clipped to the longest unclipped exposure at which the search stops."""
STEP_DOWN = 0.7
"""Ratio of the final exposure to the longest below a jump, where one colour may be almost clipped."""
LARGEST_STEP_DOWN = 0.75
"""Upper bound of that ratio for cameras with coarse exposure steps."""
SAME = 0.005
"""Largest relative difference of an exposure from that of its trial exposure."""
CLIPPED_SPREAD = 0.03
"""Relative spread of clipped values below full scale, due to averaging or compression."""


@dataclass(frozen=True)
class ExposureTrial:
    """Trial exposure: exposure as accepted by the camera, and brightness at this exposure."""

    exposure: float
    seen: Brightness


def set_exposure(
    bench: Bench, rig: Rig, placement_key: str, begin: Callable[[str], None], head_deg: float = 0.0
) -> ExposureSet | None:
    """Set the camera's exposure for all lasers of the rig and the present placement of the target.

    All lasers are on together: no single laser is brighter, and one trial exposure covers all. The first one
    is always the same, so that the result does not depend on the previous placement.

    Args:
        bench: bench with camera and lasers.
        rig: rig with the lasers, their scanlines and the camera's full scale.
        placement_key: key of the placement.
        begin: called before each trial exposure with its key.
        head_deg: reading of the rig's scanning head.

    Returns:
        The exposure that was set; None if the camera's exposure cannot or must not be set.

    Raises:
        LaserOffNotConfirmedError: a beam stays on.
        RigNotReadyError: a device does not answer, or takes another exposure than in its trial exposure.
    """
    if (found := settable(bench.camera)) is None:
        return None
    camera, limits = found
    searched = searched_pixels(rig, head_deg)

    def look(exposure: float, number: int) -> ExposureTrial:
        taken = camera.set_exposure(exposure)

        def take() -> list[Image]:
            begin(f"{placement_key}/exposure/{number:02d}")
            return [camera.grab().image, *_grab_lit(bench, camera, rig.laser_ids)]

        before, *on = within_lease(take)
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


def _grab_lit(bench: Bench, camera: Camera, laser_ids: Sequence[str]) -> list[Image]:
    """`LIT_FRAMES` frames with lasers on; raises the errors of `LaserBank.lit`."""
    with bench.lasers.lit(laser_ids, for_s=LEASE_S):
        return [camera.grab().image, *(_next_frame(camera) for _ in range(LIT_FRAMES - 1))]


def _next_frame(camera: Camera) -> Image:
    """Next frame after a grab, without waiting for the latency: no laser was switched in between."""
    return (camera.read() if isinstance(camera, StreamingCamera) else camera.grab()).image


def _set_again(camera: ExposableCamera, exposure: float) -> None:
    """Set the exposure of an earlier trial exposure again.

    Raises:
        RigNotReadyError: the camera accepts another exposure this time.
    """
    accepted = camera.set_exposure(exposure)
    if abs(accepted - exposure) > SAME * exposure:
        raise RigNotReadyError(
            f"camera: exposure: expected {exposure:g} as in a trial exposure, got {accepted:g}; check that no"
            " other program sets it; remove exposure_limits from the rig file if the camera does not keep it"
        )


def search_exposure(
    limits: tuple[float, float], look: Callable[[float, int], ExposureTrial]
) -> list[ExposureTrial]:
    """Try exposures until one is good or none is left to try.

    Args:
        limits: shortest and longest exposure.
        look: takes a trial exposure at an exposure; the second argument is its number, from 0.

    Returns:
        All trial exposures, in order.
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
    """Exposure to try next; None: the search has converged."""
    best = _longest(tried)
    if GOOD[0] <= _level(best, tried) <= GOOD[1]:
        # Half the exposure decides whether the pixel is clipped below full scale.
        return None if any(_is_decisive(other, best) for other in tried) else best.exposure / 2
    last, level = tried[-1], _level(tried[-1], tried)
    factor = 1 / LARGEST_FACTOR if level >= CLIPPED else AIM / max(level, AIM / LARGEST_FACTOR)
    following = last.exposure * factor
    clipped = _shortest_clipped(tried)
    dimmest = max((t.exposure for t in tried if _level(t, tried) < GOOD[0]), default=0.0)
    if clipped == math.inf or SAME_STEP * dimmest < following < clipped / SAME_STEP:
        return following
    # The level jumps from below the aim to clipped, as grey does if one colour is clipped: bisect.
    return math.sqrt(dimmest * clipped) if clipped > NEAR * dimmest else None


def _within(limits: tuple[float, float], exposure: float) -> float:
    """Exposure within the limits, rounded to three significant digits."""
    return min(max(float(f"{exposure:.3g}"), limits[0]), limits[1])


def best_of(tried: Sequence[ExposureTrial]) -> ExposureTrial:
    """Longest trial exposure that is not too bright, else the shortest; well below a jump."""
    longest = _longest(tried)
    if not _below_jump(longest, tried):
        return longest
    lower = [t for t in tried if t.seen.lit > 0 and t.exposure < longest.exposure]
    return max(
        (t for t in lower if t.exposure <= LARGEST_STEP_DOWN * longest.exposure),
        key=_exposure,
        default=min(lower, key=_exposure, default=longest),
    )


def _longest(tried: Sequence[ExposureTrial]) -> ExposureTrial:
    """Longest trial exposure that is not too bright, among those that show the lasers if there are any."""
    seen = [trial for trial in tried if trial.seen.lit > 0 and share_of(trial, tried) < CLIPPED]
    among = seen or tried
    sound = [trial for trial in among if _level(trial, tried) <= GOOD[1]]
    return max(sound, key=_exposure) if sound else min(among, key=_exposure)


def _below_jump(trial: ExposureTrial, tried: Sequence[ExposureTrial]) -> bool:
    """Whether the spot is dim, and clipped at an exposure at which proportional growth would not clip it."""
    share = share_of(trial, tried)
    growth = _shortest_clipped(tried) / trial.exposure
    return trial.seen.lit > 0 and share < GOOD[0] and share * growth < CLIPPED


def _shortest_clipped(tried: Sequence[ExposureTrial]) -> float:
    return min((t.exposure for t in tried if _level(t, tried) >= CLIPPED), default=math.inf)


def _level(trial: ExposureTrial, tried: Sequence[ExposureTrial]) -> float:
    """Level for the search: share of full scale; without a laser 0, or clipped if the room is bright."""
    if trial.seen.lit > 0:
        return share_of(trial, tried)
    return 0.0 if trial.seen.peak <= GOOD[1] else CLIPPED


def share_of(trial: ExposureTrial, tried: Sequence[ExposureTrial]) -> float:
    """Brightest pixel as a share of the value at which it is clipped, estimated from all trial exposures."""
    ceiling = _ceiling(tried)
    share = trial.seen.peak / ceiling
    return CLIPPED if ceiling < CLIPPED and share >= 1 - CLIPPED_SPREAD else share


def _ceiling(tried: Sequence[ExposureTrial]) -> float:
    """Value above which peaks do not grow with the exposure; full scale if they all grow."""
    flat = any(_is_decisive(a, b) and not _grows(a, b) for a in tried for b in tried)
    return max(trial.seen.peak for trial in tried) if flat else CLIPPED


def _is_decisive(shorter: ExposureTrial, longer: ExposureTrial) -> bool:
    """Whether two trial exposures show if the peak grows: they differ, and both show the lasers."""
    return longer.exposure >= DECISIVE_RATIO * shorter.exposure and min(shorter.seen.lit, longer.seen.lit) > 0


def _grows(shorter: ExposureTrial, longer: ExposureTrial) -> bool:
    a, b = shorter.seen, longer.seen
    growth = (longer.exposure / shorter.exposure) ** LEAST_GROWTH
    sd = math.hypot(growth * a.noise, b.noise)
    return b.peak >= CLIPPED or b.lit > growth * a.lit - GROWTH_SD * sd


def _exposure(trial: ExposureTrial) -> float:
    return trial.exposure
