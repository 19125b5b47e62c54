"""Digital Calibration Certificate of PTB (schema 3.2.0) with quantities in D-SI 2.1.0.

Source: https://www.ptb.de/dcc; the names of elements are those of the schema, in its order.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from xml.etree import ElementTree as ET

from workbench.model import event as ev
from workbench.model.calibration import FitSummary, Parameters
from workbench.model.contents import printable
from workbench.model.errors import BadInputError
from workbench.model.laboratory import LABORATORY_FILE, Laboratory, Party, Span, Standard
from workbench.model.table import Cell, Table
from workbench.report.certificate.assemble import STATEMENTS, Certificate
from workbench.report.certificate.coverage import expanded_parameter
from workbench.report.certificate.identity import VIRTUAL, device_text
from workbench.report.certificate.method import DECISION_RULE
from workbench.report.certificate.reproduction import record_text
from workbench.report.certificate.results import COVERAGE
from workbench.report.certificate.session_record import SessionRecord, text_sha256
from workbench.report.document import NOT_STATED
from workbench.session.manifest import DISTRIBUTION, workbench_version
from workbench.trials.errors import EXPANSION, EXPANSION_PROBABILITY

DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
SCHEMA = "3.2.0"
LANGUAGE = "en"
K_DIGITS = 4
"""Digits after the point of a coverage factor."""
STUDENT_PROBABILITY = 0.95
"""Coverage probability of a table's own k, by Student's distribution."""
UNITS = {"mm": r"\milli\metre", "px": r"\one", "": r"\one", "deg": r"\degree", "%": r"\percent"}
"""Units of D-SI by ours; a pixel is a count."""
DEGREE_CELSIUS, PERCENT = r"\degreecelsius", r"\percent"


def certificate_xml(certificate: Certificate, printed: datetime) -> bytes:
    """The certificate as XML.

    Args:
        certificate: the certificate.
        printed: time of printing; its day is the day of issue.

    Raises:
        BadInputError: `lab.yaml` does not state an item that the schema requires, or the session is empty.
    """
    lab, session = certificate.sources.laboratory, certificate.sources.session
    laboratory, customer = required_parties(lab, session)
    ET.register_namespace("dcc", DCC)
    ET.register_namespace("si", SI)
    root = ET.Element(_dcc("digitalCalibrationCertificate"), {"schemaVersion": SCHEMA})
    administrative = _add(root, "administrativeData")
    _software(_add(administrative, "dccSoftware"))
    _core_data(_add(administrative, "coreData"), certificate, printed)
    _items(_add(administrative, "items"), certificate)
    _contact(_add(_add(administrative, "calibrationLaboratory"), "contact"), laboratory, lab.country)
    person = _add(_add(administrative, "respPersons"), "respPerson")
    _named(_add(person, "person"), lab.authorised_by)
    _add(person, "mainSigner", "true")
    _contact(_add(administrative, "customer"), customer, "")
    _statements(_add(administrative, "statements"), certificate)
    _measurement(_add(_add(root, "measurementResults"), "measurementResult"), certificate)
    ET.indent(root)
    content: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return content


def required_parties(lab: Laboratory, session: SessionRecord) -> tuple[Party, Party]:
    """Laboratory and customer, if all items that a Digital Calibration Certificate requires are stated.

    Raises:
        BadInputError: `lab.yaml` does not state an item that the schema requires, or the session is empty.
    """
    if session.began is None:
        raise BadInputError(f"{session.folder}: expected records, the session has none")
    items = {
        "country": lab.country,
        "laboratory": lab.laboratory,
        "customer": lab.customer,
        "authorised_by": lab.authorised_by,
    }
    if missing := [name for name, value in items.items() if not value]:
        raise BadInputError(
            f"--dcc: a Digital Calibration Certificate requires {', '.join(missing)}; write them into"
            f" {session.folder.parent / LABORATORY_FILE} (layout: docs/certificate.md, section lab.yaml)"
        )
    return lab.laboratory or Party(name="-"), lab.customer or Party(name="-")


def _software(parent: ET.Element) -> None:
    software = _add(parent, "software")
    _named(software, DISTRIBUTION)
    _add(software, "release", workbench_version())


def _core_data(parent: ET.Element, certificate: Certificate, printed: datetime) -> None:
    lab, session = certificate.sources.laboratory, certificate.sources.session
    _add(parent, "countryCodeISO3166_1", lab.country)
    _add(parent, "usedLangCodeISO639_1", LANGUAGE)
    _add(parent, "mandatoryLangCodeISO639_1", LANGUAGE)
    _add(parent, "uniqueIdentifier", certificate.document.number)
    _identifications(parent, "calibrationLaboratory", (("session", session.folder.name),))
    if lab.received is not None:
        _add(parent, "receiptDate", lab.received.isoformat())
    _add(parent, "beginPerformanceDate", f"{session.began:%Y-%m-%d}")
    _add(parent, "endPerformanceDate", f"{session.ended:%Y-%m-%d}")
    _add(parent, "performanceLocation", "other" if lab.place else "laboratory")
    _add(parent, "issueDate", f"{printed:%Y-%m-%d}")


def _items(parent: ET.Element, certificate: Certificate) -> None:
    rig, lab = certificate.sources.session.rig, certificate.sources.laboratory
    item = _add(parent, "item")
    _named(item, f"Laser-spot range sensor {rig.rig}")
    _rich(_add(item, "description"), f"{len(rig.lasers)} lasers: {', '.join(rig.laser_ids)}")
    _named(_add(item, "manufacturer"), lab.manufacturer or NOT_STATED)
    _identifications(item, "manufacturer", (("serial number", rig.serial),))


def _statements(parent: ET.Element, certificate: Certificate) -> None:
    document = certificate.document
    texts = [document.verdict.text, *document.verdict.reasons, DECISION_RULE, COVERAGE, *STATEMENTS]
    if device_text(certificate.sources.session.rig) == VIRTUAL:
        texts.insert(0, f"Devices: {VIRTUAL}.")
    if document.replaces:
        texts.append(f"This certificate replaces certificate {document.replaces}.")
    texts.append(record_text(certificate.sources.session))
    for text in texts:
        _rich(_add(_add(parent, "statement"), "declaration"), text)
    assessment = certificate.assessment
    if assessment.conformity is not None:
        statement = _add(parent, "statement")
        _rich(_add(statement, "declaration"), f"{assessment.limits} limits of the procedures were checked.")
        _add(statement, "conformity", assessment.conformity)


def _measurement(parent: ET.Element, certificate: Certificate) -> None:
    session, lab = certificate.sources.session, certificate.sources.laboratory
    _named(parent, certificate.document.title)
    if session.manifest.procedures:
        methods = _add(parent, "usedMethods")
        for entry in session.manifest.procedures:
            method = _add(methods, "usedMethod")
            _named(method, entry.file.rsplit("/", 1)[-1])
            _rich(_add(method, "description"), f"sha256 {text_sha256(entry.text)}")
    if lab.standards:
        equipment = _add(parent, "measuringEquipments")
        for standard in lab.standards:
            _standard(_add(equipment, "measuringEquipment"), standard)
    _conditions(parent, lab)
    results = _add(parent, "results")
    calibration = session.calibration
    if calibration is not None:
        _range_uncertainty(results, certificate)
        _parameters(results, calibration.laser_ranger.parameters, calibration.laser_ranger.fit)
    for trial in session.events(ev.TrialFinished):
        for table in trial.tables:
            _trial_errors(results, table)
    if not len(results):
        result = _add(results, "result")
        _named(result, "Result")
        _rich(_add(_add(result, "data"), "text"), "The session has neither a calibration nor a trial.")


def _standard(parent: ET.Element, standard: Standard) -> None:
    _named(parent, standard.name)
    calibrated = str(standard.calibrated or NOT_STATED)
    u = "" if standard.expanded_uncertainty is None else f"{standard.expanded_uncertainty:g} {standard.unit}"
    text = (
        f"certificate {standard.certificate or NOT_STATED}, calibrated {calibrated},"
        f" U {u or NOT_STATED} (k = {standard.coverage_factor:g})"
    )
    _rich(_add(parent, "description"), text)
    if standard.serial:
        _identifications(parent, "manufacturer", (("serial number", standard.serial),))


def _conditions(parent: ET.Element, lab: Laboratory) -> None:
    """Temperature and humidity, each with its lowest and highest value."""
    stated: list[tuple[str, str, Span]] = []
    if lab.ambient.temperature_c is not None:
        stated.append(("Temperature", DEGREE_CELSIUS, lab.ambient.temperature_c))
    if lab.ambient.humidity_percent is not None:
        stated.append(("Relative humidity", PERCENT, lab.ambient.humidity_percent))
    if not stated:
        return
    conditions = _add(parent, "influenceConditions")
    for name, unit, span in stated:
        condition = _add(conditions, "influenceCondition")
        _named(condition, name)
        data = _add(condition, "data")
        for end, value in zip(("lowest", "highest"), span, strict=True):
            quantity = _quantity(data, f"{name}, {end}")
            real = ET.SubElement(quantity, _si("real"))
            ET.SubElement(real, _si("value")).text = repr(value)
            ET.SubElement(real, _si("unit")).text = unit


def _range_uncertainty(results: ET.Element, certificate: Certificate) -> None:
    found = [one for one in certificate.uncertainties if one.inside and one.mean_sd_mm is not None]
    if not found:
        return
    data = _result(results, "Expanded uncertainty of a single range, mean of the lasers")
    _real_list(
        _quantity(data, "Range from the reference plane"),
        [one.range_mm for one in found],
        UNITS["mm"],
        [one.mean_expanded_mm or 0.0 for one in found],
        [one.mean_k for one in found],
    )
    freedom = [one.mean_degrees_of_freedom for one in found]
    if all(nu is not None for nu in freedom):  # else infinite: no number of XML
        quantity = _quantity(data, "Effective degrees of freedom of the uncertainty")
        _real_list(quantity, [nu for nu in freedom if nu is not None], UNITS[""], ())


def _parameters(results: ET.Element, found: Parameters, fit: FitSummary) -> None:
    data = _result(results, "Parameters of the sensor")
    columns = zip(found.names, found.units, found.values, found.sd, found.data_share, strict=True)
    for name, unit, value, sd, share in columns:
        u = expanded_parameter(sd, share, fit)
        _real_list(_quantity(data, name), [value], UNITS.get(unit, r"\one"), [u.expanded], [u.k])


def _trial_errors(results: ET.Element, table: Table) -> None:
    """True ranges, and mean errors with their U, of a trial's table that has these columns."""
    keys = {column.key for column in table.columns}
    if not {"standoff_mm", "error_mm", "expanded_mm"} <= keys:
        return
    groups: dict[Cell, list[dict[str, Cell]]] = {}
    for row in table.records():
        if all(isinstance(row[key], float | int) for key in ("standoff_mm", "error_mm", "expanded_mm")):
            groups.setdefault(row.get("range", ""), []).append(row)
    for name, rows in groups.items():
        of = f" of range {name}" if name else ""
        data = _result(results, f"{table.name}: mean error{of}")
        true_mm, error_mm, expanded_mm = (
            [float(row[key] or 0.0) for row in rows] for key in ("standoff_mm", "error_mm", "expanded_mm")
        )
        factors = [float(row.get("k") or EXPANSION) for row in rows]
        probability = STUDENT_PROBABILITY if "k" in keys else EXPANSION_PROBABILITY
        _real_list(_quantity(data, "True range"), true_mm, UNITS["mm"], ())
        errors = _quantity(data, "Measured - true range")
        _real_list(errors, error_mm, UNITS["mm"], expanded_mm, factors, probability)


