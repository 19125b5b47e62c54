"""Forecasts against the deviations of simulated fits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.proofs import simulate, study
from tests.support.rigs import STANDOFFS_MM, thesis_rig
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.design.forecast import RANGES_MM, CalibrationForecast, forecast
from workbench.calibration.design.standoffs import (
    DRAWS,
    RangeGoals,
)
from workbench.calibration.estimation.batch import fit_batch
from workbench.model.errors import BadInputError
from workbench.model.nested import fix_parameters
from workbench.model.rig import load_rig

ROOT = Path(__file__).parents[4]
RIG = load_rig(ROOT / "rigs/thesis-emulated.yaml")
SHIPPED = STANDOFFS_MM
FITS = 256


@pytest.fixture(scope="module")
def fits() -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names, and stated sd of parameters (N, F) and relative sd of ranges (N, K, L), of simulated fits."""
    standoffs = np.array(SHIPPED)
    data = simulate.calibrations(RIG, standoffs, 10, FITS, np.random.default_rng(7))
    fitted = fit_batch(RIG, study.placements(RIG, standoffs), data.position_px, data.sd_px)
    fair = fitted.noise_scale == 1.0
    sensors = Expectation(RIG, fitted.sensor[fair])
    free = sensors.table.free
    sd = sensors.table.prior_sd[free]
    covariance = fitted.sensor_covariance[fair][:, free[:, None], free] / np.outer(sd, sd)
    goals = RangeGoals.of(sensors, np.array(RANGES_MM), RIG.noise)
    relative = np.where(goals.spot_sd > 0, np.sqrt(goals.variance(covariance) + goals.spot_sd**2), np.nan)
    names = [sensors.table.parameters[i].name for i in free]
    return names, fitted.sd[fair][:, free], relative.reshape(len(relative), len(RANGES_MM), -1)


@pytest.fixture(scope="module")
def predicted() -> CalibrationForecast:
    return forecast(RIG, SHIPPED, 10)


def test_predicted_deviations_are_those_of_fits(
    predicted: CalibrationForecast, fits: tuple[list[str], np.ndarray, np.ndarray]
) -> None:
    names, sd, relative = fits
    assert [p.name for p in predicted.parameters] == names
    typical = np.median(sd, axis=0)
    # Two medians of deviations that scatter from sensor to sensor, 4 sigma; 1 % for the estimate's own place.
    chance = 4 * 1.25 * sd.std(axis=0) / typical * np.sqrt(1 / FITS + 1 / DRAWS)
    ratio = np.array([p.sd for p in predicted.parameters]) / typical
    assert (np.abs(ratio - 1.0) < chance + 0.01).all()
    assert np.median(chance) < 0.08
    assert abs(np.median(ratio) - 1.0) < 0.02
    lasers = len(RIG.lasers)
    far = [r.relative_sd for r in predicted.ranges][2 * lasers :]
    np.testing.assert_allclose(
        np.array(far, float), np.nanmedian(relative, axis=0).ravel()[2 * lasers :], rtol=0.03
    )


def test_null_directions_are_those_of_the_geometry(predicted: CalibrationForecast) -> None:
    """A spot of a flat depends on f_px x_mm, and on cx_px + f_px tx of each laser."""
    change = {next(iter(direction.change)): direction.change for direction in predicted.directions}
    f_px = RIG.camera.f_px.value
    for laser in RIG.lasers:
        scaled = change["f_px"][f"{laser.id}.x_mm"] / laser.x_mm.value
        assert scaled == pytest.approx(-change["f_px"]["f_px"] / f_px, rel=0.02)
        assert change["cx_px"][f"{laser.id}.tx"] == pytest.approx(-change["cx_px"]["cx_px"] / f_px, rel=0.02)


def test_repeats_share_their_speckle() -> None:
    """Ten thousand readings of each laser cannot do what a second placement does."""
    many = forecast(RIG, (200.0, 1000.0), 10_000).worst_relative_sd_of_calibration
    few = forecast(RIG, (200.0, 1000.0), 10).worst_relative_sd_of_calibration
    more = forecast(RIG, (200.0, 210.0, 1000.0, 1100.0), 10).worst_relative_sd_of_calibration
    assert more < many < few


def test_a_spot_that_may_be_out_of_the_picture_is_noted() -> None:
    found = forecast(RIG, (105.0, 300.0, 1000.0), 10)
    assert [note.split(" the spot")[0] for note in found.notes] == ["at 105 mm"]
    with pytest.raises(BadInputError, match=r"\b10 mm"):
        forecast(RIG, (10.0, 300.0), 10)


def test_a_range_that_no_spot_shows_has_no_forecast() -> None:
    camera = RIG.camera.model_copy(update={"width_px": 320})
    found = forecast(RIG.model_copy(update={"camera": camera}), (300.0, 600.0, 1000.0), 10)
    nearest = {r.laser_id: r.relative_sd for r in found.ranges if r.range_mm == 100.0}
    assert nearest["L4"] is None


def test_a_rig_of_constants_has_nothing_to_determine() -> None:
    rig = thesis_rig()
    names = [p.name for p in Expectation(rig, np.empty((0, 0))).table.parameters]
    fixed = fix_parameters(rig, names)
    found = forecast(fixed, (200.0, 1000.0), 10)
    assert found.parameters == ()
    assert found.directions == ()
    assert found.worst_relative_sd_of_calibration == 0.0


def test_forecast_ranges_ascend_over_the_stated_span() -> None:
    assert (RANGES_MM[0], RANGES_MM[-1]) == (100.0, 5000.0)
    assert (np.diff(RANGES_MM) > 0).all()
