"""Live ranging on a bench, at the rate of its camera."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from workbench.devices.attempts import within_lease
from workbench.devices.protocols import Bench, Frame
from workbench.model.arrays import Image
from workbench.model.errors import BadInputError
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger, Reading
from workbench.spots import Finding, Spot, SpotFinder, persistent_spots, position_text, refuse_stuck_beam

LEASE_S = 2.0
"""Longest time that a laser stays on for one frame."""
FEWEST_FOR_P99 = 100
LATENCY_ADVICE = (
    "measure it with `workbench doctor`, and enter it in the rig file as the camera's latency_frames"
)


@dataclass
class LiveRanger:
    """Switches lasers, grabs and ranges; records the time from a pair's second frame to the answer."""

    ranger: Ranger
    bench: Bench
    latencies_s: list[float] = field(default_factory=list)
    seen: tuple[Image, Image, tuple[Spot, ...]] | None = None
    """Frames with the lasers on and off, and spots, of the last capture with all lasers."""
    _finders: dict[tuple[str, ...], SpotFinder] = field(default_factory=dict)
    _second_frame_at: float = 0.0
    _dark: Image | None = None
    _lamps: tuple[Spot, ...] = ()
    """Lights on the lasers' lines before any laser was switched on."""

    def get_ready(self) -> tuple[str, ...]:
        """Check frames and their size before any laser is switched on; raises the errors of `read`.

        Returns:
            Warnings of lights that are already on.
        """
        self._lamps = tuple(persistent_spots(self._look_again(), self._look_again))
        return tuple(_lamp_text(lamp) for lamp in self._lamps)

    def warm_up(self) -> None:
        """Range a synthetic capture without lasers, so that the code of a reading is loaded and compiled."""
        width, height = self.ranger.size_px
        rows, columns = np.mgrid[0:height, 0:width]
        dark = np.random.default_rng(0).integers(5, 9, (height, width), dtype=np.uint8)
        lit = dark.astype(np.float64)
        nearest, farthest = self.ranger.calibration.laser_ranger.validity.standoff_mm
        for laser_id in self.ranger.sensor.ids:
            (u, v) = self.ranger.sensor.spot_px(laser_id, np.array([np.sqrt(nearest * farthest)]))[0]
            lit += 120.0 * np.exp(-((columns - u) ** 2 + (rows - v) ** 2) / (2 * 1.5**2))
        on = np.clip(lit, 0, 255).astype(np.uint8)
        acquire(self.ranger, "warm-up", lambda ids: self._find(ids, on, dark))

    def read(self, scene: str) -> Reading:
        """Take one reading.

        Raises:
            RigNotReadyError: a device does not answer.
            LaserOffNotConfirmedError: a beam stays on.
            BadInputError: the frames are not of the calibration's size.
        """
        reading = acquire(self.ranger, scene, lambda ids: self._shoot(scene, ids))
        if reading.status != "done":
            reading = self._look_for_stuck_beam(reading)
        self.latencies_s.append(time.perf_counter() - self._second_frame_at)
        return reading

    def _shoot(self, scene: str, ids: tuple[str, ...]) -> Finding:
        on = within_lease(lambda: self._grab_lit(scene, ids))
        off = self.bench.camera.grab()
        self._second_frame_at = time.perf_counter()
        self._dark = off.image
        finding = self._find(ids, on.image, off.image)
        if ids == self.ranger.sensor.ids:
            self.seen = on.image, off.image, finding.spots
        return finding

    def _grab_lit(self, scene: str, ids: tuple[str, ...]) -> Frame:
        self.bench.mark(f"{scene}/{ids[0] if len(ids) == 1 else 'all'}")
        with self.bench.lasers.lit(ids, for_s=LEASE_S):
            return self.bench.camera.grab()

    def _look_for_stuck_beam(self, reading: Reading) -> Reading:
        """Check the last frame with all lasers off; a light known from before becomes a note.

        Raises:
            LaserOffNotConfirmedError: see `refuse_stuck_beam`.
        """
        if self._dark is None:
            return reading
        lights = self._find(self.ranger.sensor.ids, self._dark, None).spots
        known = refuse_stuck_beam(
            f"reading {reading.scene}", lights, self._look_again, LATENCY_ADVICE, self._lamps
        )
        return replace(reading, notes=(*reading.notes, *map(_lamp_text, known)))

    def _look_again(self) -> Sequence[Spot]:
        """Lights in the next frame; all lasers are off."""
        return self._find(self.ranger.sensor.ids, self.bench.camera.grab().image, None).spots

    def _find(self, ids: tuple[str, ...], on: Image, off: Image | None) -> Finding:
        width, height = self.ranger.size_px
        if on.shape != (height, width):
            raise BadInputError(
                f"frame: expected {width} x {height} pixels as in the calibration,"
                f" got {' x '.join(map(str, on.shape[::-1]))}; is the camera in another mode?"
            )
        if ids not in self._finders:
            lines = self.ranger.searched(ids)
            self._finders[ids] = SpotFinder(
                (height, width),
                lines,
                expected=len(ids),
                speckle_sd_px=self.ranger.speckle_sd_px,
                reasons=False,
            )
        return self._finders[ids].find(on, off)


def _lamp_text(light: Spot) -> str:
    return (
        f"a light at {position_text(light)} was on before any laser was switched on: a lamp, or a laser beam"
    )


def latency_text(latencies_s: Sequence[float], elapsed_s: float) -> str:
    """Text of `--stats`: rate, and percentiles of the latency."""
    if not latencies_s:
        return "no reading"
    p50, p99 = np.percentile(np.array(latencies_s) * 1e3, [50, 99])
    n = len(latencies_s)
    few = f" (of {n} readings only)" if n < FEWEST_FOR_P99 else ""
    return (
        f"{n} readings in {elapsed_s:.1f} s, {n / elapsed_s:.1f} a second, camera included; from the second"
        f" frame to the answer: p50 {p50:.2f} ms, p99 {p99:.2f} ms{few}"
    )
