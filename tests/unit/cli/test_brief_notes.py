"""Notes of a fit in brief."""

from __future__ import annotations

import re

import pytest

from tests.support.rigs import PROVENANCE, World, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.cli.brief_notes import brief_notes, merge_equal_kinds
from workbench.model.acceptance import Acceptance


@pytest.mark.parametrize("seed", [1, 2])
def test_all_null_directions_of_a_fit_are_one_line_with_their_number(seed: int) -> None:
    _, assessment = calibrate(
        fit(thesis_rig(), World(thesis_rig(), seed).observations()), Acceptance(), PROVENANCE
    )
    directions = [one for one in assessment.directions if len(one.change) > 1]
    lines = brief_notes(assessment.warnings)
    counted = [line for line in lines if re.match(r"\d+ combinations? of parameters", line)]
    assert len(directions) > 1
    assert [int(line.split()[0]) for line in counted] == [len(directions)]
    assert not any("leaves every spot unchanged" in line for line in lines)


def test_the_largest_change_of_ranges_is_stated() -> None:
    line = (
        "f_px and cx_px change together (+1 % / +1 px leaves every spot unchanged). {} To separate them, x."
    )
    unaffected, some = line.format("Ranges are not affected."), line.format("Ranges change by up to 0.2 %.")
    more = line.format("Ranges change by up to 1.5 %.")
    assert brief_notes([unaffected])[0].endswith("ranges are not affected")
    assert brief_notes([some, more, unaffected]) == [
        "3 combinations of parameters are not constrained; ranges change by up to 1.5 %"
    ]


@pytest.mark.parametrize(
    ("notes", "merged"),
    [
        (["laser L2 was never seen. Do: check it"], ["laser L2 was never seen"]),
        (
            [f"laser L{n} was never seen: it has no captures" for n in (2, 3, 4)],
            ["laser L2 was never seen: it has no captures; likewise L3, L4"],
        ),
        (
            ["laser L2 at 300 mm: no spot", "laser L3 at 400 mm: no spot", "laser L3 was never seen"],
            ["laser L2 at 300 mm: no spot; and 1 more like this", "laser L3 was never seen"],
        ),
        (["cx_px is fixed. Its prior is used."], ["cx_px is fixed"]),
        ([], []),
    ],
)  # fmt: skip
def test_notes_that_differ_in_names_are_one_line(notes: list[str], merged: list[str]) -> None:
    assert merge_equal_kinds(notes) == merged
