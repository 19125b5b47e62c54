"""What every lens model keeps to; a new one is tested here with its name alone."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.model.lens import COEFFICIENTS, LensName
from workbench.model.rig import CameraSpec
from workbench.optics.lens import LensModel
from workbench.optics.lens_models import LENS_MODELS, lens_model

MODELS = list(LENS_MODELS.values())


def test_each_name_of_a_rig_file_has_its_model() -> None:
    assert set(LENS_MODELS) == set(COEFFICIENTS)
    assert all(lens_model(name).name == name for name in COEFFICIENTS)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_terms_are_the_model_s_coefficients(model: LensModel) -> None:
    assert tuple(model.trial_sd) == model.coefficients
    assert sorted(" ".join(model.terms).split()) == sorted(model.coefficients)
    # The highest order goes first: none stays above one that went.
    assert sorted(" ".join(model.terms).split()) == sorted(model.coefficients)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_a_lens_without_distortion_has_its_focal_length_on_the_axis(model: LensModel) -> None:
    lens = np.array([500.0, 320.0, 240.0, *np.zeros(len(model.coefficients))])
    u, v = model.project(lens, np.array([0.0, 1e-5]), np.array([0.0, 0.0]))
    np.testing.assert_allclose(u, [320.0, 320.005], rtol=1e-12)
    np.testing.assert_allclose(v, [240.0, 240.0])
    assert np.asarray(model.is_unfolded(lens, np.array([0.0, 0.5]), np.zeros(2))).all()


@pytest.mark.parametrize("name", COEFFICIENTS)
def test_a_camera_has_a_prior_for_each_parameter(name: LensName) -> None:
    prior = {"value": 500.0, "sd": 1.0}
    camera = CameraSpec.model_validate(
        {"width_px": 640, "height_px": 480, "lens": name, "f_px": prior, "cx_px": prior, "cy_px": prior}
    )
    assert tuple(camera.lens_priors) == lens_model(name).parameters
