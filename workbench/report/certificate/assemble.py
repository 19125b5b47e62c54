"""Certificate of a session from its record and the laboratory file."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from workbench.model.calibration import Calibration
from workbench.model.chart import laser_colors
from workbench.model.laboratory import Laboratory
from workbench.report.certificate.assessment import Assessment, assess
from workbench.report.certificate.identity import (
    VIRTUAL,
    conditions_section,
    device_text,
    laboratory_section,
    party_text,
    sensor_section,
    standards_section,
)
from workbench.report.certificate.method import decision_section, exception_section, procedure_section
from workbench.report.certificate.predecessor import Predecessor, change_section
from workbench.report.certificate.range_uncertainty import (
    RangeUncertainty,
    range_uncertainties,
    table_mm,
)
from workbench.report.certificate.recalibration import recalibration_section
from workbench.report.certificate.reproduction import reproduction_section
from workbench.report.certificate.results import (
    calibration_section,
    trial_sections,
    uncertainty_section,
    validation_section,
)
from workbench.report.certificate.session_record import SessionRecord
from workbench.report.certificate.summary import key_numbers
from workbench.report.document import NOT_STATED, Document, Fact, Section
from workbench.session.certificate_numbers import AssignedNumber
from workbench.session.manifest import workbench_version

STATEMENTS = (
    "The results relate only to the sensor named here, as it was during the measurement.",
    "This certificate may be reproduced only in full, unless the laboratory agrees otherwise in writing.",
    "Its number, on each page with the number of pages, identifies it; the last page is marked as the end.",
)


@dataclass(frozen=True)
class Sources:
    """Records and statements behind a certificate."""

    session: SessionRecord
    laboratory: Laboratory
    predecessor: Predecessor | None = None
    """The calibration of the same sensor before; None if there is none."""


def fingerprint(sources: Sources) -> str:
    """Hash of everything that determines a certificate: equal for equal certificates."""
    parts = (
        sources.session.journal_sha256,
        sources.session.manifest_sha256,
        sources.session.calibration_sha256,
        sources.laboratory.model_dump_json(),
        workbench_version(),
        "" if sources.predecessor is None else sources.predecessor.sha256,
    )
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


@dataclass(frozen=True)
class Certificate:
    """A certificate: the document, and the values that programs read."""

    document: Document
    assessment: Assessment
    sources: Sources
    uncertainties: tuple[RangeUncertainty, ...]

    def numbered(self, number: AssignedNumber) -> Certificate:
        """The certificate with its number."""
        document = replace(self.document, number=number.number, replaces=number.replaces)
        return replace(self, document=document)

    def as_json(self) -> dict[str, object]:
        """Plain values for JSON."""
        session = self.sources.session
        identity = {"session": session.folder.name, "rig": session.rig.rig, "serial": session.rig.serial}
        return (
            identity
            | self.document.as_json()
            | {"uncertainties": [asdict(one) for one in self.uncertainties]}
        )


def certificate_of(sources: Sources) -> Certificate:
    """The certificate, without a number yet.

    Raises:
        BadInputError: the calibration file of the session is missing or damaged, or has changed since.
    """
    session, lab = sources.session, sources.laboratory
    calibration = session.calibration
    found = () if calibration is None else range_uncertainties(calibration, table_mm(calibration))
    assessment = assess(session, calibration)
    document = Document(
        title=assessment.title,
        number="",
        replaces="",
        head=_head(sources),
        verdict=assessment.verdict,
        key_numbers=key_numbers(session, calibration, found),
        sections=_sections(sources, calibration, found),
        authorised_by=lab.authorised_by or NOT_STATED,
        colors=laser_colors(session.rig.laser_ids),
    )
    return Certificate(document, assessment, sources, found)


def _head(sources: Sources) -> tuple[Fact, ...]:
    session, lab = sources.session, sources.laboratory
    days = dict.fromkeys(f"{day:%Y-%m-%d}" for day in (session.began, session.ended) if day)
    return (
        Fact("Sensor", f"{session.rig.rig}, serial number {session.rig.serial}"),
        Fact("Laboratory", party_text(lab.laboratory)),
        Fact("Customer", party_text(lab.customer)),
        Fact("Measured", " to ".join(days) or NOT_STATED),
        Fact("Session", session.folder.name),
        *((Fact("Devices", VIRTUAL),) if device_text(session.rig) == VIRTUAL else ()),
    )


def _sections(
    sources: Sources, calibration: Calibration | None, found: Sequence[RangeUncertainty]
) -> tuple[Section, ...]:
    session, lab = sources.session, sources.laboratory
    return (
        laboratory_section(lab, session),
        sensor_section(session.rig),
        conditions_section(lab, session),
        standards_section(lab, session.rig),
        procedure_section(session),
        uncertainty_section(calibration, found),
        decision_section(session, calibration),
        calibration_section(session, calibration),
        validation_section(session.fit),
        *trial_sections(session),
        change_section(calibration, sources.predecessor),
        recalibration_section(lab, calibration),
        exception_section(session),
        reproduction_section(session),
        Section("statements", "Statements", texts=STATEMENTS),
    )
