"""Inputs of a certificate with their hashes."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime
from pathlib import Path

from tests.support.reference_session import REFERENCE, certificate, copied, record
from workbench.report.certificate.dcc import certificate_xml
from workbench.report.certificate.reproduction import reproduction_section
from workbench.report.certificate.session_record import read_session
from workbench.session.journal import JOURNAL, Journal


def test_every_input_has_the_sha256_of_its_file() -> None:
    section = reproduction_section(record())
    found = {row["what"]: row["sha256"] for row in section.tables[0].records()}
    for name in ("session.yaml", "journal.jsonl", "captures.csv", "calibration.yaml"):
        assert found[name] == hashlib.sha256((REFERENCE / name).read_bytes()).hexdigest()
    rig = record().manifest.rig.text.encode()
    assert found["rig file rig.yaml"] == hashlib.sha256(rig).hexdigest()
    assert "60 frames, list of their sha256" in found


def test_the_last_hash_of_the_journal_is_stated_also_in_the_signed_file(tmp_path: Path) -> None:
    session = copied(tmp_path)
    journal, before = Journal.reopen(session)
    with journal:
        journal.append(before[-1].event)
    found = read_session(session)
    rows = {row["what"]: row["sha256"] for row in reproduction_section(found).tables[0].records()}
    content = (session / JOURNAL).read_bytes()
    expected = hashlib.sha256(content[: content.rindex(b',"chain"')]).hexdigest()
    assert rows[f"journal.jsonl up to record {len(before)} (chain)"] == expected
    xml = certificate_xml(certificate(session=found), datetime(2026, 12, 1, tzinfo=UTC))
    assert expected.encode() in xml
    assert hashlib.sha256(content).hexdigest().encode() in xml


def test_command_and_versions_are_stated() -> None:
    facts = {fact.name: fact.value for fact in reproduction_section(record()).facts}
    assert facts["Command line"].startswith("workbench run reference.yaml")
    assert "numpy" in facts["Versions at the measurement"]


def test_a_record_without_a_hash_chain_is_remarked(tmp_path: Path) -> None:
    """Also in the signed file; the first hash of a later version covers the lines before it."""
    session = copied(tmp_path)
    found = read_session(session)
    assert any(found.chain_remark in text for text in reproduction_section(found).texts)
    assert found.chain_remark
    xml = certificate_xml(certificate(session=found), datetime(2026, 12, 1, tzinfo=UTC))
    assert found.chain_remark.encode() in xml
    journal, before = Journal.reopen(session)
    with journal:
        journal.append(before[-1].event)
    again = read_session(session)
    assert (again.chain_remark, reproduction_section(again).texts) == ("", ())
