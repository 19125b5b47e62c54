"""A made-up session as the workbench leaves it: frames on disk, records of a calibration and a trial."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import pi
from pathlib import Path

import cv2
import numpy as np

from workbench.model import event as ev
from workbench.model.calibration import TermSummary
from workbench.model.prior import Prior
from workbench.model.reading_chart import error_chart
from workbench.model.rig import CameraSpec, LaserSpec, Rig
from workbench.model.spot import Spot
from workbench.model.target import FlatTarget, Placement
from workbench.trials.accuracy.statistics import AccuracyRow
from workbench.trials.accuracy.tables import accuracy_table

SESSION = "20261105T101500-made-up"
LASERS = {"L1": -60.0, "L2": -30.0, "L3": 30.0, "L4": 60.0}
STANDOFFS = (200.0, 500.0, 1250.0, 3000.0)
TRIAL_STANDOFFS = (300.0, 800.0, 2000.0)
REPEATS = 2
READINGS = 3
F_PX, CX_PX, CY_PX = 541.0, 358.2, 239.5
START_NS = 1_790_000_000_000_000_000
BAD = ("L3", 1250.0)
"""The residual that is made too large for its standard deviation."""
PLACEMENTS = {standoff_mm: f"p{n}" for n, standoff_mm in enumerate(STANDOFFS, start=1)}
"""Keys of the placements of the calibration."""
TRIAL = "accuracy-flat"
SENSOR_CHART = "Error of the sensor alone"
"""Title of the second chart of the trial."""
WIDTH_PX = 1.3


def a_rig() -> Rig:
    """Four horizontal lasers and a camera of the thesis's size."""
    zero = Prior(value=0.0, sd=0.005)
    return Rig(
        format=1,
        rig="made-up",
        serial="7",
        camera=CameraSpec(
            width_px=640,
            height_px=480,
            f_px=Prior(value=533.3, sd=26.7),
            cx_px=Prior(value=319.5, sd=40.0),
            cy_px=Prior(value=239.5, sd=40.0),
            k1=Prior(value=0.0, sd=0.3),
        ),
        lasers=tuple(
            LaserSpec(id=name, axis="u", x_mm=Prior(value=x, sd=0.2), y_mm=Prior(value=0.0, sd=0.2), tx=zero)
            for name, x in LASERS.items()
        ),
    )


