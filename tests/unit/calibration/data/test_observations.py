from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from workbench.calibration.data.observations import Observation, RejectedObservation, group
from workbench.model.errors import BadInputError
from workbench.model.rig import NoiseSpec

NOISE = NoiseSpec(spot_sd_px=0.1, speckle_sd_px=0.04)


def observations(us: list[float], sds: list[float]) -> list[Observation]:
    return [
        Observation(f"row {i}", "1", "p", 500.0, i, u, 10.0, sd, sd)
        for i, (u, sd) in enumerate(zip(us, sds, strict=True))
    ]


def test_the_mean_is_weighted_and_keeps_the_shared_error() -> None:
    cells, rejected = group(observations([100.0, 101.0], [0.5, 1.0]), ["1"], NOISE)
    # Weights 4 and 1: mean (400 + 101) / 5, variance 1 / 5; the speckle does not average out.
    np.testing.assert_allclose(cells.position_px, [[100.2, 10.0]])
    np.testing.assert_allclose(cells.sd_px**2, [[0.2 + 0.04**2] * 2])
    assert rejected == []


def test_repeats_average_their_noise_but_not_their_speckle() -> None:
    repeats = [
        replace(one, u_speckle_sd_px=u, v_speckle_sd_px=0.06)
        for one, u in zip(observations([100.0, 100.2, 100.4], [0.3] * 3), (0.03, 0.05, np.nan), strict=True)
    ]
    cells, _ = group(repeats, ["1"], NOISE)
    shared2 = (0.03**2 + 0.05**2 + NOISE.speckle_sd_px**2) / 3
    np.testing.assert_allclose(cells.speckle_sd_px**2, [[shared2, 0.06**2]])
    np.testing.assert_allclose(cells.sd_px**2, [[0.03 + shared2, 0.03 + 0.06**2]])


def test_a_deviation_not_stated_is_the_rig_s() -> None:
    cells, _ = group([replace(observations([7.0], [1.0])[0], u_sd_px=np.nan)], ["1"], NOISE)
    np.testing.assert_allclose(cells.sd_px[0], [np.hypot(0.1, 0.04), np.hypot(1.0, 0.04)])


def test_the_time_of_a_cell_is_its_mean_place_in_the_order_of_capture() -> None:
    order = ["a", "b", "b", "a", "a"]
    rows = [Observation(f"row {i}", laser, "p", 500.0, i, 1.0, 2.0) for i, laser in enumerate(order)]
    cells, _ = group(rows, ["a", "b"], NOISE)
    by_laser = dict(zip(cells.laser.tolist(), cells.time.tolist(), strict=True))
    # Five captures from -0.5 to 0.5: a is the first, fourth and fifth, b the second and third.
    assert by_laser[0] == pytest.approx((-0.5 + 0.25 + 0.5) / 3)
    assert by_laser[1] == pytest.approx((-0.25 + 0.0) / 2)


def test_cells_by_laser_and_placement() -> None:
    rows = [
        Observation(f"row {i}", laser, place, float(place), 0, 1.0, 2.0)
        for i, (laser, place) in enumerate([("a", "500"), ("b", "500"), ("b", "700")])
    ]
    cells, _ = group(rows, ["b", "a"], NOISE)
    assert cells.laser.tolist() == [1, 0, 0]
    assert cells.placement.tolist() == [0, 0, 1]
    assert [p.standoff_mm for p in cells.placements] == [500.0, 700.0]


def test_a_repeat_far_from_its_fellows_is_rejected_by_name() -> None:
    us = [100.0, 100.1, 99.9, 100.05, 99.95, 100.02, 100.04, 99.97, 100.01, 103.0]
    cells, rejected = group(observations(us, [0.1] * 10), ["1"], NOISE)
    assert [r.source for r in rejected] == ["row 9"]
    assert "2.98 px" in rejected[0].reason
    assert len(cells.members[0]) == 9


