"""Campaign `refit`: all sessions of a folder fitted again, with another model or other priors."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.selection.model_terms import fit_calibration
from workbench.calibration.verdict.comparison import compare
from workbench.calibration.verdict.export import calibrate
from workbench.campaign.kind import Chunk, ChunkSize, Inputs, Summary, Work
from workbench.campaign.rig_input import read_rig, rig_of
from workbench.campaign.session_rows import (
    NO_FIT,
    TYPES,
    described,
    listed,
    no_rows,
    row_of,
    session_table,
    verdict_table,
)
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Calibration, Provenance
from workbench.model.captures import check_images, parse_captures, read_captures_file
from workbench.model.chart import Axis, Chart, Series
from workbench.model.errors import BadInputError, WorkbenchError
from workbench.model.laboratory import Day
from workbench.model.nested import fix_parameters
from workbench.model.rig import Rig
from workbench.model.table import PERCENT
from workbench.report.certificate.session_record import read_session
from workbench.session.capture_table import CALIBRATION_TABLE
from workbench.session.capture_table_check import check_captures
from workbench.session.index import SessionSelection, indexed_sessions
from workbench.session.index import Verdict as FitVerdict
from workbench.session.manifest import MANIFEST, load_session_rig

SESSIONS, RIG = "sessions", "rig"


class Refit(Work):
    """Sessions that a query selects, each fitted and compared with the calibration that it has."""

    thing = "session"

    kind: Literal["refit"]
    sessions: Path
    """Folder of sessions, relative to the campaign file."""
    of_rig: str | None = None
    """Name or serial number of a rig; None: all."""
    since: Day | None = None
    until: Day | None = None
    """Last day; with one, sessions made later do not change the campaign."""
    verdict: FitVerdict | None = None
    """Verdict on the last fit of a session."""
    chunk: ChunkSize = 4
    rig: Path | None = None
    """Rig file with other priors; None: that of each session."""
    fix: tuple[str, ...] = ()
    """Parameters to fix at the rig file's value."""
    limits: Acceptance = Acceptance()

    @property
    def input_keys(self) -> tuple[str, ...]:
        """The sessions, and the rig file if there is one."""
        return (SESSIONS,) if self.rig is None else (SESSIONS, RIG)

    def read_input(self, key: str, base: Path) -> str:
        """Text of the rig file, or the selected sessions."""
        if key == RIG and self.rig is not None:
            text = read_rig(base / self.rig)
            fix_parameters(rig_of(text), self.fix)
            return text
        folder = (base / self.sessions).resolve()
        selection = SessionSelection(self.of_rig, self.since, self.verdict, self.until)
        found = [one.name for one in indexed_sessions(folder) if selection.includes(one)]
        if not found:
            raise BadInputError(f"{folder}: expected sessions, none is selected")
        return json.dumps({"folder": str(folder), "names": found})

    def count(self, inputs: Inputs) -> int:
        """Number of sessions."""
        return len(_paths(inputs))

    def run(self, inputs: Inputs, chunk: Chunk, folder: Path) -> pd.DataFrame:
        """One row per session: its calibration before and now, and their largest difference.

        Raises:
            BadInputError: this worker does not see a session; that is no result of the session.
        """
        rig = None if self.rig is None else rig_of(inputs[RIG])
        paths = _paths(inputs)[chunk.items.start : chunk.items.stop]
        if missing := [path for path in paths if not (path / MANIFEST).is_file()]:
            raise BadInputError(
                f"worker {os.uname().nodename}: {missing[0]}: expected a session, found none; share the"
                " folder of sessions with all workers under this path"
            )
        rows = [self._row(path, rig) for path in paths]
        return pd.DataFrame(rows).astype(TYPES)

    def _row(self, path: Path, rig: Rig | None) -> Mapping[str, object]:
        row = row_of(path.name)
        try:
            session = read_session(path)
            row["serial"] = session.rig.serial
            before = session.calibration if session.is_own_calibration else None
            if before is not None:
                row |= described(before, "before")
            now = self._fit(path, rig or load_session_rig(path, bounded=True))
            row |= described(now, "now")
            if before is not None:
                row |= _difference(before, now)
        except WorkbenchError as error:
            row["reason"] = str(error)
        return row

    def _fit(self, path: Path, rig: Rig) -> Calibration:
        table = path / CALIBRATION_TABLE
        if not table.is_file():
            raise BadInputError(f"{path.name}: the session has no {CALIBRATION_TABLE}")
        content = read_captures_file(table)
        rows = parse_captures(table, content)
        check_captures(table, content)
        check_images(table, rows)
        model = fix_parameters(rig, self.fix)
        observations, rejected, boards = observations_of_rows(model, rows)
        if not observations:
            raise BadInputError(f"{path.name}: no spot to fit")
        fitted = fit_calibration(model, observations, rejected, boards)
        return calibrate(fitted, self.limits, _provenance(path, rig))[0]

    def summarise(self, inputs: Inputs, frames: Iterable[pd.DataFrame]) -> Summary:
        """Verdicts before and now, and the sessions that differ most."""
        return _summary(self, inputs, _Totals.of(frames))


