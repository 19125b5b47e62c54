"""Section on the data: inputs with their hashes, versions, command line, and how to reproduce the results."""

from __future__ import annotations

import shlex

from workbench.model.contents import file_sha256
from workbench.model.table import Column, Table
from workbench.report.certificate.session_record import SessionRecord, text_sha256
from workbench.report.document import Fact, Section
from workbench.session.capture_table import CALIBRATION_TABLE
from workbench.session.journal import JOURNAL
from workbench.session.manifest import MANIFEST


def reproduction_section(session: SessionRecord) -> Section:
    """Inputs with sha256, versions, command line, commands that repeat the evaluation."""
    name = shlex.quote(f"sessions/{session.folder.name}")
    commands = [f"workbench report {name} --json > certificate.json"]
    if session.fit is not None:
        commands.insert(0, f"workbench fit {name} -o again.yaml")
        if session.calibration_path is not None:
            commands.insert(1, f"workbench compare {name}/{session.calibration_path.name} again.yaml")
    versions = ", ".join(f"{what} {version}" for what, version in session.manifest.versions.items())
    frames, missing = len(session.frames), session.missing_frames
    kept = f"{missing} of {frames} are missing: they cannot be evaluated again" if missing else f"{frames}"
    facts = (
        Fact("Session", session.folder.name),
        Fact("Frames", f"{kept}, compared with the hashes of the journal" if frames > missing else kept),
        Fact("Command line", session.manifest.command or "not recorded by this version"),
        Fact("Versions at the measurement", versions),
        Fact("Reproduce with", "; ".join(commands)),
    )
    table = Table(
        name="inputs",
        title="Inputs and records",
        columns=(Column(key="what", name="file"), Column(key="sha256", name="sha256")),
        rows=tuple(_inputs(session)),
    )
    texts = tuple(f"{JOURNAL}: {remark}." for remark in (session.chain_remark,) if remark)
    return Section("data", "Data, versions and reproduction", facts, texts, (table,))


def record_text(session: SessionRecord) -> str:
    """Hashes of the record of the measurement in one sentence: a signed certificate fixes them.

    A journal without a hash chain is remarked.
    """
    hashes = "; ".join(f"{what} {sha256}" for what, sha256 in _inputs(session))
    remark = f" {JOURNAL}: {session.chain_remark}." if session.chain_remark else ""
    return f"Record of the measurement, sha256: {hashes}.{remark}"


def _inputs(session: SessionRecord) -> list[tuple[str, str]]:
    rows = [
        (f"rig file {_name(session.manifest.rig.file)}", text_sha256(session.manifest.rig.text)),
        *((f"procedure {_name(one.file)}", text_sha256(one.text)) for one in session.manifest.procedures),
        (MANIFEST, session.manifest_sha256),
        (JOURNAL, session.journal_sha256 or "missing"),
        *_last_record(session),
        (f"{len(session.frames)} frames, list of their sha256", session.frames_sha256),
    ]
    captures = session.folder / CALIBRATION_TABLE
    if captures.exists():
        rows.append((CALIBRATION_TABLE, file_sha256(captures)))
    if session.calibration_path is not None and session.calibration_sha256:
        rows.append((session.calibration_path.name, session.calibration_sha256))
    return rows


def _last_record(session: SessionRecord) -> list[tuple[str, str]]:
    """Hash chain at the last record, which later records of a repair continue."""
    if not session.journal_chain:
        return []
    return [(f"{JOURNAL} up to record {session.all_records[-1].n} (chain)", session.journal_chain)]


def _name(path: str) -> str:
    return path.rsplit("/", 1)[-1]
