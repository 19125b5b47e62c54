"""Execution of `scan`: captures over an arc, points with intervals, comparison with the stated target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from workbench.calibration.data.observations import Observation, stated_sd, stated_speckle_sd
from workbench.model.arrays import FloatArray
from workbench.model.chart import Axis, Chart, Series
from workbench.model.errors import BadInputError
from workbench.model.fit_event import Rejected
from workbench.model.number_text import counted
from workbench.model.table import PERCENT, Cell, Column, Table
from workbench.model.target import Placement
from workbench.model.trial_event import COVERAGE_FACTOR
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.sensor.scanning import CalibratedHead, ScanPoints
from workbench.trials.results import finish_trial
from workbench.trials.scanning.moves import HeadCapture, sweep
from workbench.trials.scanning.scan_step import ScanStep
from workbench.trials.scanning.surface import SHARED, Deviations, deviations, outline

OFF_BEAM_SD = 5.0
"""Distance of a spot from the beam, in standard deviations, beyond which it is not the head's."""


@dataclass(frozen=True)
class Scan:
    """Points of one scan with spots."""

    placed: Placement
    readings_deg: FloatArray
    """(N,) of the points."""
    position_px: FloatArray
    """(N, 2)"""
    points: ScanPoints
    deviations: Deviations
    deviation_sd_mm: FloatArray
    """(N,) standard uncertainty of the deviations: of point and stated surface."""
    missing: tuple[tuple[float, str], ...]
    """Readings without a point, each with the cause."""
    offset_mm: float
    """Distance of the pinhole behind the reference plane."""

    @property
    def intervals_mm(self) -> tuple[FloatArray, FloatArray]:
        """(N,) ends of the 95 % intervals of the range.

        They are symmetric in the inverse depth, in which errors are normal. The upper end is infinite where
        the interval reaches infinity.
        """
        depth = self.points.position_mm[:, 2] + self.offset_mm
        half = COVERAGE_FACTOR * self.points.sd_mm[:, 2] / depth
        with np.errstate(divide="ignore"):
            far = np.where(half < 1, depth / np.maximum(1 - half, 0.0), np.inf)
        return depth / (1 + half) - self.offset_mm, far - self.offset_mm


def scan(context: Context, name: str, step: ScanStep, placements: Sequence[Placement]) -> str:
    """Scan at the placement and write the points; returns the outcome in one line.

    Raises:
        BadInputError: no head was calibrated.
        WorkbenchError: see `visit_placements`.
    """
    if context.head is None:
        raise BadInputError(
            f"step {name}: no calibrated head; run a procedure with a calibrate_head step before it in the"
            " same command, or name the file of an earlier one in a use_head step"
        )
    head = CalibratedHead(context.head)
    scans = visit_placements(
        context,
        placements,
        lambda placed: scan_of(context, head, placed, sweep(context, placed, step.angles_deg, 1)),
    )
    tables = [table for one in scans for table in result_tables(name, one)]
    finish_trial(context, name, tables, [plan_view(name, context, one) for one in scans])
    found = sum(len(one.readings_deg) for one in scans)
    return f"{counted(found, 'point')}, in {name}-points.csv"


def scan_of(
    context: Context, head: CalibratedHead, placed: Placement, captures: Sequence[HeadCapture]
) -> Scan:
    """Points of the captures at one placement."""
    seen: list[tuple[float, Observation]] = []
    missing: list[tuple[float, str]] = []
    for one in captures:
        if isinstance(one.found, Rejected):
            missing.append((one.reading_deg, one.found.reason))
        else:
            seen.append((one.reading_deg, one.found))
    noise = context.rig.noise
    spots = [spot for _, spot in seen]
    readings = np.array([reading for reading, _ in seen], float)
    position = np.array([(spot.u_px, spot.v_px) for spot in spots], float).reshape(-1, 2)
    sd = np.hypot(stated_sd(spots, noise), stated_speckle_sd(spots, noise))
    points = head.points(readings, position, sd)
    with np.errstate(invalid="ignore"):
        good = np.isfinite(points.position_mm).all(axis=1) & (np.abs(points.across_sd) < OFF_BEAM_SD)
    missing += [
        (
            float(readings[n]),
            f"the spot at u = {u:.1f}, v = {v:.1f} px is not on the beam in front of the sensor",
        )
        for n, (u, v) in zip(np.flatnonzero(~good).tolist(), position[~good].tolist(), strict=True)
    ]
    kept = ScanPoints(
        points.position_mm[good],
        points.covariance_mm2[good],
        points.common[good],
        points.own_covariance_mm2[good],
        points.across_sd[good],
    )
    found = deviations(placed, context.rig.bench, kept.position_mm)
    return Scan(
        placed=placed,
        readings_deg=readings[good],
        position_px=position[good],
        points=kept,
        deviations=found,
        deviation_sd_mm=found.sd_mm(kept, head.covariance_with(SHARED)),
        missing=tuple(sorted(missing)),
        offset_mm=head.offset_mm,
    )


