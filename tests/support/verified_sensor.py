"""Sessions that verify the reference sensor, a month apart, with errors that a test states."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from tests.support.reference_session import REFERENCE, copied
from workbench.model import event as ev
from workbench.model.arrays import FloatArray
from workbench.model.contents import file_sha256
from workbench.session.journal import JOURNAL
from workbench.session.manifest import MANIFEST

FIRST = datetime(2027, 1, 4, 9, tzinfo=UTC)
MONTH = timedelta(days=30)
DISTANCES_MM = (200.0, 400.0, 800.0)
READINGS = 4


def verified_sensor(folder: Path, errors: FloatArray, seed: int = 1) -> None:
    """Write the reference session, and one verification a month.

    Args:
        folder: folder of sessions.
        errors: (sessions, distances) mean relative errors.
        seed: of the scatter of the readings, 0.0002 of the range.
    """
    copied(folder)
    random = np.random.default_rng(seed)
    for n, of_session in enumerate(errors.tolist()):
        scatter = random.normal(0, 0.0002, (len(of_session), READINGS))
        scatter -= scatter.mean(axis=1, keepdims=True)
        write_verification(folder, FIRST + n * MONTH, (np.array(of_session)[:, None] + scatter).tolist())


def write_verification(folder: Path, when: datetime, errors: Sequence[Sequence[float]]) -> Path:
    """Write a session with readings of relative errors, one row for each distance."""
    session = folder / f"{when:%Y%m%d-%H%M%S}-verify"
    session.mkdir()
    text = (
        (REFERENCE / MANIFEST).read_text().replace("2026-11-30T08:50:45+0000", f"{when:%Y-%m-%dT%H:%M:%S%z}")
    )
    (session / MANIFEST).write_text(text)
    calibration = ev.CalibrationLoaded(
        file="calibration.yaml",
        path="calibration.yaml",
        sha256=file_sha256(REFERENCE / "calibration.yaml"),
        made="",
        age_days=None,
    )
    readings = [
        reading(mm, n, error)
        for mm, row in zip(DISTANCES_MM, errors, strict=False)
        for n, error in enumerate(row)
    ]
    events: list[ev.Event] = [
        ev.SessionStarted(session=session.name, rig="reference-emulated", procedures=("verify",)),
        calibration,
        *readings,
        ev.SessionFinished(exit_code=0, message="done"),
    ]
    time_ns = int(when.timestamp() * 1e9)
    lines = [ev.Record(n=n, time_ns=time_ns + n, event=one).model_dump_json() for n, one in enumerate(events)]
    (session / JOURNAL).write_text("".join(f"{line}\n" for line in lines))
    return session


def reading(standoff_mm: float, number: int, error: float) -> ev.ReadingTaken:
    return ev.ReadingTaken(
        trial="verify.1",
        scene=f"{standoff_mm:g}",
        standoff_mm=standoff_mm,
        reading=number,
        status="done",
        range_mm=standoff_mm * (1 + error),
        sigma_mm=standoff_mm * 0.001,
        reference_sd_mm=0.3,
        lasers=(),
    )
