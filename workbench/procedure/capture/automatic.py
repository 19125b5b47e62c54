"""Automatic exposure, gain or white balance: the image darkens because a laser is on.

Two signs are looked for. In a lit room the background darkens while the laser is on. In a dark room there is
no background to darken: the spot itself dims within the frames after switching on. A lamp that fades darkens
the background too, but in frames with the laser off as well. Each lit frame is therefore compared with the
mean of the dark ones before and after it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.calibration.data.spot_rows import prior_scanline
from workbench.devices.protocols import LaserBank, StreamingCamera
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.rig import Rig
from workbench.procedure.capture.latency import SERIES_LEASE_S

PAIRS = 4
SETTLING_FRAMES = 6
"""Frames that pass after each switching, beyond those that are stale: automatic controls act over several."""
SIGNIFICANT_SD = 5.0
"""Least mean change in standard errors over the pairs."""
LEAST_CHANGE_DN = 1.0
LEAST_SHARE = 0.01
"""Least relative darkening that matters: smaller ones are compensated with the ambient light."""
LEAST_DIMMING = 0.05
"""Least relative dimming of the spot; the power of a laser diode may fall by a few percent at first."""
SPOT_SHARE = 0.5
"""Pixels of the spot have more than this share of its brightest pixel."""


@dataclass(frozen=True)
class AutomaticControl:
    """Signs of a camera that adjusts itself; None: no such sign."""

    darkening: float | None
    """Relative darkening of the background while the laser is on."""
    dimming: float | None
    """Relative dimming of the spot after switching on; a laser whose power falls does the same."""

    @property
    def text(self) -> str:
        """The sign and what to do about it; empty without a sign."""
        if self.darkening is not None:
            return (
                f"The camera adjusts itself: while a laser is on, the rest of the image darkens by"
                f" {100 * self.darkening:.0f} %. Switch its automatic exposure, gain and white balance off"
            )
        if self.dimming is not None:
            return (
                f"The spot dims by {100 * self.dimming:.0f} % after switching on: either the camera adjusts"
                " itself (switch its automatic exposure and gain off), or the laser's power falls (check its"
                " supply and temperature)"
            )
        return ""


@dataclass(frozen=True)
class _Alternation:
    """Frames of a laser that is switched on and off in turn, float, (n, height, width)."""

    off: FloatArray
    """(PAIRS + 1, ...) settled frames with the laser off, around those with it on."""
    first: FloatArray
    """(PAIRS, ...) first frames with the laser on."""
    settled: FloatArray
    """(PAIRS, ...) settled frames with the laser on."""


def find_automatic_control(lasers: LaserBank, camera: StreamingCamera, rig: Rig) -> AutomaticControl:
    """Switch the first laser on and off in turn, and look for signs of automatic control.

    Raises:
        RigNotReadyError: a device does not answer.
    """
    frames = _alternate(lasers, camera, rig.lasers[0].id)
    outside = _outside(rig, frames.off.shape[1:])
    return AutomaticControl(_darkening(frames, outside), _dimming(frames, outside))


def _alternate(lasers: LaserBank, camera: StreamingCamera, laser_id: str) -> _Alternation:
    off, first, settled = [_settled(camera)], [], []
    for _ in range(PAIRS):
        with lasers.lit([laser_id], for_s=SERIES_LEASE_S):
            first.append(camera.grab().image)
            settled.append(_settled(camera))
        camera.grab()  # the stale frames
        off.append(_settled(camera))
    return _Alternation(*(np.array(images, float) for images in (off, first, settled)))


def _settled(camera: StreamingCamera) -> FloatArray:
    for _ in range(SETTLING_FRAMES - 1):
        camera.read()
    return np.asarray(camera.read().image, float)


def _darkening(frames: _Alternation, outside: BoolArray) -> float | None:
    """Relative darkening of the background, each lit frame against the dark ones before and after it.

    A sensor with fixed settings adds the light of the laser, and a lamp flickers in both directions.
    """
    off = frames.off[:, outside].mean(axis=1)
    change = (off[:-1] + off[1:]) / 2 - frames.settled[:, outside].mean(axis=1)
    mean, level = float(change.mean()), float(off.mean())
    is_seen = mean >= LEAST_CHANGE_DN and mean >= LEAST_SHARE * level and _is_significant(change)
    return mean / level if is_seen else None


def _dimming(frames: _Alternation, outside: BoolArray) -> float | None:
    """Relative dimming of the spot from its first frame to the settled one.

    Ambient light is subtracted, scaled to that of each frame outside the spot's band.
    """
    first, settled = (
        _without_ambient(lit, frames.off[:-1], outside) for lit in (frames.first, frames.settled)
    )
    spot = first.mean(axis=0)
    mask = ~outside & (spot > SPOT_SHARE * spot[~outside].max(initial=0.0))
    light, later = first[:, mask].sum(axis=1), settled[:, mask].sum(axis=1)
    if not mask.any() or light.min() <= 0:
        return None
    share = 1 - later / light
    return float(share.mean()) if share.mean() >= LEAST_DIMMING and _is_significant(share) else None


def _without_ambient(lit: FloatArray, off: FloatArray, outside: BoolArray) -> FloatArray:
    """(n, height, width) light of the laser in each lit frame."""
    ambient, dark = (images[:, outside].mean(axis=1) for images in (lit, off))
    known = dark >= LEAST_CHANGE_DN
    ratio = np.where(known, ambient / np.where(known, dark, 1.0), 1.0)
    return lit - ratio[:, None, None] * off


def _is_significant(values: FloatArray) -> bool:
    """Whether the mean of n values is far above 0, by their scatter."""
    error = max(float(values.std(ddof=1)), 1e-3) / len(values) ** 0.5
    return bool(values.mean() >= SIGNIFICANT_SD * error)


def _outside(rig: Rig, shape: tuple[int, ...]) -> BoolArray:
    """(height, width) whether a pixel is outside the band of the first laser, or everywhere if none is."""
    line = prior_scanline(rig, rig.lasers[0])
    v, u = np.indices(shape)
    length = float(np.hypot(line.du, line.dv))
    outside = np.abs((u - line.u0_px) * line.dv - (v - line.v0_px) * line.du) > line.half_width_px * length
    return np.asarray(outside if outside.any() else ~outside)
