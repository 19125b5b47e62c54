"""Aid for aiming and focusing lasers: each laser alone, its spot compared with the expected one.

Beam directions come from the spots at two standoffs. Directions relative to the mean of all beams are stated:
they hardly depend on the principal point, which a rig file knows to some tens of pixels only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from workbench.calibration.data.spot_rows import own_spots, prior_scanlines, sought
from workbench.calibration.design.expected_spot import expected_spot
from workbench.devices.protocols import Bench
from workbench.model.arrays import FloatArray, Image
from workbench.model.calibration import Calibration
from workbench.model.event import ExposureSet
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.optics.lens_models import lens_model
from workbench.optics.undistort import undistort
from workbench.procedure.capture.exposure import set_exposure
from workbench.procedure.capture.latency import LEASE_S
from workbench.sensor.calibrated import CalibratedSensor
from workbench.spots import Spot, SpotFinder, find_spots, persistent_spots, refuse_stuck_beam

LATENCY_ADVICE = (
    "measure it with `workbench doctor`, and enter it in the rig file as the camera's latency_frames"
)
MRAD = 1000.0
FEWEST_BEAMS = 2
"""Least number of beams for their mean direction."""


@dataclass(frozen=True)
class Expected:
    """Expected position of a spot, px; 1 sigma, None by a calibration."""

    u_px: float
    v_px: float
    u_sd_px: float | None = None
    v_sd_px: float | None = None


@dataclass(frozen=True)
class AimReading:
    """One capture of one laser alone."""

    laser_id: str
    on: Image
    """Frame with the laser on, (height, width)."""
    off: Image
    """Frame with all lasers off."""
    spot: Spot | None
    """Brightest spot of the whole frame; None: no spot."""
    failures: tuple[str, ...]
    """Causes of a missing spot, or of further ones."""
    ambient_dn: float
    """Median of the dark frame."""
    expected: Expected | None
    """None without a standoff."""
    least_width_px: float | None
    """Smallest width of the spot at this standoff so far."""


@dataclass
class Aim:
    """Readings of all lasers in turn, at standoffs that the user names."""

    rig: Rig
    bench: Bench
    calibration: Calibration | None = None
    standoff_mm: float | None = None
    """Present standoff; None: not known."""
    exposure: ExposureSet | None = None
    """Exposure that was set for it; None: that of the rig file."""
    _finders: dict[int, SpotFinder] = field(default_factory=dict)
    """By the number of spots: one, or all that are on together."""
    _expected: dict[str, Expected] = field(default_factory=dict)
    _least_px: dict[str, float] = field(default_factory=dict)
    _seen: dict[float, dict[str, Spot]] = field(default_factory=dict)
    """Last spot of each laser at each standoff."""
    _lamps: tuple[Spot, ...] = ()

    def get_ready(self) -> None:
        """Note lights on the lasers' lines before any laser is switched on."""
        self._lamps = tuple(persistent_spots(self._lights(), self._lights))

    def place(self, standoff_mm: float | None) -> None:
        """Begin at a standoff: place a bench's target, set the exposure, forget the smallest widths.

        Raises:
            RigNotReadyError: a device does not answer.
            LaserOffNotConfirmedError: a beam stays on.
        """
        self.standoff_mm = standoff_mm
        self._least_px.clear()
        if standoff_mm is not None:
            self.bench.target.place(Placement(key="aim", standoff_mm=standoff_mm))
            self._seen.pop(standoff_mm, None)  # the latest standoff comes last
            self._seen[standoff_mm] = {}
            self._expected = {laser: self._expect(laser, standoff_mm) for laser in self.rig.laser_ids}
        self.exposure = set_exposure(self.bench, self.rig, "aim", self.bench.mark)

    def read_all(self, number: int) -> Iterator[AimReading]:
        """Readings of all lasers in turn; raises the errors of `read`."""
        for laser_id in self.rig.laser_ids:
            yield self.read(laser_id, number)

    def read(self, laser_id: str, number: int) -> AimReading:
        """Capture one laser alone, and find its spot anywhere in the frame.

        Raises:
            RigNotReadyError: a device does not answer.
            LaserOffNotConfirmedError: a beam stays on.
        """
        self.bench.mark(f"aim/{number}/{laser_id}")
        with self.bench.lasers.lit([laser_id], for_s=LEASE_S):
            on = self.bench.camera.grab().image
        off = self.bench.camera.grab().image
        laser = self.rig.lasers[self.rig.laser_ids.index(laser_id)]
        _, expected = sought(self.rig, laser)
        if expected not in self._finders:
            shape, speckle_sd_px = (on.shape[0], on.shape[1]), self.rig.noise.speckle_sd_px
            self._finders[expected] = SpotFinder(shape, (), expected=expected, speckle_sd_px=speckle_sd_px)
        found = own_spots(self.rig, laser, self._finders[expected].find(on, off))
        spot = max(found.spots, key=lambda one: one.flux_dn, default=None)
        if spot is None:
            refuse_stuck_beam(
                f"laser {laser_id}", self._lights(off), self._lights, LATENCY_ADVICE, self._lamps
            )
        else:
            self._note(laser_id, spot)
        return AimReading(
            laser_id,
            on,
            off,
            spot,
            tuple(found.failures),
            float(np.median(off)),
            self._expected.get(laser_id) if self.standoff_mm is not None else None,
            self._least_px.get(laser_id),
        )

    def directions_mrad(self) -> dict[str, tuple[float, float]]:
        """Direction of each beam relative to the mean of all, in x and y, from the last two standoffs.

        Empty before there are two standoffs with `FEWEST_BEAMS` common spots.
        """
        if len(self._seen) < 2:
            return {}
        (near, first), (far, last) = list(self._seen.items())[-2:]
        lasers = [laser for laser in first if laser in last]
        if len(lasers) < FEWEST_BEAMS:
            return {}
        ends = [self._points_mm([spots[i] for i in lasers], mm) for mm, spots in ((near, first), (far, last))]
        slopes = (ends[1] - ends[0]) / (far - near)
        relative = MRAD * (slopes - slopes.mean(axis=0))
        return {laser: (x, y) for laser, (x, y) in zip(lasers, relative.tolist(), strict=True)}

    def _note(self, laser_id: str, spot: Spot) -> None:
        self._least_px[laser_id] = min(spot.width_px, self._least_px.get(laser_id, spot.width_px))
        if self.standoff_mm is not None:
            self._seen[self.standoff_mm][laser_id] = spot

    def _expect(self, laser_id: str, standoff_mm: float) -> Expected:
        if self.calibration is not None:
            sensor = CalibratedSensor(self.calibration)
            ((u, v),) = sensor.spot_px(laser_id, np.array([standoff_mm])).tolist()
            return Expected(u, v)
        spot = expected_spot(self.rig, (), laser_id, standoff_mm)
        return Expected(spot.u_px, spot.v_px, spot.u_sd_px, spot.v_sd_px)

    def _points_mm(self, spots: Sequence[Spot], standoff_mm: float) -> FloatArray:
        """(N, 2) x and y, mm, of spots on a square target."""
        camera = self.rig.camera
        values: Mapping[str, float] = {
            **{name: prior.value for name, prior in camera.lens_priors.items()},
            "offset_mm": self.rig.bench.offset_mm.value,
        }
        if self.calibration is not None:
            values = {**values, **self.calibration.geometry()}
        lens = np.array([values[name] for name in camera.lens_priors])
        pixels = np.array([(spot.u_px, spot.v_px) for spot in spots])
        depth_mm = standoff_mm + values["offset_mm"]
        return depth_mm * undistort(lens_model(camera.lens), lens, pixels)

    def _lights(self, dark: Image | None = None) -> Sequence[Spot]:
        """Lights on the lasers' lines in a frame with all lasers off; None: the next one."""
        frame = self.bench.camera.grab().image if dark is None else dark
        return find_spots(frame, scanlines=prior_scanlines(self.rig)).spots