def _paths(inputs: Inputs) -> list[Path]:
    found = json.loads(inputs[SESSIONS])
    return [Path(found["folder"]) / name for name in found["names"]]


def _provenance(path: Path, rig: Rig) -> Provenance:
    """Origin without person and time, so that equal data give equal results."""
    return Provenance(
        session=path.name,
        captures_sha256="",
        rig=rig.rig,
        serial=rig.serial,
        command="workbench campaign",
        version="",
        operator="",
        created="",
    )


def _difference(before: Calibration, now: Calibration) -> dict[str, object]:
    """Largest difference of a range, relative to the range; now - before."""
    found = max(compare(before, now).differences, key=lambda one: abs(one.difference_mm / one.range_mm))
    return {
        "difference_mm": found.difference_mm,
        "difference_sd_mm": found.sd_mm,
        "range_mm": found.range_mm,
        "relative_difference": found.difference_mm / found.range_mm,
    }


@dataclass
class _Totals:
    """Sums over the sessions."""

    sessions: int
    verdicts: Counter[tuple[str, str]]
    """Numbers of sessions by verdict before and now."""
    listed: pd.DataFrame
    """Sessions without a fit, then those that differ most."""
    differences: Counter[int]
    """Numbers of sessions by the largest difference, in bins of `BIN` of log10."""

    @classmethod
    def of(cls, frames: Iterable[pd.DataFrame]) -> _Totals:
        """Add up the results of all chunks; at most `MOST_LISTED` sessions are kept."""
        totals = cls(0, Counter(), no_rows(), Counter())
        for frame in frames:
            totals.sessions += len(frame)
            totals.verdicts.update(zip(frame["before"], frame["now"], strict=True))
            size = frame["relative_difference"].abs()
            known = size[size > 0]
            totals.differences.update(np.floor(np.log10(known) / BIN).astype(int).tolist())
            together = pd.concat([totals.listed, frame], ignore_index=True)
            totals.listed = listed(together, together["relative_difference"].abs())
        return totals


BIN = 0.25
"""Width of a bin of differences, in log10."""


def _summary(work: Refit, inputs: Inputs, totals: _Totals) -> Summary:
    fitted = sum(n for (_, now), n in totals.verdicts.items() if now != NO_FIT)
    accepted = sum(n for (_, now), n in totals.verdicts.items() if now == "accepted")
    known = totals.listed["relative_difference"].abs().dropna()
    largest = f"; the largest difference of a range is {PERCENT * known.max():.2g} %" if len(known) else ""
    return Summary(
        headline=f"{fitted} of {totals.sessions} sessions are fitted, {accepted} accepted{largest}",
        tables=(verdict_table(totals.verdicts), session_table(totals.listed, "differ most")),
        charts=tuple(_charts(totals)),
    )


def _charts(totals: _Totals) -> Iterator[Chart]:
    if totals.differences:
        bins = range(min(totals.differences), max(totals.differences) + 1)
        x = tuple(PERCENT * 10.0 ** ((n + 0.5) * BIN) for n in bins)
        y = tuple(totals.differences[n] for n in bins)
        yield Chart(
            name="differences",
            title="Sessions by the largest difference of a range",
            x=Axis(label="difference / range", unit="%", scale="log"),
            y=Axis(label="sessions"),
            series=(Series(name="sessions", x=x, y=y),),
        )
