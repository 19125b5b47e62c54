"""Fit of a camera alone to views of a board held anywhere."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.free_views import RIG, TRUTH, views
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.selection.camera_fit import fit_camera, with_scatter_of_views
from workbench.model.errors import BadInputError
from workbench.model.prior import Prior

SEEDS = (1, 2, 3, 4, 5)


def value(fitted: CalibrationFit, name: str) -> tuple[float, float]:
    index = [p.name for p in fitted.table.parameters].index(name)
    return float(fitted.values[index]), float(fitted.sd[index])


def test_lens_is_recovered_within_its_deviations() -> None:
    scores = []
    for seed in SEEDS:
        fitted = fit_camera(RIG, views(8, seed))
        assert fitted.converged
        found = {name: value(fitted, name) for name in TRUTH}
        assert found["f_px"][1] < 1.0  # of the prior's 150 px
        scores += [(found[name][0] - true) / found[name][1] for name, true in TRUTH.items()]
    # 35 correlated scores: their rms stays below 1.6 in all but 1 of 1000 draws.
    assert np.sqrt(np.mean(np.square(scores))) < 1.6
    assert np.abs(scores).max() < 4.0


def test_noise_larger_than_stated_widens_the_deviations() -> None:
    fitted = fit_camera(RIG, views(6, 1, sd_px=0.3, stated_px=0.1))
    assert fitted.noise_scale == pytest.approx(3.0, rel=0.15)


def test_missing_distortion_is_called_for() -> None:
    camera = RIG.camera.model_copy(update={name: Prior(value=0.0, sd=0.0) for name in ("k1", "k2")})
    fitted = fit_camera(RIG.model_copy(update={"camera": camera}), views(6, 1))
    assert "k1" in {term.name for term in fitted.terms}


def test_no_views_are_refused() -> None:
    with pytest.raises(BadInputError):
        fit_camera(RIG, [])


def test_only_views_held_anywhere_take_the_scatter_of_these() -> None:
    seen = views(6, 1, sd_px=0.3, stated_px=0.1)
    wider = with_scatter_of_views(RIG, seen)
    assert wider[0].corners.sd_px[0, 0] == pytest.approx(0.3, rel=0.15)
