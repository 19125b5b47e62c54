"""Results of sessions: one row for each, the same columns for all kinds of campaigns, and their tables."""

from __future__ import annotations

from collections import Counter

import pandas as pd

from workbench.model.calibration import Calibration
from workbench.model.table import PERCENT, Column, Table

NO_FIT, NONE_BEFORE = "not fitted", "none"
"""States of a calibration in the columns `now` and `before`."""
MOST_LISTED = 20
"""Largest number of sessions in the table; the results of all are in the chunks."""
TYPES = {
    "session": "string",
    "serial": "string",
    "before": "string",
    "now": "string",
    "reason": "string",
    "rms_px_before": "float64",
    "rms_px_now": "float64",
    "relative_sd_before": "float64",
    "relative_sd_now": "float64",
    "difference_mm": "float64",
    "difference_sd_mm": "float64",
    "range_mm": "float64",
    "relative_difference": "float64",
}
"""Columns of the results, with their types."""


def row_of(session: str, serial: str = "") -> dict[str, object]:
    """Row of a session without a calibration, to be completed."""
    row: dict[str, object] = dict.fromkeys(TYPES)
    return row | {"session": session, "serial": serial, "before": NONE_BEFORE, "now": NO_FIT, "reason": ""}


def described(calibration: Calibration, when: str) -> dict[str, object]:
    """Columns of a calibration `before` or `now`."""
    found = calibration.laser_ranger
    return {
        when: found.fit.verdict,
        f"rms_px_{when}": found.fit.rms_px,
        f"relative_sd_{when}": found.validity.max_relative_range_sd,
    } | ({"reason": "; ".join(found.fit.reasons)} if when == "now" else {})


def listed(frame: pd.DataFrame, size: pd.Series[float]) -> pd.DataFrame:
    """At most `MOST_LISTED` rows: those without a fit, then those of the largest size; NaN sizes last."""
    ranked = size.where(frame["now"] != NO_FIT, float("inf")).fillna(-1.0)
    order = ranked.sort_values(ascending=False, kind="stable").index
    return frame.loc[order[:MOST_LISTED]].reset_index(drop=True)


def no_rows() -> pd.DataFrame:
    """Results of no session."""
    return pd.DataFrame({name: [] for name in TYPES}).astype(TYPES)


def verdict_table(verdicts: Counter[tuple[str, str]]) -> Table:
    """Numbers of sessions by verdict before and now."""
    return Table(
        name="verdicts",
        title="Verdicts before and now",
        columns=(
            Column(key="before", name="before"),
            Column(key="now", name="now"),
            Column(key="sessions", name="sessions"),
        ),
        rows=tuple((*key, number) for key, number in sorted(verdicts.items())),
    )


def session_table(sessions: pd.DataFrame, order: str) -> Table:
    """Rows of sessions; `order` states which, and in which order."""
    columns = (
        Column(key="session", name="session"),
        Column(key="before", name="before"),
        Column(key="now", name="now"),
        Column(key="rms_px_before", name="rms before", unit="px", format=".3f"),
        Column(key="rms_px_now", name="rms now", unit="px", format=".3f"),
        Column(key="relative_sd_before", name="sd before", unit="%", format=".2f", scale=PERCENT),
        Column(key="relative_sd_now", name="sd now", unit="%", format=".2f", scale=PERCENT),
        Column(key="difference_mm", name="difference", unit="mm", format="+.2f"),
        Column(key="range_mm", name="at", unit="mm", format=".0f"),
        Column(key="reason", name="reason"),
    )
    shown = [one for one in columns if one.key in ("session", "now") or _is_used(sessions[one.key])]
    rows = sessions[[column.key for column in shown]]
    return Table(
        name="sessions",
        title=f"Sessions without a fit, then those that {order}",
        columns=tuple(shown),
        rows=tuple(tuple(row) for row in rows.itertuples(index=False)),
        caption=(
            "sd: largest stated relative sd of a range; difference: now - before, largest in relation to the"
            f" range. At most {MOST_LISTED} sessions; the files in chunks/ have all"
        ),
    )


def _is_used(values: pd.Series[float]) -> bool:
    """Whether a column has a value in any row."""
    return not values.isin(["", NONE_BEFORE]).where(values.notna(), other=True).all()
