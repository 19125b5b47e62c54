"""Rejection of spots that are none of their laser's."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.corrupted_data import exchanged, moved, shifted, stated_as
from tests.support.rigs import World, thesis_rig
from workbench.calibration.data.observations import RejectedObservation
from workbench.calibration.estimation.fit import fit
from workbench.calibration.selection.outliers import fit_without_outliers, without_outliers
from workbench.model.fit_event import Rejected

RIG = thesis_rig()
SEEDS = (1, 2, 3)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_fit_without_an_outlier_is_that_of_the_other_spots(seed: int) -> None:
    observations = shifted(World(RIG, seed).observations(), "L2", 600.0, 12.0)
    found = fit_without_outliers(RIG, observations)
    clean = fit(RIG, [s for s in observations if (s.laser_id, s.standoff_mm) != ("L2", 600.0)])
    assert {r.source for r in found.rejected} == {f"L2 600 {k}" for k in range(5)}
    removed = [r.observation for r in found.rejected if isinstance(r, RejectedObservation)]
    assert len(removed) == len(found.rejected)
    assert set(removed) <= set(observations)
    np.testing.assert_allclose(found.values, clean.values, rtol=1e-9)
    np.testing.assert_allclose(found.covariance, clean.covariance, rtol=1e-6, atol=1e-12)


def test_a_sound_fit_is_handed_back_as_it_is() -> None:
    sound = fit(RIG, World(RIG, 1).observations())
    assert without_outliers(sound, ()) is sound


def test_what_was_rejected_before_stays_in_front() -> None:
    before = Rejected("row 1", "too dark")
    found = fit_without_outliers(RIG, shifted(World(RIG, 1).observations(), "L2", 600.0, 12.0), [before])
    assert found.rejected[0] == before
    assert len(found.rejected) == 6


@pytest.mark.parametrize("seed", SEEDS)
def test_what_another_account_explains_costs_no_spot(seed: int) -> None:
    world = World(RIG, seed)
    sound = world.observations()
    for spoilt in (
        exchanged(sound, "L1", "L2"),
        stated_as(sound, 400.0, 410.0),
        moved(world, sound, 160.0, 8, 2.0),
    ):
        before = fit(RIG, spoilt)
        assert without_outliers(before, before.rejected) is before


def test_half_the_spots_of_a_placement_are_a_wrong_placement() -> None:
    observations = World(RIG, 1).observations()
    for laser in ("L1", "L4"):
        observations = shifted(observations, laser, 900.0, 5.0 if laser == "L1" else -5.0)
    found = fit_without_outliers(RIG, observations)
    assert not {r.source for r in found.rejected if r.source.split()[1] == "900"}
