"""Every named failure in words: its cause and what to do."""

from __future__ import annotations

from typing import Final

from workbench.model.spot import Failure

_WORDS: Final[dict[Failure, str]] = {
    Failure.NO_SPOT: (
        "No spot stands out of the noise. Cause: laser off or blocked, target missing, or exposure "
        "too short. "
        "Do: check that the lasers are lit and reach the target, then raise exposure or gain."
    ),
    Failure.TOO_FEW: (
        "Fewer spots than lasers lit. Cause: a beam misses the target, is absorbed, or leaves the image. "
        "Do: check where each beam ends, or capture each laser alone."
    ),
    Failure.TOO_MANY: (
        "More spots than lasers lit. Cause: a reflection on the scanline, which one capture cannot tell from "
        "a laser, or a lamp that came on between the frames. "
        "Do: cover shiny surfaces, keep the light steady, or capture each laser alone."
    ),
    Failure.TOO_DIM: (
        "Something that could be a spot is too weak to be told from noise. Cause: dark or distant "
        "target, short "
        "exposure. Do: raise exposure, use a brighter target, or move it closer."
    ),
    Failure.SATURATED: (
        "A spot's middle is clipped; its position rests on the unclipped rim and its deviation is wider. "
        "Cause: too much light. Do: shorten the exposure or lower the gain until the peak stays "
        "below full scale."
    ),
    Failure.OFF_SCANLINE: (
        "A spot lies outside the band where this rig's lasers can appear. Cause: a reflection, a lamp, or a "
        "scanline that no longer fits the rig. Do: cover shiny surfaces; if it persists, realign or "
        "recalibrate."
    ),
    Failure.MERGED: (
        "Two spots overlap, so that each position depends on the other, or they could not be separated. "
        "Cause: distant target, or beams that cross. Do: capture each laser alone, or move the target closer."
    ),
    Failure.AMBIENT_CHANGED: (
        "The light in the room differs between the on and the off frame; the difference was compensated. "
        "Cause: a lamp switched, daylight, mains flicker. Do: keep the light steady, use an exposure "
        "that is a "
        "multiple of the mains period."
    ),
    Failure.AT_EDGE: (
        "A spot touches the border of the image; the part outside is missing. Cause: the target is "
        "too close or "
        "too far aside. Do: move the target until the spot is wholly inside."
    ),
}


def explain(failure: Failure) -> str:
    """Cause of a failure and what to do about it, for the person at the bench."""
    return _WORDS[failure]