@dataclass
class MadeUpSession:
    """Writes frames into `folder` and counts records."""

    folder: Path
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(3))
    n: int = 0
    captures: int = 0
    spots: dict[str, Spot] = field(default_factory=dict)
    """Spots of the last capture by their lasers, which a capture of all does not know yet."""

    def records(self) -> Iterator[ev.Record]:
        """The whole session, first record to last."""
        yield self._record(
            ev.SessionStarted(session=SESSION, rig="made-up", procedures=("calibrate-flat", "accuracy-flat"))
        )
        yield from self._calibration()
        yield from self._accuracy()
        yield self._record(ev.SessionFinished(exit_code=0, message="done"))

    def _calibration(self) -> Iterator[ev.Record]:
        name = "calibrate-flat"
        yield self._record(ev.ProcedureStarted(procedure=name, title="Calibrate on a flat target", steps=6))
        for i, standoff in enumerate(STANDOFFS, start=1):
            yield from self._step(name, i, f"Capture at {standoff:g} mm", len(LASERS) * REPEATS)
            yield from self._placed(PLACEMENTS[standoff], standoff)
            for laser in LASERS:
                for repeat in range(REPEATS):
                    yield from self._capture("calibration", (laser,), PLACEMENTS[standoff], standoff, repeat)
            yield self._record(ev.PlacementFinished(key=PLACEMENTS[standoff]))
            yield self._record(ev.StepFinished(procedure=name, index=i, outcome="8 captures"))
        yield self._record(
            ev.StandoffAdvised(
                placements=4,
                relative_range_sd=0.021,
                limit=0.03,
                next_standoff_mm=4500.0,
                then_relative_range_sd=0.018,
            )
        )
        yield from self._step(name, 5, "Fit", 0)
        yield self._record(a_fit())
        yield self._record(ev.StepFinished(procedure=name, index=5, outcome="accepted"))
        yield from self._step(name, 6, "Export", 0)
        yield self._record(ev.CalibrationExported(path="calibration.yaml", sha256="0" * 64))
        yield self._record(ev.StepFinished(procedure=name, index=6, outcome="calibration.yaml"))

    def _accuracy(self) -> Iterator[ev.Record]:
        name = TRIAL
        readings = []
        yield self._record(ev.ProcedureStarted(procedure=name, title="Accuracy on a flat target", steps=3))
        for i, standoff in enumerate(TRIAL_STANDOFFS, start=1):
            yield from self._step(name, i, f"Range at {standoff:g} mm", READINGS)
            yield from self._placed(f"t{i}", standoff)
            for reading in range(READINGS):
                yield from self._capture("trial", tuple(LASERS), f"t{i}", standoff, reading)
                readings.append(self._reading(standoff, reading))
                yield self._record(readings[-1])
            yield self._record(ev.StepFinished(procedure=name, index=i, outcome="3 readings"))
        table = accuracy_table(name, [_row(standoff) for standoff in TRIAL_STANDOFFS])
        errors = error_chart(f"{name}-errors", readings)
        sensor = errors.model_copy(
            update={"name": f"{name}-sensor", "title": SENSOR_CHART, "series": errors.series[-1:]}
        )
        yield self._record(ev.TrialFinished(trial=name, tables=(table,), charts=(errors, sensor)))

    def _record(self, event: ev.Event) -> ev.Record:
        self.n += 1
        return ev.Record(n=self.n - 1, time_ns=START_NS + (self.n - 1) * 100_000_000, event=event)

    def _step(self, procedure: str, index: int, title: str, shots: int) -> Iterator[ev.Record]:
        yield self._record(
            ev.StepStarted(procedure=procedure, index=index, step=f"s{index}", title=title, shots=shots)
        )

    def _placed(self, key: str, standoff: float) -> Iterator[ev.Record]:
        placement = Placement(key=key, standoff_mm=standoff, target=FlatTarget(yaw_deg=2.0))
        yield self._record(ev.TargetPlaced(placement=placement))
        yield self._record(
            ev.ExposureSet(key=key, exposure=standoff, unit="us", peak=0.7, verdict="good", trials=2)
        )

    def _capture(
        self, purpose: str, lasers: tuple[str, ...], placement: str, standoff: float, repeat: int
    ) -> Iterator[ev.Record]:
        self.captures += 1
        key = f"c{self.captures:04d}"
        self.spots = {laser: self._spot(laser, standoff) for laser in lasers}
        spots = tuple(self.spots.values())
        if len(lasers) > 1:
            spots = tuple(replace(spot, laser_id=None) for spot in spots)
        yield self._record(
            ev.CaptureTaken(
                key=key,
                purpose="trial" if purpose == "trial" else "calibration",
                laser_id=lasers[0] if len(lasers) == 1 else "all",
                placement_key=placement,
                standoff_mm=standoff,
                repeat=repeat,
                on=self._frame(f"{key}-on", spots),
                off=self._frame(f"{key}-off", ()),
            )
        )
        yield self._record(ev.SpotsFound(key=key, spots=spots))

    def _spot(self, laser: str, standoff: float) -> Spot:
        du, dv = self.random.normal(0.0, 0.05, 2)
        peak_dn = 210.0 - standoff / 40
        return Spot(
            laser_id=laser,
            u_px=CX_PX + F_PX * LASERS[laser] / standoff + du,
            v_px=CY_PX + dv,
            u_sd_px=0.05,
            v_sd_px=0.05,
            flux_dn=peak_dn * 2 * pi * WIDTH_PX**2,
            width_px=WIDTH_PX,
            peak_dn=peak_dn,
        )

    def _frame(self, name: str, spots: tuple[Spot, ...]) -> ev.FrameRef:
        rows, columns = np.mgrid[0:480, 0:640]
        image = (
            np.full((480, 640), 12.0)
            + 20.0 * (columns + rows) / 1120
            + self.random.normal(0, 1.5, (480, 640))
        )
        for spot in spots:
            square = (columns - spot.u_px) ** 2 + (rows - spot.v_px) ** 2
            image += spot.peak_dn * np.exp(-square / (2 * spot.width_px**2))
        png = cv2.imencode(".png", np.clip(image, 0, 255).astype(np.uint8))[1].tobytes()
        path = self.folder / "frames" / f"{name}.png"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(png)
        time_ns = START_NS + self.n * 100_000_000 - 30_000_000
        return ev.FrameRef(path=f"frames/{name}.png", sha256=hashlib.sha256(png).hexdigest(), time_ns=time_ns)

    def _reading(self, standoff: float, reading: int) -> ev.ReadingTaken:
        ranges = []
        for laser, x in LASERS.items():
            sigma = 0.05 * standoff**2 / (F_PX * abs(x))
            measured = standoff + float(self.random.normal(0.0, sigma))
            spot = self.spots[laser]
            ranges.append(
                ev.LaserRange(
                    laser_id=laser, range_mm=measured, sigma_mm=sigma, u_px=spot.u_px, v_px=spot.v_px
                )
            )
        nearest = min(ranges, key=lambda one: one.range_mm)
        return ev.ReadingTaken(
            trial=TRIAL,
            scene=f"flat-{standoff:g}",
            standoff_mm=standoff,
            reading=reading,
            status="done",
            range_mm=nearest.range_mm,
            sigma_mm=nearest.sigma_mm,
            lasers=tuple(ranges),
        )


