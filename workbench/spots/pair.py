"""Signal of a pair of frames: their difference, corrected for a change of the ambient light."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from workbench.model.arrays import Float32Array, FloatArray, Image, IndexArray
from workbench.spots.fit import Windows
from workbench.spots.kernels.windows import cut_windows
from workbench.spots.noise import level_and_variance
from workbench.spots.strip import Strip

# A change of the level below 1 DN or a quarter of the noise is left to the background of the fit.
_LEVEL_CHANGE_DN = 1.0
_LEVEL_CHANGE_SD = 0.25
_MIN_OFF_SPREAD_DN = 2.0


class Pair(NamedTuple):
    """Frames with the lasers on and off; `signal = on - off_share * off - level`."""

    on: Image
    off: Image | None
    clip_dn: float
    """Value of a clipped pixel."""
    off_share: float = 1.0
    level_dn: float = 0.0
    stated_contrast2: float = 0.0
    """Squared contrast of speckle in an evenly lit pixel; 0: not known."""

    def signal(self, strip: Strip) -> Float32Array:
        """(height, width) signal of a strip, DN."""
        on = self.on[strip.at]
        if self.off is None:
            return on.astype(np.float32) - np.float32(self.level_dn)
        if self.off_share == 1.0 and self.level_dn == 0.0:
            return np.asarray(cv2.subtract(on, self.off[strip.at], dtype=cv2.CV_32F), np.float32)
        out = cv2.addWeighted(on, 1.0, self.off[strip.at], -self.off_share, -self.level_dn, dtype=cv2.CV_32F)
        return np.asarray(out, np.float32)

    def cut(self, rows: FloatArray, cols: FloatArray, group: IndexArray, half: int) -> Windows:
        """Square windows of 2 half + 1 pixels around those of the peaks that `group` (n,) indexes.

        Pixels outside the image, and pixels closer to another peak, are not usable.
        """
        off, share = (self.on, 0.0) if self.off is None else (self.off, self.off_share)
        shape = (group.size, 2 * half + 1, 2 * half + 1)
        win = Windows(np.empty(shape), np.empty(shape, bool), np.empty(shape))
        cut_windows(self.on, off, share, self.level_dn, self.clip_dn, rows, cols, group, *win)
        return win


class PairSignal(NamedTuple):
    """Signal of a strip of a pair, without its level, and the noise of its pixels."""

    pair: Pair
    strip: Strip
    signal: Float32Array
    """(height, width) signal of the strip, DN; its mean is zero outside spots."""
    variance: float
    """Variance of a pixel without light of a spot, DN^2."""
    ambient_changed: bool


def measure_signal(pair: Pair, strip: Strip) -> PairSignal:
    """Measure level and noise of a strip.

    Where the ambient light changed, the off frame is scaled to the on frame by linear regression over the
    pixels of the strip. Bright and dark parts of the scene then cancel alike.
    """
    signal = pair.signal(strip)
    level, variance = level_and_variance(signal)
    limit = max(_LEVEL_CHANGE_DN, _LEVEL_CHANGE_SD * variance**0.5)
    if pair.off is not None and abs(level) <= limit:
        return PairSignal(pair, strip, signal, variance, ambient_changed=False)
    if pair.off is not None:
        share = _share_of_off(pair.on[strip.at].astype(np.float64), pair.off[strip.at].astype(np.float64))
        pair = pair._replace(off_share=share)
        level, variance = level_and_variance(pair.signal(strip))
    pair = pair._replace(level_dn=level)
    return PairSignal(pair, strip, pair.signal(strip), variance, ambient_changed=pair.off is not None)


def _share_of_off(on: FloatArray, off: FloatArray) -> float:
    """Slope of on over off, spots rejected as outliers; 1 where the off frame is too even for a slope."""
    share = 1.0
    for _ in range(3):
        rest = on - share * off
        median = float(np.median(rest))
        spread = 1.4826 * float(np.median(np.abs(rest - median))) + 0.5
        kept = np.abs(rest - median) < 4.0 * spread
        centred = off[kept] - off[kept].mean()
        total = float(centred @ centred)
        if total < _MIN_OFF_SPREAD_DN**2 * kept.sum():
            return 1.0
        share = float(centred @ on[kept]) / total
    return share if 0.2 < share < 5.0 else 1.0
