"""What a fit did not use."""

from __future__ import annotations

from workbench.model.fit_event import Rejected
from workbench.report.rejected_lines import rejected_lines


def test_each_reason_has_a_line_with_its_first_source() -> None:
    sources = [("row 3", "no spot"), ("row 4", "too faint"), ("row 9", "no spot"), ("row 10", "no spot")]
    rejected = [Rejected(source=source, reason=reason) for source, reason in sources]
    assert rejected_lines(rejected) == ["row 3 and 2 more: no spot", "row 4: too faint"]
