"""Campaign `simulate`: sensors drawn from a rig's tolerances, each calibrated and used to range."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from workbench.calibration.design.forecast import RANGES_MM
from workbench.calibration.design.simulation import simulate_calibrations
from workbench.calibration.model.parameters import Parameter, ParameterTable, sensor_parameters
from workbench.campaign.kind import Chunk, ChunkSize, Inputs, Summary, Work
from workbench.campaign.moments import Moments, ZHistogram, coverage_chart, coverage_column, z_chart
from workbench.campaign.rig_input import read_rig, rig_of
from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.chart import Axis, Chart, Series, laser_colors
from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.rig import PositiveFloat, Rig
from workbench.model.table import PERCENT, Column, Table
from workbench.model.yamlfile import FileModel

RIG = "rig"
"""Key of the rig file."""


class SimulatedLimits(FileModel):
    """Limits on the simulated calibrations."""

    max_relative_range_sd: PositiveFloat = 0.05
    """A calibration is accepted if no range has a larger stated sd / range (1 sigma)."""
    max_relative_range_error: PositiveFloat = 0.1
    """A sensor is good if no range has a larger error / range; one spot each."""


class Simulate(Work):
    """Drawn sensors, each with the calibration of the batch fit."""

    thing = "calibration"

    kind: Literal["simulate"]
    rig: Path
    """Rig file, relative to the campaign file: its priors are the tolerances."""
    sensors: Annotated[int, Field(ge=1, le=100_000_000)]
    chunk: ChunkSize = 1000
    standoffs_mm: Standoffs
    repeats: Count = 10
    """Captures of each laser at each standoff."""
    ranges_mm: Standoffs = RANGES_MM
    """True ranges of a square target; each laser ranges it once."""
    limits: SimulatedLimits = SimulatedLimits()

    @model_validator(mode="after")
    def _lengths_differ(self) -> Simulate:
        require_different(self.standoffs_mm, "repeats")
        if len({_text(at) for at in self.ranges_mm}) != len(self.ranges_mm):
            raise ValueError("ranges_mm: expected each range once")
        return self

    @property
    def input_keys(self) -> tuple[str, ...]:
        """The rig file."""
        return (RIG,)

    def read_input(self, key: str, base: Path) -> str:
        """Text of the rig file, with what it takes from other files."""
        return read_rig(base / self.rig)

    def count(self, inputs: Inputs) -> int:
        """Number of sensors."""
        return self.sensors

    def run(self, inputs: Inputs, chunk: Chunk, folder: Path) -> pd.DataFrame:
        """One row per sensor: state of the fit, error and stated sd of each parameter and of each range."""
        rng = chunk.rng()
        rig = rig_of(inputs[RIG])
        found = simulate_calibrations(rig, self.standoffs_mm, self.repeats, len(chunk.items), rng)
        ranged = found.ranges(np.array(self.ranges_mm), rng)
        columns: dict[str, FloatArray | BoolArray | IndexArray] = {
            "sensor": np.array(chunk.items),
            "converged": found.fit.converged,
            "noise_scale": found.fit.noise_scale,
            "chi2": found.fit.chi2,
            "degrees_of_freedom": found.fit.degrees_of_freedom,
        }
        for index, parameter in _free(rig):
            columns[f"error.{parameter.name}"] = (found.fit.sensor - found.truth)[:, index]
            columns[f"sd.{parameter.name}"] = found.fit.sd[:, index]
        for k, at in enumerate(self.ranges_mm):
            for laser, laser_id in enumerate(rig.laser_ids):
                columns[f"error_mm.{laser_id}.{_text(at)}"] = ranged.error_mm[:, k, laser]
                columns[f"sd_mm.{laser_id}.{_text(at)}"] = ranged.sd_mm[:, k, laser]
        return pd.DataFrame(columns)

    def summarise(self, inputs: Inputs, frames: Iterable[pd.DataFrame]) -> Summary:
        """Errors, stated deviations and coverage of parameters and ranges; acceptance and yield."""
        totals = _Totals(self, rig_of(inputs[RIG]))
        for frame in frames:
            totals.add(frame)
        return totals.summary()


@dataclass
class _Totals:
    """Sums over the sensors."""

    work: Simulate
    rig: Rig
    sensors: int = 0
    converged: int = 0
    decisions: IndexArray = field(default_factory=lambda: np.zeros((2, 2), np.intp))
    """Numbers of sensors, by accepted (0, 1) and good (0, 1)."""

    def __post_init__(self) -> None:
        self.parameters = {parameter.name: Moments() for _, parameter in _free(self.rig)}
        self.ranges = {
            (laser_id, at): Moments() for laser_id in self.rig.laser_ids for at in self.work.ranges_mm
        }
        self.z_of_parameters, self.z_of_ranges = ZHistogram(), ZHistogram()

    def add(self, frame: pd.DataFrame) -> None:
        """Add the sensors of a chunk."""
        self.sensors += len(frame)
        self.converged += int(frame["converged"].sum())
        for name, moments in self.parameters.items():
            self.z_of_parameters.add(moments.add(frame[f"error.{name}"], frame[f"sd.{name}"]))
        limits = self.work.limits
        accepted, good = frame["converged"].to_numpy(copy=True), np.ones(len(frame), bool)
        for (laser_id, at), moments in self.ranges.items():
            error, sd = (frame[f"{part}.{laser_id}.{_text(at)}"] for part in ("error_mm", "sd_mm"))
            self.z_of_ranges.add(moments.add(error, sd))
            seen = ~np.isnan(error.to_numpy())
            accepted &= ~seen | (sd.to_numpy() <= limits.max_relative_range_sd * at)
            good &= ~seen | (np.abs(error.to_numpy()) <= limits.max_relative_range_error * at)
        np.add.at(self.decisions, (accepted.astype(int), good.astype(int)), 1)

    def summary(self) -> Summary:
        """Tables and charts."""
        accepted = self.decisions[1].sum() / self.sensors
        good = self.decisions[1, 1] / max(self.decisions[1].sum(), 1)
        covered = Moments.together(self.ranges.values())
        limits = self.work.limits
        headline = (
            f"{self.sensors} sensors: {PERCENT * accepted:.4g} % of the calibrations are accepted; of these"
            f" {PERCENT * good:.4g} % range within {PERCENT * limits.max_relative_range_error:g} %;"
            f" intervals of 95 % contain {PERCENT * covered.coverage:.2f} % of the ranges"
        )
        failed = self.sensors - self.converged
        return Summary(
            headline=headline,
            tables=(self._decision_table(), self._range_table(), self._parameter_table()),
            charts=(
                self._error_chart(),
                coverage_chart({laser: self._of(laser) for laser in self.rig.laser_ids}),
                z_chart({"parameters": self.z_of_parameters, "ranges": self.z_of_ranges}),
            ),
            notes=(f"{failed} of {self.sensors} fits did not converge",) if failed else (),
            colors=laser_colors(self.rig.laser_ids),
        )

    def _of(self, laser_id: str) -> dict[float, Moments]:
        return {at: moments for (of, at), moments in self.ranges.items() if of == laser_id}

    def _decision_table(self) -> Table:
        limits = self.work.limits
        names = [
            ("accepted, good", self.decisions[1, 1]),
            ("accepted, not good", self.decisions[1, 0]),
            ("refused, good", self.decisions[0, 1]),
            ("refused, not good", self.decisions[0, 0]),
        ]
        return Table(
            name="decisions",
            title="Decisions on the calibrations",
            columns=(
                Column(key="decision", name=""),
                Column(key="sensors", name="sensors"),
                Column(key="share", name="share", unit="%", format=".3f", scale=PERCENT),
            ),
            rows=tuple((name, int(number), number / self.sensors) for name, number in names),
            caption=(
                f"accepted: no stated sd of a range above {PERCENT * limits.max_relative_range_sd:g} %;"
                f" good: no error of a range above {PERCENT * limits.max_relative_range_error:g} %"
            ),
        )

    def _range_table(self) -> Table:
        return Table(
            name="ranges",
            title="Ranges: error of one range, and its stated uncertainty",
            columns=(
                Column(key="laser", name="laser"),
                Column(key="range_mm", name="range", unit="mm"),
                Column(key="seen", name="seen"),
                Column(key="no_range", name="no range"),
                Column(key="mean_error_mm", name="mean error", unit="mm", format="+.3f"),
                Column(key="rms_error_mm", name="rms error", unit="mm", format=".3f"),
                Column(key="stated_sd_mm", name="stated sd", unit="mm", format=".3f"),
                coverage_column(),
            ),
            rows=tuple(
                (laser, at, m.count, m.infinite, m.mean_error, m.rms_error, m.stated_sd, m.coverage)
                for (laser, at), m in self.ranges.items()
            ),
            caption="stated sd: root mean square; coverage: share of errors within 1.96 stated sd",
        )

    def _parameter_table(self) -> Table:
        rows = []
        for _, parameter in _free(self.rig):
            m = self.parameters[parameter.name]
            error = (m.mean_error, m.rms_error, m.stated_sd)
            rows.append((parameter.name, parameter.unit, parameter.prior.sd, *error, m.coverage))
        return Table(
            name="parameters",
            title="Parameters: error of the estimate, and its stated uncertainty",
            columns=(
                Column(key="parameter", name="parameter"),
                Column(key="unit", name="unit"),
                Column(key="prior_sd", name="prior sd", format="sd"),
                Column(key="mean_error", name="mean error", format="+.2g"),
                Column(key="rms_error", name="rms error", format="sd"),
                Column(key="stated_sd", name="stated sd", format="sd"),
                coverage_column(),
            ),
            rows=tuple(rows),
            caption="as for the ranges",
        )

    def _error_chart(self) -> Chart:
        series = []
        for laser, color in laser_colors(self.rig.laser_ids).items():
            seen = {at: m for at, m in sorted(self._of(laser).items()) if m.count}
            at = tuple(seen)
            rms = tuple(PERCENT * m.rms_error / r for r, m in seen.items())
            stated = tuple(PERCENT * m.stated_sd / r for r, m in seen.items())
            series.append(Series(name=laser, x=at, y=rms, color=color))
            series.append(Series(name=f"{laser}, stated", x=at, y=stated, style="line", color=color))
        return Chart(
            name="errors",
            title="Error of one range (points), and its stated sd (lines); root mean squares",
            x=Axis(label="range", unit="mm", scale="log"),
            y=Axis(label="error / range", unit="%", scale="log"),
            series=tuple(series),
        )


def _free(rig: Rig) -> list[tuple[int, Parameter]]:
    """Parameters of the sensor that are no constants, with their indices."""
    table = ParameterTable(sensor_parameters(rig))
    return [(index, table.parameters[index]) for index in table.free.tolist()]


def _text(length_mm: float) -> str:
    """Length as part of a column's name."""
    return f"{length_mm:.12g}"
