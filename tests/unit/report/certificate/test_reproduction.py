"""Inputs of a certificate with their hashes."""

from __future__ import annotations

import hashlib

from tests.support.reference_session import REFERENCE, record
from workbench.report.certificate.reproduction import reproduction_section


def test_every_input_has_the_sha256_of_its_file() -> None:
    section = reproduction_section(record())
    found = {row["what"]: row["sha256"] for row in section.tables[0].records()}
    for name in ("session.yaml", "journal.jsonl", "captures.csv", "calibration.yaml"):
        assert found[name] == hashlib.sha256((REFERENCE / name).read_bytes()).hexdigest()
    rig = record().manifest.rig.text.encode()
    assert found["rig file rig.yaml"] == hashlib.sha256(rig).hexdigest()
    assert "60 frames, list of their sha256" in found


def test_command_and_versions_are_stated() -> None:
    facts = {fact.name: fact.value for fact in reproduction_section(record()).facts}
    assert facts["Command line"].startswith("workbench run reference.yaml")
    assert "numpy" in facts["Versions at the measurement"]
