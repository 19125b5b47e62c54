"""Digital Calibration Certificate, read by pydcc and as XML."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from tests.support.dcc_reader import parsed, read_dcc
from tests.support.reference_session import LABORATORY, MARKUP, REFERENCE, certificate, record
from workbench.model.errors import BadInputError
from workbench.model.laboratory import Laboratory
from workbench.report.certificate.dcc import certificate_xml
from workbench.report.certificate.identity import VIRTUAL
from workbench.report.certificate.session_record import read_session

PRINTED = datetime(2026, 12, 1, tzinfo=UTC)
NAMES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}


def test_it_states_that_no_real_sensor_was_measured(tmp_path: Path) -> None:
    assert VIRTUAL in certificate_xml(certificate(), PRINTED).decode()


def test_another_reader_finds_identity_and_quantities(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "certificate.xml"
    found = certificate()
    file.write_bytes(certificate_xml(found, PRINTED))
    read = read_dcc(file, monkeypatch)
    assert read.uid() == "2026-0001"
    assert read.calibration_laboratory_name() == "Example laboratory"
    assert f"{read.calibration_date():%Y-%m-%d}" == "2026-11-30"
    results = dict(read.get_calibration_results("name", "en"))
    (ranges,) = [value for name, value in results.items() if "Range from the reference plane" in name]
    inside = [one for one in found.uncertainties if one.inside and one.mean_sd_mm is not None]
    values = ranges["realListXMLList"]
    assert [float(v) for v in values["valueXMLList"].split()] == [one.range_mm for one in inside]
    expanded = values["expandedUncXMLList"]
    assert [float(v) for v in expanded["uncertaintyXMLList"].split()] == pytest.approx(
        [2 * (one.mean_sd_mm or 0) for one in inside]
    )
    assert {float(k) for k in expanded["coverageFactorXMLList"].split()} == {2.0}
    assert expanded["coverageProbabilityXMLList"] == "0.9545"
    assert values["unitXMLList"] == r"\milli\metre"
    (f_px,) = [value for name, value in results.items() if name.endswith(" f_px")]
    calibration = found.sources.session.calibration
    assert calibration is not None
    assert float(f_px["realListXMLList"]["valueXMLList"]) == calibration.camera_matrix.data[0]


def test_few_degrees_of_freedom_are_stated_with_their_factor() -> None:
    session = record()
    calibration = session.calibration
    assert calibration is not None
    fit = calibration.laser_ranger.fit.model_copy(update={"noise_degrees_of_freedom": 7.0})
    ranger = calibration.laser_ranger.model_copy(update={"fit": fit})
    vars(session)["calibration"] = calibration.model_copy(update={"laser_ranger": ranger})
    found = certificate(session=session)
    assert "nu = 7" in found.document.key_numbers[1].note
    assert found.uncertainties[3].mean_degrees_of_freedom == pytest.approx(7.0)
    root = parsed(certificate_xml(found, PRINTED))
    lists = root.iterfind(".//dcc:quantity/si:realListXMLList", NAMES)
    ranges, freedom, *_ = [one for one in lists if " " in one.findtext("si:valueXMLList", "", NAMES)]
    factors = ranges.findtext(".//si:coverageFactorXMLList", "", NAMES).split()
    assert [float(k) for k in factors] == pytest.approx([2.4288] * len(factors), abs=1e-3)
    nus = freedom.findtext("si:valueXMLList", "", NAMES).split()
    assert [float(nu) for nu in nus] == pytest.approx([7.0] * len(factors))


def test_errors_of_trials_have_the_coverage_factors_of_their_table() -> None:
    root = parsed(certificate_xml(certificate(), PRINTED))
    trial = next(t for t in certificate().document.sections if t.key.startswith("trial"))
    bias = next(table for table in trial.tables if table.name.endswith("-bias"))
    rows = [row for row in bias.records() if row["range"] == "mean"]
    for result in root.iterfind(".//dcc:result", NAMES):
        if result.findtext("dcc:name/dcc:content", "", NAMES).endswith("mean error of range mean"):
            factors = result.findtext(".//si:coverageFactorXMLList", "", NAMES).split()
            assert [float(factor) for factor in factors] == pytest.approx(
                [row["k"] for row in rows], abs=1e-4
            )
            break
    else:
        pytest.fail("no result of the trial")


def test_texts_are_escaped_and_the_day_of_issue_is_that_of_printing() -> None:
    content = certificate_xml(certificate(), PRINTED)
    assert b"<script>" not in content
    root = parsed(content)
    assert root.findtext(".//dcc:customer/dcc:name/dcc:content", "", NAMES) == MARKUP
    assert root.findtext(".//dcc:issueDate", "", NAMES) == "2026-12-01"


@pytest.mark.parametrize("missing", ["country", "laboratory", "customer", "authorised_by"])
def test_items_that_the_schema_requires_are_not_invented(missing: str) -> None:
    empty = getattr(Laboratory(format=1), missing)
    lab = LABORATORY.model_copy(update={missing: empty})
    with pytest.raises(BadInputError, match=missing):
        certificate_xml(certificate(lab), PRINTED)


def test_a_session_without_calibration_has_a_certificate_too() -> None:
    session = read_session(REFERENCE.parents[1] / "simulation-0.1.0")
    root = parsed(certificate_xml(certificate(session=session), PRINTED))
    assert root.findall(".//dcc:result", NAMES)
