"""Comparison of the calibrations of two sessions as a document."""

from __future__ import annotations

from workbench.calibration.verdict.comparison import Comparison, compare
from workbench.calibration.verdict.tables import difference_table
from workbench.model.calibration import Calibration
from workbench.model.chart import Axis, Chart, Series, laser_colors
from workbench.model.errors import BadInputError
from workbench.model.table import Column, Table
from workbench.report.certificate.predecessor import verdict_text
from workbench.report.certificate.session_record import SessionRecord
from workbench.report.document import Document, Fact, KeyNumber, Section, Verdict


def comparison_document(a: SessionRecord, b: SessionRecord) -> Document:
    """Differences of ranges and parameters of two sessions' calibrations.

    Raises:
        BadInputError: a session has no calibration, or lasers, image sizes or standoffs differ.
    """
    of_a, of_b = _calibration(a), _calibration(b)
    found = compare(of_a, of_b)
    verdict = Verdict("open" if found.moved else "good", verdict_text(found), found.notes)
    sections = (
        Section("ranges", "Ranges", tables=(difference_table(found.differences),), charts=(_chart(found),)),
        Section("parameters", "Parameters", tables=(_parameter_table(of_a, of_b),)),
    )
    head = (
        Fact("A", _name(a)),
        Fact("B", _name(b)),
        Fact("Difference", "B - A: range by B of the spot that A predicts, minus the range by A"),
    )
    colors = laser_colors(a.rig.laser_ids)
    return Document(
        "Comparison of two calibrations", "", "", head, verdict, _numbers(found), sections, "", colors
    )


def _calibration(session: SessionRecord) -> Calibration:
    if session.calibration is None:
        raise BadInputError(f"{session.folder}: expected a calibration, the session has none")
    return session.calibration


def _name(session: SessionRecord) -> str:
    return f"{session.rig.rig}, serial number {session.rig.serial}, session {session.folder.name}"


def _numbers(found: Comparison) -> tuple[KeyNumber, ...]:
    largest = max(found.differences, key=lambda one: abs(one.difference_mm))
    freedom = f"{found.degrees_of_freedom} degrees of freedom"
    return (
        KeyNumber("p value", f"{found.probability:.2g}", "of differences as large, if nothing changed"),
        KeyNumber("Chi-square", f"{found.chi2:.1f}", freedom),
        KeyNumber(
            "Largest difference",
            f"{largest.difference_mm:+.2f} mm",
            f"{largest.laser_id} at {largest.range_mm:.0f} mm, sd {largest.sd_mm:.2g} mm",
        ),
    )


def _chart(found: Comparison) -> Chart:
    lasers = dict.fromkeys(one.laser_id for one in found.differences)
    return Chart(
        name="differences",
        title="B - A, bars 1 sigma of both calibrations",
        x=Axis(label="range", unit="mm", scale="log"),
        y=Axis(label="difference / range", unit="%"),
        series=tuple(_series(laser, found) for laser in lasers),
    )


def _series(laser: str, found: Comparison) -> Series:
    own = [one for one in found.differences if one.laser_id == laser]
    return Series(
        name=laser,
        x=tuple(round(one.range_mm) for one in own),
        y=tuple(100.0 * one.difference_mm / one.range_mm for one in own),
        sd=tuple(100.0 * one.sd_mm / one.range_mm for one in own),
    )


def _parameter_table(a: Calibration, b: Calibration) -> Table:
    """Parameters of both, in the order of A; parameters that only one has are left out."""
    of_a, of_b = a.laser_ranger.parameters, b.laser_ranger.parameters
    by_name = dict(zip(of_b.names, zip(of_b.values, of_b.sd, strict=True), strict=True))
    return Table(
        name="parameters",
        title="Parameters (sd: 1 sigma)",
        columns=(
            Column(key="name", name="parameter"),
            Column(key="unit", name="unit"),
            Column(key="value_a", name="A", format="digits of sd_a"),
            Column(key="sd_a", name="sd A", format="sd"),
            Column(key="value_b", name="B", format="digits of sd_b"),
            Column(key="sd_b", name="sd B", format="sd"),
            Column(key="change", name="B - A", format="+.3g"),
        ),
        rows=tuple(
            (name, unit, value, sd, *by_name[name], by_name[name][0] - value)
            for name, unit, value, sd in zip(of_a.names, of_a.units, of_a.values, of_a.sd, strict=True)
            if name in by_name
        ),
    )
