"""Records of ranges: notes, intervals, the range of a flat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.rangers import spot_at, spots
from workbench.ranging.acquire import acquire
from workbench.ranging.points import interval_mm
from workbench.ranging.ranger import Ranger
from workbench.ranging.records import FLAGGED, flag_notes, flat_range, laser_ranges
from workbench.sensor.range_model import RangeEstimates
from workbench.spots import Failure, Finding


@pytest.mark.parametrize(
    ("flag", "words"),
    [
        (Failure.SATURATED, "is saturated: its range is less certain"),
        (Failure.MERGED, "overlaps another: the errors of both ranges are correlated"),
        (Failure.AT_EDGE, "is cut by the edge of the image"),
    ],
)
def test_what_a_range_suffers_from_is_told(ranger: Ranger, flag: Failure, words: str) -> None:
    def shoot(ids: tuple[str, ...]) -> Finding:
        found = spots(ranger, dict.fromkeys(ids, 700.0))
        return Finding((replace(found[0], flags=frozenset({flag})), *found[1:]))

    reading = acquire(ranger, "s", shoot)
    assert (reading.status, reading.notes) == ("done", (f"L1: its spot {words}",))


def estimates(range_mm: list[float], spot_sd_mm: list[float], common_sd_mm: float) -> RangeEstimates:
    """Ranges whose calibration errs by the same in all."""
    spot = np.array(spot_sd_mm)
    n = len(spot)
    return RangeEstimates(np.array(range_mm), spot, np.full((n, 1), common_sd_mm), np.eye(1), np.zeros(n))


def test_every_flag_of_every_spot_is_a_note_of_its_laser() -> None:
    plain = spot_at(300.0, 240.0)
    both = replace(plain, flags=frozenset({Failure.AT_EDGE, Failure.SATURATED}))
    dim = replace(plain, flags=frozenset({Failure.TOO_DIM}))
    notes = flag_notes(["L1", "L2", "L3"], [plain, both, dim])
    assert [note.split(":")[0] for note in notes] == ["L2", "L2"]
    assert notes[0].endswith(FLAGGED[Failure.SATURATED])
    assert notes[1].endswith(FLAGGED[Failure.AT_EDGE])


def test_a_record_lacks_what_was_not_measured_and_an_end_that_is_infinite() -> None:
    ranges = estimates([500.0, 5000.0], [1.0, 3000.0], 0.0)
    near, far = laser_ranges(["L1", "L2"], np.array([[300.0, 240.0], [310.0, np.nan]]), ranges, 20.0)
    assert (near.laser_id, near.range_mm, near.sigma_mm, near.u_px, near.v_px) == (
        "L1",
        500.0,
        1.0,
        300.0,
        240.0,
    )
    assert (near.low_mm, near.high_mm) == interval_mm(500.0, 1.0, 20.0)
    assert (far.u_px, far.v_px, far.high_mm) == (310.0, None, None)
    assert far.low_mm == interval_mm(5000.0, 3000.0, 20.0)[0]


def test_the_range_of_a_flat_is_weighted_by_the_spots_and_keeps_the_common_error() -> None:
    mean, sigma, spot_sd = flat_range(estimates([500.0, 506.0], [1.0, 2.0], 0.7))
    assert mean == pytest.approx((500.0 / 1 + 506.0 / 4) / (1 + 1 / 4))
    assert sigma == pytest.approx(np.sqrt(1 / (1 + 1 / 4) + 0.7**2))
    assert spot_sd == pytest.approx(np.sqrt(1 / (1 + 1 / 4)))
