"""Coverage factor of the certificate: Student's where few data estimated the noise; by simulation."""

from __future__ import annotations

from math import inf
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm, t

from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import FitSummary, Provenance
from workbench.model.captures import load_captures
from workbench.model.rig import load_rig
from workbench.report.certificate.coverage import expanded_parameter, expanded_range, is_recorded, k_text
from workbench.report.certificate.range_uncertainty import range_uncertainties
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.errors import EXPANSION, EXPANSION_PROBABILITY

ROOT = Path(__file__).parents[4]
PROVENANCE = Provenance.model_validate(dict.fromkeys(Provenance.model_fields, "x"))
F_B_PX_MM, INFINITY_PX, NOISE_PX = 32500.0, 203.0, 1.5
RANGE_MM = 400.0
"""Sensor of the simulation: v = infinity - f b / z."""


def summary(
    noise: float | None = None, placements: float | None = None, noise_scale: float = 1.0
) -> FitSummary:
    return FitSummary(
        rms_px=0.1,
        observations=9,
        rejected=0,
        noise_scale=noise_scale,
        noise_degrees_of_freedom=noise,
        placement_degrees_of_freedom=placements,
        verdict="accepted",
    )


def student(freedom: float) -> float:
    return float(t.ppf(0.5 + EXPANSION_PROBABILITY / 2, freedom))


def test_a_known_noise_has_k_2() -> None:
    assert pytest.approx(2 * norm.cdf(EXPANSION) - 1, rel=1e-12) == EXPANSION_PROBABILITY
    found = expanded_range(3.0, 4.0, summary())
    assert (found.u, found.degrees_of_freedom) == (5.0, inf)
    assert found.k == pytest.approx(2.0, rel=1e-9)


def test_an_estimated_noise_has_its_own_degrees_of_freedom() -> None:
    for spot, parameters in ((3.0, 4.0), (5.0, 0.0), (0.0, 5.0)):
        found = expanded_range(spot, parameters, summary(noise=7.0))
        assert found.degrees_of_freedom == pytest.approx(7.0)
        assert found.expanded == pytest.approx(5.0 * student(7.0))


def test_estimated_placements_count_with_the_part_of_the_parameters() -> None:
    found = expanded_range(3.0, 4.0, summary(placements=6.0))
    assert found.degrees_of_freedom == pytest.approx(5.0**4 / (4.0**4 / 6.0))
    both = expanded_range(3.0, 4.0, summary(noise=20.0, placements=6.0))
    assert 6.0 < both.degrees_of_freedom < found.degrees_of_freedom


@pytest.mark.parametrize(("share", "freedom"), [(1.0, 7.0), (0.5, 28.0), (0.0, inf)])
def test_the_prior_of_a_parameter_is_known(share: float, freedom: float) -> None:
    assert expanded_parameter(2.0, share, summary(noise=7.0)).degrees_of_freedom == pytest.approx(freedom)


def test_an_estimate_without_degrees_of_freedom_is_not_recorded() -> None:
    assert is_recorded(summary())
    assert is_recorded(summary(noise=7.0, noise_scale=2.0))
    assert not is_recorded(summary(noise_scale=2.0))


def test_k_is_stated_with_its_degrees_of_freedom() -> None:
    assert k_text(2.0, None) == "k = 2"
    assert k_text(student(7.0), 7.0) == "k = 2.43, nu = 7"


def predicted_px(range_mm: float) -> float:
    return INFINITY_PX - F_B_PX_MM / range_mm


def test_a_calibration_records_the_degrees_of_freedom_of_its_noise() -> None:
    rig, rows = load_rig(ROOT / "rigs/webcam-laser.yaml"), load_captures(ROOT / "data/webcam-laser-rows.csv")
    limits = Acceptance(max_rms_px=9, max_relative_range_sd=9)
    calibration, _ = calibrate(fit(rig, *observations_of_rows(rig, rows)), limits, PROVENANCE)
    found = calibration.laser_ranger.fit
    assert found.noise_degrees_of_freedom == pytest.approx(7.0, abs=0.01)  # 9 rows, a line's 2 parameters
    assert found.placement_degrees_of_freedom is None
    assert is_recorded(found)
    (one,) = range_uncertainties(calibration, [RANGE_MM])
    assert one.mean_k == pytest.approx(student(7.0), rel=1e-3)
    assert one.laser_k["1"] == one.mean_k


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_coverage_of_calibrations_with_seven_degrees_of_freedom(seed: int) -> None:
    """A laser, nine rows, noise 5 times as stated: a range is within U in 95.45 % of the cases.

    100 calibrations with 20 readings each; with k = 2 it is 91.4 % (Student's distribution). Readings of one
    calibration share its error: the mean coverage has a standard deviation of 0.7 %.
    """
    rig, rows = load_rig(ROOT / "rigs/webcam-laser.yaml"), load_captures(ROOT / "data/webcam-laser-rows.csv")
    random, calibrations, readings = np.random.default_rng(seed), 100, 20
    covered, covered_by_2, freedom = [], [], []
    limits = Acceptance(max_rms_px=9, max_relative_range_sd=9)
    for _ in range(calibrations):
        drawn = [
            row.model_copy(update={"v_px": predicted_px(row.standoff_mm) + random.normal(0.0, NOISE_PX)})
            for row in rows
        ]
        calibration, _ = calibrate(fit(rig, *observations_of_rows(rig, drawn)), limits, PROVENANCE)
        (one,) = range_uncertainties(calibration, [RANGE_MM])
        v_px = predicted_px(RANGE_MM) + random.normal(0.0, NOISE_PX, readings)
        position = np.column_stack([np.full(readings, np.nan), v_px])
        sensor = CalibratedSensor(calibration)
        error = sensor.ranges(["1"] * readings, position, np.full_like(position, np.nan)).range_mm - RANGE_MM
        assert one.mean_expanded_mm is not None
        assert one.mean_sd_mm is not None
        covered.append(float(np.mean(np.abs(error) <= one.mean_expanded_mm)))
        covered_by_2.append(float(np.mean(np.abs(error) <= 2 * one.mean_sd_mm)))
        freedom.append(one.mean_degrees_of_freedom)
    assert np.mean(covered) == pytest.approx(EXPANSION_PROBABILITY, abs=0.02)
    assert np.mean(covered_by_2) < np.mean(covered) - 0.02
    assert freedom == pytest.approx([7.0] * calibrations, abs=0.1)