@pytest.mark.parametrize("us", [[100.0, 100.1, 103.0], [100.0, 100.1, 99.9, 100.5] * 3])
def test_repeats_that_may_be_noise_stay(us: list[float]) -> None:
    cells, rejected = group(observations(us, [0.1] * len(us)), ["1"], NOISE)
    assert rejected == []
    assert len(cells.members[0]) == len(us)


def test_a_coordinate_that_some_repeats_lack_is_the_mean_of_the_others() -> None:
    rows = observations([100.0, 101.0, 102.0], [0.1] * 3)
    cells, _ = group([replace(rows[0], u_px=np.nan), *rows[1:]], ["1"], NOISE)
    np.testing.assert_allclose(cells.position_px, [[101.5, 10.0]])
    scaled = cells.repeat_scale**2 * np.array([0.01 / 2, 0.01 / 3])
    np.testing.assert_allclose(cells.sd_px[0] ** 2, scaled + 0.04**2)


def test_rows_that_say_two_things_of_one_placement() -> None:
    rows = observations([100.0, 101.0], [0.1] * 2)
    with pytest.raises(BadInputError, match=r"row 1: .*\bp\b.*500 mm.*row 0.*600 mm"):
        group([rows[0], replace(rows[1], standoff_mm=600.0)], ["1"], NOISE)


def test_a_coordinate_never_measured_stays_unknown() -> None:
    rows = [replace(s, u_px=np.nan) for s in observations([1.0] * 5, [0.1] * 5)]
    cells, rejected = group(rows, ["1"], NOISE)
    assert np.isnan(cells.position_px[0, 0])
    assert cells.position_px[0, 1] == pytest.approx(10.0)
    assert rejected == []


def many(rng: np.random.Generator, cells: int, repeats: int, sd: float) -> list[Observation]:
    """Honest repeats of one laser at several placements."""
    spots = rng.normal(0.0, sd, (cells, repeats, 2)) + 10.0 * np.arange(cells)[:, None, None]
    return [
        Observation(f"{c} {k}", "1", f"{c}", 500.0 + c, k, u, v)
        for c, repeats_of_one in enumerate(spots.tolist())
        for k, (u, v) in enumerate(repeats_of_one)
    ]


@pytest.mark.parametrize("repeats", [3, 5, 9])
@pytest.mark.parametrize("scale", [1.0, 10.0])
def test_one_wrong_of_few_repeats_is_found_by_what_others_scatter(repeats: int, scale: float) -> None:
    """Whether the deviation was stated rightly or ten times too small."""
    rows = many(np.random.default_rng(3), 20, repeats, 0.1 * scale)
    rows[7] = replace(rows[7], u_px=rows[7].u_px + 20.0 * scale)
    cells, rejected = group(rows, ["1"], NOISE)
    assert [r.source for r in rejected] == [rows[7].source]
    assert isinstance(rejected[0], RejectedObservation)
    assert rejected[0].observation == rows[7]
    assert cells.repeat_scale == pytest.approx(scale, rel=0.35)


def test_two_repeats_that_disagree_weigh_little_and_spoil_no_others() -> None:
    rows = many(np.random.default_rng(4), 20, 2, 0.1)
    rows[6] = replace(rows[6], v_px=rows[6].v_px + 30.0)
    cells, rejected = group(rows, ["1"], NOISE)
    assert (rejected, cells.inconsistent, cells.repeat_scale) == ([], (3,), 1.0)
    assert cells.sd_px[3, 1] > 5.0
    assert np.delete(cells.sd_px, 3, axis=0).max() < 0.1


@pytest.mark.parametrize("repeats", [3, 5, 9])
def test_few_honest_repeats_are_not_rejected(repeats: int) -> None:
    rng = np.random.default_rng(6)
    for _ in range(20):
        cells, rejected = group(many(rng, 40, repeats, 0.1), ["1"], NOISE)
        assert (rejected, cells.inconsistent) == ([], ())
