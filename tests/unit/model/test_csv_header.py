"""Header of a CSV file from a user."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.csv_header import check_header
from workbench.model.errors import BadInputError

REQUIRED, KNOWN = ("true_mm", "measured_mm"), ("true_mm", "measured_mm", "placement")


def test_required_columns_in_any_order_are_accepted() -> None:
    check_header(Path("r.csv"), ["measured_mm", "placement", "true_mm"], REQUIRED, KNOWN)


@pytest.mark.parametrize(
    ("present", "words"),
    [
        ([], ["r.csv", "true_mm"]),
        (["true_mm;measured_mm"], ["row 1", "semicolons"]),
        (["true_mm\tmeasured_mm"], ["row 1", "tabs"]),
        (["true_mm"], ["row 1", "measured_mm"]),
        ([*KNOWN, "placment"], ["row 1", "placment"]),
        ([*KNOWN, "placement"], ["row 1", "once"]),
    ],
)
def test_a_wrong_header_is_refused_with_its_row(present: list[str], words: list[str]) -> None:
    with pytest.raises(BadInputError) as caught:
        check_header(Path("r.csv"), present, REQUIRED, KNOWN)
    assert all(word in str(caught.value) for word in words)
