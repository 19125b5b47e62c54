"""The laboratory file: every item may be missing, wrong ones are refused with their line."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.model.laboratory import load_laboratory
from workbench.model.text_length import LONGEST_TEXT

FULL = """\
format: 1
laboratory: {name: Example laboratory, address: 1 Example Road}
country: DE
customer: {name: 17, contact: desk}
received: 2026-11-25
standards:
  - {name: steel rule, calibrated: 2026-05-04, due: "2028-05-04", expanded_uncertainty: 0.1, unit: mm}
ambient: {temperature_c: [20.5, 22]}
recalibration: {months: 12, reason: agreed}
"""


def test_no_file_is_no_laboratory(tmp_path: Path) -> None:
    assert load_laboratory(tmp_path) is None


def test_items_are_read_with_their_types(tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text(FULL)
    lab = load_laboratory(tmp_path)
    assert lab is not None
    assert lab.customer is not None
    assert (lab.customer.name, lab.received, lab.place) == ("17", date(2026, 11, 25), "")
    assert (lab.standards[0].due, lab.standards[0].coverage_factor) == (date(2028, 5, 4), 2.0)
    assert lab.ambient.temperature_c == (20.5, 22.0)


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        ("ambient: {temperature_c: [22, 20]}", 2),
        ("country: Germany", 2),
        ("received: yesterday", 2),
        ("unknown: 1", 2),
        (f"authorised_by: {'x' * (LONGEST_TEXT + 1)}", 2),
        ("recalibration: {months: 0, reason: x}", 2),
    ],
)
def test_wrong_items_are_refused_with_their_line(tmp_path: Path, wrong: str, line: int) -> None:
    (tmp_path / "lab.yaml").write_text(f"format: 1\n{wrong}\n")
    with pytest.raises(BadInputError, match=f"lab.yaml:{line}"):
        load_laboratory(tmp_path)
