"""Certificate of a session: complete, equal for equal sources, with a fingerprint of what it states."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.reference_session import LABORATORY, REFERENCE, certificate, copied, record
from workbench.model.laboratory import Laboratory
from workbench.report.certificate.assemble import Sources, fingerprint
from workbench.report.certificate.predecessor import load_predecessor
from workbench.report.certificate.session_record import read_session

DATA = REFERENCE.parents[1]


def test_sections_are_complete() -> None:
    assert [section.key for section in certificate().document.sections] == [
        "laboratory",
        "sensor",
        "conditions",
        "standards",
        "procedure",
        "range_uncertainty",
        "decisions",
        "calibration",
        "validation",
        "trial-reference.6",
        "change",
        "recalibration",
        "exceptions",
        "data",
        "statements",
    ]


def test_equal_sources_give_equal_json() -> None:
    first, second = (json.dumps(certificate().as_json()) for _ in range(2))
    assert first == second
    found = json.loads(first)
    assert (found["number"], found["serial"]) == ("2026-0001", "reference-1")
    assert [one["range_mm"] for one in found["uncertainties"]][:2] == [100, 150]


@pytest.mark.parametrize("name", ["session-0.1.0", "simulation-0.1.0"])
def test_old_sessions_and_sessions_without_calibration_are_reported(name: str) -> None:
    found = certificate(session=read_session(DATA / name))
    has_fit = name == "session-0.1.0"
    assert found.document.title == ("Calibration certificate" if has_fit else "Measurement report")
    assert bool(found.uncertainties) == has_fit


def test_the_fingerprint_follows_everything_that_is_stated(tmp_path: Path) -> None:
    session = record()
    first = fingerprint(Sources(session, LABORATORY))
    assert fingerprint(Sources(record(), LABORATORY)) == first
    with_predecessor = Sources(session, LABORATORY, load_predecessor(REFERENCE / "calibration.yaml"))
    changed = copied(tmp_path)
    with (changed / "journal.jsonl").open("ab") as file:
        file.write(b'{"n": 1')
    others = {
        fingerprint(Sources(session, Laboratory(format=1))),
        fingerprint(with_predecessor),
        fingerprint(Sources(read_session(changed), LABORATORY)),
    }
    assert len(others | {first}) == 4
