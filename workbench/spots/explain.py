"""Explanation of each failure: cause and remedy."""

from __future__ import annotations

from typing import Final

from workbench.model.spot import Failure

_TEXTS: Final[dict[Failure, str]] = {
    Failure.NO_SPOT: (
        "No spot stands out of the noise. Cause: laser off or blocked, target missing, or exposure "
        "too short. "
        "Do: check that the lasers are on and reach the target, then raise exposure or gain."
    ),
    Failure.TOO_FEW: (
        "Fewer spots than lasers that are on. Cause: a beam misses the target, is absorbed, or leaves the "
        "image. Do: find out where each beam ends, or capture each laser alone."
    ),
    Failure.TOO_MANY: (
        "More spots than lasers that are on. Cause: a reflection on the scanline, which looks like a laser "
        "in a single capture, or a lamp that was switched on between the frames. "
        "Do: cover shiny surfaces, keep the light steady, or capture each laser alone."
    ),
    Failure.TOO_DIM: (
        "A possible spot is not significant against the noise. Cause: dark or distant target, short "
        "exposure. Do: raise exposure, use a brighter target, or move it closer."
    ),
    Failure.SATURATED: (
        "The centre of a spot is clipped; its position comes from the unclipped pixels around it and is less "
        "certain. Cause: overexposure. Do: shorten the exposure or lower the gain until the peak stays below "
        "full scale."
    ),
    Failure.BLOOMING: (
        "The charge of clipped pixels has spilled along the columns of the sensor, so that the position "
        "along them is uncertain by the length of the streak. Cause: overexposure of a sensor without "
        "anti-blooming. Do: shorten the exposure until the peak stays below full scale."
    ),
    Failure.OFF_SCANLINE: (
        "A spot lies outside the band where this rig's lasers can appear. Cause: a reflection, a lamp, or a "
        "calibration that no longer matches the rig. Do: cover shiny surfaces; if it persists, realign or "
        "recalibrate."
    ),
    Failure.MERGED: (
        "Two spots overlap, so that each position depends on the other, or they could not be separated. "
        "Cause: distant target, or beams that cross. Do: capture each laser alone, or move the target closer."
    ),
    Failure.AMBIENT_CHANGED: (
        "The ambient light differs between the on and the off frame; the difference was compensated. "
        "Cause: a lamp that was switched, daylight, mains flicker, or automatic exposure, gain or white "
        "balance of the camera. Do: keep the light steady, end automatic control, use an exposure that "
        "is a multiple of the mains period."
    ),
    Failure.AT_EDGE: (
        "A spot touches the border of the image; the part outside is missing. Cause: the target is too "
        "close or off to the side. Do: move the target until the whole spot is inside the image."
    ),
    Failure.ON_OFF_EXCHANGED: (
        "The spot is in the frame with the lasers off, and not in the one with the lasers on. Cause: the two "
        "frames are exchanged, or the camera's frames lag behind the switching of the lasers. "
        "Do: exchange the columns on and off, or measure the latency (workbench doctor) and discard as many "
        "frames."
    ),
}


def explain(failure: Failure) -> str:
    """Cause and remedy of a failure, for the technician."""
    return _TEXTS[failure]
