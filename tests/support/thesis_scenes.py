"""Scenes of the thesis's simulation."""

from __future__ import annotations

from workbench.trials.thesis.schema import SimulatedScene


def scene(**changes: object) -> SimulatedScene:
    keys: dict[str, object] = {
        "name": "a",
        "source": "here",
        "set_mm": (100.0, 800.0),
        "claims": [{"quantity": "range"}],
    }
    return SimulatedScene.model_validate(keys | changes)
