"""File of a calibrated head, and what it says of undetermined parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.rigs import PROVENANCE
from tests.support.scanned_head import SimulatedHead
from workbench.calibration.scanning.export import (
    calibrated_head,
    eccentricity_deg,
    render,
    undetermined,
    warnings,
)
from workbench.calibration.scanning.fit import HeadFit, fit_head
from workbench.model.head_calibration import HeadCalibration
from workbench.model.rig import load_rig
from workbench.model.yamlfile import load_yaml_model

RIG = load_rig(Path(__file__).parents[4] / "rigs/scanning-head-emulated.yaml")


@pytest.fixture(scope="module")
def fit() -> HeadFit:
    head = SimulatedHead.of(RIG, 4)
    readings = (0.0, 8.0, -8.0, 16.0, -16.0, -24.0, -32.0)
    return fit_head(head.rig, head.spots((250.0, 500.0, 900.0), readings, 0.05, np.random.default_rng(4)))


def test_the_file_reads_back_as_it_was(fit: HeadFit, tmp_path: Path) -> None:
    calibration = calibrated_head(fit, PROVENANCE)
    path = tmp_path / "head.yaml"
    path.write_text(render(calibration))
    assert load_yaml_model(path, HeadCalibration) == calibration
    head = calibration.scanning_head
    assert head.readings_deg == (-32.0, 16.0)
    assert head.standoffs_mm == (250.0, 900.0)
    assert head.fit.moves == len(fit.spots.placement)
    np.testing.assert_allclose(head.parameters.sd, fit.sd[: len(head.parameters.sd)])


def test_over_a_small_arc_scale_and_phase_are_not_determined(fit: HeadFit) -> None:
    names = undetermined(fit)
    assert {"head.scale", "head.beam_offset_mm", "ruler_scale"} <= set(names)
    assert "k1" not in names
    assert eccentricity_deg(fit)[2] is None
    text = "\n".join(warnings(fit))
    assert "head.scale" in text
    assert "the phase of the encoder's eccentricity is not determined" in text


def test_a_well_known_eccentricity_has_amplitude_and_phase(fit: HeadFit) -> None:
    """Deviations along and across the vector (a, b), by simulation."""
    names = [one.name for one in fit.table.parameters]
    at = [names.index(f"head.eccentricity_{part}_rad") for part in ("cos", "sin")]
    values, covariance = fit.values.copy(), fit.covariance.copy()
    values[at] = np.radians([0.3, -0.4])
    own = np.radians(0.02) ** 2 * np.array([[2.0, 0.5], [0.5, 1.0]])
    covariance[np.ix_(at, at)] = own
    amplitude, sd, phase_sd = eccentricity_deg(replace(fit, values=values, covariance=covariance))
    assert amplitude == pytest.approx(0.5)
    assert phase_sd is not None
    drawn = np.random.default_rng(1).multivariate_normal(values[at], own, 100_000)
    assert sd == pytest.approx(np.degrees(np.hypot(*drawn.T).std()), rel=0.02)
    assert phase_sd == pytest.approx(np.degrees(np.arctan2(drawn[:, 1], drawn[:, 0]).std()), rel=0.02)
    assert not any("phase" in one for one in warnings(replace(fit, values=values, covariance=covariance)))


def test_scaled_noise_is_a_warning(fit: HeadFit) -> None:
    assert "1.50 times as large as stated" in warnings(replace(fit, noise_scale=1.5))[0]