def result_tables(name: str, one: Scan) -> list[Table]:
    """Summary, points, and readings without a point."""
    tables = [summary_table(name, one), point_table(name, one)]
    if one.missing:
        tables.append(
            Table(
                name=f"{name}-missing",
                title="Angles without a point",
                columns=(
                    Column(key="reading_deg", name="reading", unit="deg"),
                    Column(key="cause", name="cause"),
                ),
                rows=one.missing,
                is_detail=True,
            )
        )
    return tables


def summary_table(name: str, one: Scan) -> Table:
    """Table of the deviations from the stated target."""
    error, sd = one.deviations.mm, one.deviation_sd_mm
    own = np.einsum(
        "ni,nij,nj->n", one.deviations.normal, one.points.own_covariance_mm2, one.deviations.normal
    )
    has = len(error) > 0
    row: tuple[Cell, ...] = (
        one.placed.target.shape,
        one.placed.standoff_mm,
        len(error),
        len(one.missing),
        float(error.mean()) if has else None,
        float(error.std(ddof=1)) if len(error) > 1 else None,
        float(np.sqrt(own.mean())) if has else None,
        float(np.abs(error).max()) if has else None,
        float(np.sqrt((sd**2).mean())) if has else None,
        float((np.abs(error) < COVERAGE_FACTOR * sd).mean()) if has else None,
    )
    return Table(
        name=f"{name}-summary",
        title="Scan compared with the stated target",
        columns=(
            Column(key="target", name="target"),
            Column(key="standoff_mm", name="standoff", unit="mm"),
            Column(key="points", name="points"),
            Column(key="missing", name="missing"),
            Column(key="mean_mm", name="mean", unit="mm", format="+.2f"),
            Column(key="scatter_mm", name="scatter", unit="mm", format=".2f"),
            Column(key="own_sd_mm", name="noise", unit="mm", format=".2f"),
            Column(key="largest_mm", name="largest", unit="mm", format=".2f"),
            Column(key="sd_mm", name="stated u", unit="mm", format=".2f"),
            Column(key="inside", name="inside", unit="%", scale=PERCENT, format=".0f"),
        ),
        rows=(row,),
        caption="deviations along the normal, positive: farther than stated; noise: expected by spot and"
        " reading; stated u: with calibration and stated surface; inside: in the 95 % interval",
    )


def point_table(name: str, one: Scan) -> Table:
    """Table of the points, one row each."""
    low, high = one.intervals_mm
    columns = np.column_stack(
        [
            one.readings_deg,
            one.position_px,
            one.points.position_mm,
            one.points.sd_mm[:, 0],
            one.points.sd_mm[:, 2],
            np.sqrt(one.points.own_covariance_mm2[:, 2, 2]),
            low,
            high,
            one.deviations.mm,
            one.deviation_sd_mm,
        ]
    )
    mm = {"unit": "mm", "format": ".2f"}
    return Table(
        name=f"{name}-points",
        title="Points of the scan",
        columns=(
            Column(key="reading_deg", name="reading", unit="deg"),
            Column(key="u_px", name="u", unit="px", format=".2f"),
            Column(key="v_px", name="v", unit="px", format=".2f"),
            Column(key="x_mm", name="x", **mm),
            Column(key="y_mm", name="y", **mm),
            Column(key="range_mm", name="range", **mm),
            Column(key="x_sd_mm", name="sd of x", **mm),
            Column(key="range_sd_mm", name="sd of range", **mm),
            Column(key="range_noise_mm", name="noise of range", **mm),
            Column(key="range_low_mm", name="low", **mm),
            Column(key="range_high_mm", name="high", **mm),
            Column(key="deviation_mm", name="deviation", **mm),
            Column(key="deviation_sd_mm", name="sd of deviation", **mm),
        ),
        rows=tuple(tuple(row) for row in columns.tolist()),
        is_detail=True,
    )


def plan_view(name: str, context: Context, one: Scan) -> Chart:
    """Chart of the points seen from above, with the stated target."""
    x, _, along = one.points.position_mm.T
    margin = 0.05 * hypot(float(np.ptp(x)), 1.0) if len(x) else 1.0
    ends = (float(x.min()) - margin, float(x.max()) + margin) if len(x) else (-1.0, 1.0)
    target_x, target_range = outline(one.placed, context.rig.bench, ends)
    return Chart(
        name=f"{name}-plan",
        title=f"Plan view: {one.placed.target.shape} at {one.placed.standoff_mm:g} mm",
        x=Axis(label="x, right", unit="mm"),
        y=Axis(label="distance from the reference plane", unit="mm"),
        series=(
            Series(
                name="stated target",
                x=tuple(target_x.tolist()),
                y=tuple(target_range.tolist()),
                style="line",
                dashed=True,
            ),
            Series(
                name="points, 1 sigma",
                x=tuple(x.tolist()),
                y=tuple(along.tolist()),
                sd=tuple(one.points.sd_mm[:, 2].tolist()),
            ),
        ),
    )