def _real_list(
    quantity: ET.Element,
    values: Sequence[float],
    unit: str,
    expanded: Sequence[float],
    factors: Sequence[float] = (EXPANSION,),
    probability: float = EXPANSION_PROBABILITY,
) -> None:
    """List of values with one unit; with their expanded uncertainties and coverage factors, if known."""
    found = ET.SubElement(quantity, _si("realListXMLList"))
    ET.SubElement(found, _si("valueXMLList")).text = _numbers(values)
    ET.SubElement(found, _si("unitXMLList")).text = unit
    if expanded:
        uncertainty = ET.SubElement(found, _si("expandedUncXMLList"))
        ET.SubElement(uncertainty, _si("uncertaintyXMLList")).text = _numbers(expanded)
        ET.SubElement(uncertainty, _si("coverageFactorXMLList")).text = _numbers(
            round(factor, K_DIGITS) for factor in factors
        )
        ET.SubElement(uncertainty, _si("coverageProbabilityXMLList")).text = f"{probability:.4g}"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _result(results: ET.Element, name: str) -> ET.Element:
    """Data of a new result."""
    result = _add(results, "result")
    _named(result, name)
    return _add(result, "data")


def _quantity(parent: ET.Element, name: str) -> ET.Element:
    quantity = _add(parent, "quantity")
    _named(quantity, name)
    return quantity


def _contact(parent: ET.Element, party: Party, country: str) -> None:
    _named(parent, party.name)
    location = _add(parent, "location")
    if country:
        _add(location, "countryCode", country)
    _rich(_add(location, "further"), party.address or NOT_STATED)


def _identifications(parent: ET.Element, issuer: str, named: Iterable[tuple[str, str]]) -> None:
    found = _add(parent, "identifications")
    for name, value in named:
        one = _add(found, "identification")
        _add(one, "issuer", issuer)
        _add(one, "value", value)
        _named(one, name)


def _named(parent: ET.Element, text: str) -> None:
    _rich(_add(parent, "name"), text)


def _rich(parent: ET.Element, text: str) -> None:
    _add(parent, "content", text).set("lang", LANGUAGE)


def _add(parent: ET.Element, name: str, text: str | None = None) -> ET.Element:
    """New element of the certificate's namespace; its text has no blanks at its ends and no control codes."""
    element = ET.SubElement(parent, _dcc(name))
    if text is not None:
        element.text = " ".join(printable(text).split()) or "-"
    return element


def _dcc(name: str) -> str:
    return f"{{{DCC}}}{name}"


def _si(name: str) -> str:
    return f"{{{SI}}}{name}"
