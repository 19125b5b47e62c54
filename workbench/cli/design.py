"""`workbench design`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from workbench.calibration.design.forecast import CalibrationForecast, forecast
from workbench.calibration.design.standoffs import best_standoffs
from workbench.calibration.design.tables import parameter_forecast_table, range_forecast_table
from workbench.calibration.verdict.observability import direction_lines
from workbench.cli.console import result_console
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig, load_rig
from workbench.report.terminal_table import TerminalTable

COUNT = 11
"""Default number of standoffs: that of procedures/calibrate-flat.yaml."""


def design_calibration(
    rig_path: Path, standoffs: str | None, count: int | None, repeats: int, as_json: bool
) -> None:
    """Print the forecast of a calibration: JSON on standard output, tables on standard error.

    Raises:
        BadInputError: the rig file or an option is wrong.
    """
    rig = load_rig(rig_path)
    if standoffs is not None and count is not None:
        raise BadInputError("--count: expected either --standoffs or --count, got both")
    if standoffs is None:
        chosen = best_standoffs(rig, COUNT if count is None else count, repeats)
    else:
        chosen = _given(rig, standoffs)
    result = forecast(rig, chosen, repeats)
    if as_json:
        print(json.dumps(asdict(result)))
    _print(rig, result, proposed=standoffs is None, as_json=as_json)


def _given(rig: Rig, text: str) -> tuple[float, ...]:
    """Parse standoffs separated by commas."""
    nearest, farthest = rig.bench.reach_mm
    found: list[float] = []
    for part in text.split(","):
        try:
            standoff = float(part)
        except ValueError:
            raise BadInputError(
                f"--standoffs: expected millimetres separated by commas, such as 125,160,210, got {part!r}"
            ) from None
        if not nearest <= standoff <= farthest:
            raise BadInputError(
                f"--standoffs: expected {nearest:g} to {farthest:g} mm (bench.reach_mm of the rig file),"
                f" got {part.strip()}"
            )
        if standoff in found:
            raise BadInputError(
                f"--standoffs: expected every standoff once, got {standoff:g} twice; raise --repeats instead"
            )
        found.append(standoff)
    return tuple(found)


def _print(rig: Rig, result: CalibrationForecast, proposed: bool, as_json: bool) -> None:
    console = result_console(as_json)
    standoffs = ", ".join(f"{s:g}" for s in result.standoffs_mm)
    console.print(
        f"{'proposed standoffs' if proposed else 'standoffs'} (mm): {standoffs};"
        f" {result.repeats} readings of each laser",
        highlight=False,
    )
    console.print(TerminalTable(parameter_forecast_table(result.parameters)))
    console.print(TerminalTable(range_forecast_table(rig.laser_ids, result.ranges)))
    console.print(
        f"largest range uncertainty from 0.1 to 5 m: {100 * result.worst_relative_sd:.2f} %,"
        f" due to the calibration alone {100 * result.worst_relative_sd_of_calibration:.2f} % (1 sigma)",
        highlight=False,
    )
    for note in (*result.notes, *direction_lines(result.directions)):
        console.print(f"note: {note}", highlight=False)
