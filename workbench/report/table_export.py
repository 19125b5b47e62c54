"""Tables of a session for other programs: tidy data frames, and a dictionary of their columns."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from workbench.model.calibration import Parameters, load_calibration
from workbench.model.event import FitFinished, TrialFinished
from workbench.model.fit_tables import cross_validation_table
from workbench.model.table import Table
from workbench.report.certificate.session_record import recorded_calibration
from workbench.report.data_dictionary import MEANINGS
from workbench.report.frames import PARAMETER_COLUMNS, frame_of_table
from workbench.report.session_frames import captures_frame, readings_frame, residuals_frame, spots_frame
from workbench.session.journal import read_journal
from workbench.session.state import effective

DICTIONARY = "dictionary"
DICTIONARY_COLUMNS = ["table", "column", "type", "unit", "meaning"]


def session_tables(folder: Path) -> dict[str, pd.DataFrame]:
    """Tables of a session by name, and `dictionary`, which describes every column of the others.

    Raises:
        BadInputError: journal or calibration is damaged, or the calibration has changed since the session.
    """
    events = [record.event for record in effective(read_journal(folder))]
    tables = {
        "captures": captures_frame(folder, events),
        "spots": spots_frame(events),
        "residuals": residuals_frame(events),
        "readings": readings_frame(events),
    }
    if calibration := recorded_calibration(folder, events):
        tables |= _calibration_tables(load_calibration(calibration).laser_ranger.parameters)
    trials = [event for event in events if isinstance(event, TrialFinished)]
    fits = [event for event in events if isinstance(event, FitFinished)]
    checked = [cross_validation_table(fits[-1].left_out)] if fits and fits[-1].left_out else []
    others = {table.name: table for table in (*checked, *(one for trial in trials for one in trial.tables))}
    rows = [row for name, frame in tables.items() for row in _described(name, frame)]
    rows += [row for table in others.values() for row in _described_table(table)]
    dictionary = pd.DataFrame(rows, columns=DICTIONARY_COLUMNS)
    tables |= {name: frame_of_table(table) for name, table in others.items()}
    return tables | {DICTIONARY: dictionary}


def _calibration_tables(found: Parameters) -> dict[str, pd.DataFrame]:
    """Parameters, and their covariance with one row for each pair."""
    values: Mapping[str, object] = {
        name: getattr(found, _FIELD.get(name, name)) for name in PARAMETER_COLUMNS
    }
    first, second = np.triu_indices(len(found.names))
    names = np.array(found.names)
    covariance = {
        "parameter_1": names[first],
        "parameter_2": names[second],
        "covariance": found.covariance_array[first, second],
    }
    return {
        "parameters": pd.DataFrame({"parameter": found.names, **values}),
        "covariance": pd.DataFrame(covariance),
    }


_FIELD = {"unit": "units", "value": "values"}
"""Fields of a calibration file with another name than the column."""


def _described(name: str, frame: pd.DataFrame) -> list[tuple[str, str, str, str, str]]:
    return [
        (name, column, str(frame[column].dtype), *MEANINGS[name][column])
        for column in map(str, frame.columns)
    ]


def _described_table(table: Table) -> list[tuple[str, str, str, str, str]]:
    """Columns of a table of a fit or a trial; values are unscaled."""
    frame = frame_of_table(table)
    return [
        (
            table.name,
            column.key,
            str(frame[column.key].dtype),
            column.unscaled_unit,
            f"{column.name or column.key} ({table.title})",
        )
        for column in table.columns
    ]
