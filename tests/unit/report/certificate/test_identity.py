"""Sections on laboratory, sensor, conditions and standards: stated items, and those that are not stated."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.support.reference_session import LABORATORY, MARKUP, certificate, record
from workbench.model.laboratory import Laboratory
from workbench.model.rig import BenchSpec
from workbench.report.certificate.identity import (
    VIRTUAL,
    conditions_section,
    laboratory_section,
    sensor_section,
    standards_section,
)
from workbench.report.document import NOT_STATED, Section

NOTHING = Laboratory(format=1)


def facts(section: Section) -> dict[str, str]:
    return {fact.name: fact.value for fact in section.facts}


def test_items_of_the_laboratory_file_are_stated() -> None:
    found = facts(laboratory_section(LABORATORY, record()))
    assert found["Laboratory"] == "Example laboratory, 1 Example Road"
    assert found["Place of the work"] == "1 Example Road"
    assert found["Customer"].startswith(MARKUP)
    assert found["Operator"] == "operator"
    assert found["Measured"].startswith("2026-11-30 08:50 to 2026-11-30 08:50")


def test_nothing_is_invented_without_a_laboratory_file() -> None:
    found = facts(laboratory_section(NOTHING, record()))
    open_items = {name for name, value in found.items() if value == NOT_STATED}
    assert open_items == {"Laboratory", "Place of the work", "Customer", "Sensor received", "Authorised by"}
    conditions = facts(conditions_section(NOTHING, record()))
    assert conditions["Temperature, lowest and highest"] == conditions["Target material"] == NOT_STATED
    assert standards_section(NOTHING, record().rig).tables == ()


def test_answers_of_the_session_are_conditions() -> None:
    section = conditions_section(LABORATORY, record())
    found = facts(section)
    assert found["Temperature, lowest and highest"] == "20.5 to 22 deg C"
    assert found["Warm-up in the session"].startswith("3 frames")
    (table,) = section.tables
    assert table.records() == [
        {"question": "Temperature of the room", "answer": "21.5 deg C", "by": "answers file"}
    ]


def test_sensor_and_standards_are_identified() -> None:
    assert facts(sensor_section(record().rig))["Serial number"] == "reference-1"
    (table,) = standards_section(LABORATORY, record().rig).tables
    (row,) = table.records()
    assert (row["name"], row["serial"], row["calibrated"], row["due"]) == (
        "steel rule",
        "SR-17",
        "2026-05-04",
        NOT_STATED,
    )


def test_a_virtual_bench_is_named_on_the_first_page() -> None:
    assert {fact.name: fact.value for fact in certificate().document.head}["Devices"] == VIRTUAL
    real = record().rig.model_copy(update={"driver": None})
    assert facts(sensor_section(real))["Devices"] == NOT_STATED


@pytest.mark.parametrize(("stated", "measured"), [({}, False), ({"target_yaw_deg": 0.0}, True)])
def test_a_tilt_is_stated_as_measured_only_if_the_rig_file_has_it(
    stated: dict[str, float], measured: bool
) -> None:
    session = record()
    bench = {
        key: value for key, value in session.rig.bench if key not in {"target_yaw_deg", "target_pitch_deg"}
    }
    rig = session.rig.model_copy(update={"bench": BenchSpec.model_validate(bench | stated)})
    tilt = facts(conditions_section(NOTHING, replace(session, rig=rig)))["Target tilt"]
    assert ("measured yaw 0 deg" in tilt) == measured
