"""Lens models by name."""

from __future__ import annotations

from workbench.model.lens import LensName
from workbench.optics.equidistant import EQUIDISTANT
from workbench.optics.lens import LensModel
from workbench.optics.plumb_bob import PLUMB_BOB

LENS_MODELS: dict[LensName, LensModel] = {model.name: model for model in (PLUMB_BOB, EQUIDISTANT)}


def lens_model(name: LensName) -> LensModel:
    """Lens model by its name."""
    return LENS_MODELS[name]
