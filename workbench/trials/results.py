"""Results of a trial: every table as a CSV file, tables and charts in the journal."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from workbench.model.chart import Chart
from workbench.model.event import TrialFinished
from workbench.model.table import Table
from workbench.procedure.engine.context import Context
from workbench.session.capture_table import TRIAL_TABLE, write_capture_table
from workbench.session.files import write_record


def write_readings(context: Context, name: str, readings: pd.DataFrame) -> None:
    """Write the readings of a trial, one row each, to `<name>.csv` in the session folder (docs/trials.md).

    Raises:
        StoppedError: the disk is full or cannot be written.
    """
    content = readings.to_csv(index=False, lineterminator="\n").encode()
    write_record(context.session_dir / f"{name}.csv", content)


def finish_trial(context: Context, name: str, tables: Sequence[Table], charts: Sequence[Chart] = ()) -> None:
    """Write the tables and the trial's captures into the session folder, and journal the results.

    Args:
        context: session.
        name: name of the step.
        tables: tables, each written to `<table name>.csv` with the column keys as header.
        charts: charts, shown by the recording and written as figures.

    Raises:
        StoppedError: the disk is full or cannot be written.
    """
    # A turned head is another ray: its captures must not be ranged as those of a fixed laser.
    captures = [one for one in context.captures if one.purpose == "trial" and one.head_deg is None]
    if captures:
        write_capture_table(context.session_dir / TRIAL_TABLE, captures)
    for table in tables:
        write_record(context.session_dir / f"{table.name}.csv", table.to_csv().encode())
    context.emit(TrialFinished(trial=name, tables=tuple(tables), charts=tuple(charts)))
