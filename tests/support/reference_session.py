"""The reference session of this release, copied so that reports may be written beside it."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path

from workbench.model.contents import file_sha256
from workbench.model.event import FitFinished, Record, SessionFinished, SessionRepaired, SessionResumed
from workbench.model.laboratory import Ambient, Laboratory, Party, Recalibration, Standard
from workbench.report.certificate.assemble import Certificate, Sources, certificate_of
from workbench.report.certificate.predecessor import Predecessor
from workbench.report.certificate.session_record import SessionRecord, read_session
from workbench.session.certificate_numbers import AssignedNumber
from workbench.session.journal import JOURNAL, Journal
from workbench.session.manifest import MANIFEST

REFERENCE = Path(__file__).parents[2] / "data/sessions/20261130-085045-reference"
SERIAL = "reference-1"
MARKUP = "<script>alert('x')</script> & <b>Sons</b>"
NUMBER = AssignedNumber(number="2026-0001", session=REFERENCE.name, content_sha256="", assigned="")
LABORATORY = Laboratory.model_validate(
    {
        "format": 1,
        "laboratory": Party(name="Example laboratory", address="1 Example Road"),
        "country": "DE",
        "customer": Party(name=MARKUP, address="2 Sample Street"),
        "received": "2026-11-25",
        "authorised_by": "A. Example",
        "standards": (
            Standard.model_validate(
                {
                    "name": "steel rule",
                    "serial": "SR-17",
                    "certificate": "12345",
                    "calibrated": "2026-05-04",
                    "expanded_uncertainty": 0.1,
                    "unit": "mm",
                }
            ),
        ),
        "ambient": Ambient(temperature_c=(20.5, 22.0)),
        "warm_up_min": 30,
        "target_material": "matt white card",
        "recalibration": Recalibration(months=12, reason="agreed"),
    }
)


DAY = timedelta(days=1)
DAY_NS = 86_400 * 10**9
BEGAN = datetime(2026, 11, 30, 8, 50, 45, tzinfo=UTC)


def copied(folder: Path, name: str = REFERENCE.name, frames: bool = False) -> Path:
    """Copy of the session in a folder of sessions, without frames unless they are asked for."""
    ignored = shutil.ignore_patterns() if frames else shutil.ignore_patterns("frames", "set-aside")
    return Path(shutil.copytree(REFERENCE, folder / name, ignore=ignored))


def repeated(folder: Path, name: str, days: int, frames: bool = False) -> Path:
    """Another session with the same results, which began some days later."""
    session = copied(folder, name, frames)
    manifest, journal, calibration = (session / one for one in (MANIFEST, JOURNAL, "calibration.yaml"))
    recorded = file_sha256(calibration)
    first, later = (f"{BEGAN + n * DAY:%Y-%m-%dT%H:%M:%S%z}" for n in (0, days))
    for path in (manifest, calibration):
        path.write_text(path.read_text().replace(first, later))
    text = journal.read_text().replace(recorded, file_sha256(calibration))
    start, *others = text.splitlines(keepends=True)
    record = Record.model_validate_json(start)
    moved = record.model_copy(update={"time_ns": record.time_ns + days * DAY_NS})
    journal.write_text("".join((moved.model_dump_json() + "\n", *others)))
    return session


def repair(session: Path, verdict: str) -> None:
    """Repair the session: its placements are fitted again, with this verdict and without a calibration."""
    caller = {"operator": "operator", "command": "workbench repair", "created": "2026-11-30T10:00:00+0000"}
    journal, before = Journal.reopen(session)
    last = [one for one in before if isinstance(one.event, FitFinished)][-1]
    reasons = ("too few standoffs",) if verdict == "refused" else ()
    fit = FitFinished.model_validate({**dict(last.event), "verdict": verdict, "reasons": reasons})
    decision = {"leave_out": ("reference.3/150mm",), "reason": "test"}
    with journal:
        journal.append(SessionRepaired.model_validate(caller | decision))
        journal.append(SessionResumed.model_validate(caller | {"from_n": last.n}))
        journal.append(fit)
        journal.append(SessionFinished(exit_code=3 if reasons else 0, message="; ".join(reasons)))


def edit_calibration(session: Path) -> None:
    """Change a number of the session's calibration file, which stays a valid calibration."""
    path = session / "calibration.yaml"
    text = path.read_text()
    changed = text.replace("max_relative_range_sd: 0.", "max_relative_range_sd: 0.1", 1)
    assert changed != text
    path.write_text(changed)


def record(folder: Path = REFERENCE) -> SessionRecord:
    return read_session(folder)


def certificate(
    laboratory: Laboratory = LABORATORY,
    predecessor: Predecessor | None = None,
    session: SessionRecord | None = None,
) -> Certificate:
    return certificate_of(Sources(session or record(), laboratory, predecessor)).numbered(NUMBER)