def a_fit() -> ev.FitFinished:
    """A plausible fit with one residual that its standard deviation does not explain."""
    return ev.FitFinished(
        parameters=tuple(_parameters()),
        residuals=tuple(_residuals()),
        rms_px=0.061,
        observations=64,
        rejected=(ev.Rejected(source="frames/a-on.png", reason="L3 at 125 mm: no spot"),),
        verdict="accepted",
        reasons=("range uncertainty stays below 1 % up to 2 m",),
        warnings=("f_px is determined by the prior: the data know only its product with the baselines",),
        terms=(
            TermSummary(
                name="k2", verdict="open", p_value=0.91, log10_bayes_factor=-0.9, range_shift_sd=0.02
            ),
        ),
        left_out=(
            ev.CrossValidatedPlacement(
                placement=PLACEMENTS[BAD[1]],
                standoff_mm=BAD[1],
                error_mm=2.5,
                sd_mm=0.5,
                lasers=(ev.LaserError(laser_id=BAD[0], error_mm=4.25, sd_mm=0.6),),
                alarm=True,
            ),
        ),
    )


def _parameters() -> Iterator[ev.ParameterRecord]:
    yield _parameter("f_px", "px", (F_PX, 22.0), (533.3, 26.7), 0.32, "joint")
    yield _parameter("cx_px", "px", (CX_PX, 2.1), (319.5, 40.0), 0.997, "data")
    yield _parameter("cy_px", "px", (CY_PX, 39.8), (239.5, 40.0), 0.01, "prior")
    for laser, x in LASERS.items():
        yield _parameter(f"{laser}.x_mm", "mm", (x + 0.05, 0.19), (x, 0.2), 0.1, "prior")
        yield _parameter(f"{laser}.tx", "1", (0.0011, 0.0008), (0.0, 0.005), 0.97, "data")


def _parameter(
    name: str, unit: str, value: tuple[float, float], prior: tuple[float, float], share: float, by: str
) -> ev.ParameterRecord:
    return ev.ParameterRecord.model_validate(
        {
            "name": name,
            "unit": unit,
            "value": value[0],
            "sd": value[1],
            "prior_value": prior[0],
            "prior_sd": prior[1],
            "data_share": share,
            "determined_by": by,
        }
    )


def _residuals() -> Iterator[ev.ResidualRecord]:
    random = np.random.default_rng(5)
    for laser in LASERS:
        for standoff in STANDOFFS:
            du, dv = random.normal(0.0, 0.04, 2).tolist()
            yield ev.ResidualRecord(
                laser_id=laser,
                standoff_mm=standoff,
                u_px=0.24 if (laser, standoff) == BAD else du,
                v_px=dv,
                u_sd_px=0.05,
                v_sd_px=0.05,
                placement=PLACEMENTS[standoff],
            )


def _row(standoff: float) -> AccuracyRow:
    sd = 0.05 * standoff**2 / (F_PX * 60.0)
    return AccuracyRow(
        standoff_mm=standoff,
        readings=READINGS,
        mean_error_mm=0.3 * sd,
        max_error_mm=1.2 * sd,
        min_error_mm=-0.9 * sd,
        sd_mm=sd,
        range_sd_mm=1.1 * sd,
        reference_sd_mm=0.3,
    )
