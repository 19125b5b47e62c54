"""Proof of the scanning head, at a small size."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.proofs.scanning import (
    HEADS,
    SCANNED_DEG,
    SCANNED_MM,
    blind_figures,
    figures,
    run,
    without_eccentricity,
)
from workbench.model.rig import load_rig

RIG = load_rig(Path(__file__).parents[2] / "rigs/scanning-head-emulated.yaml")


def test_few_heads_are_as_good_as_they_state() -> None:
    outcome = run(RIG, 8, 5)
    assert outcome.point.shape == (8, len(SCANNED_MM), len(SCANNED_DEG), 3)
    seen = np.isfinite(outcome.parameter)
    # Some 20 parameters of eight heads, each with a z of 1 sigma.
    assert np.sqrt((outcome.parameter[seen] ** 2).mean()) < 1 + 4 / np.sqrt(2 * seen.sum())
    together = {one.quantity: one for one in figures(RIG, outcome) if one.trial == "together"}
    assert set(together) == {
        "parameters",
        "x of points",
        "range of points",
        "deviation from a flat",
        "deviation from a cylinder",
    }
    assert all(one.value > 0.8 for one in together.values())
    assert HEADS >= 200


def test_an_encoder_that_is_taken_for_perfect_is_noticed() -> None:
    """An eccentricity is hidden in zero and principal point; what is left makes their intervals too small."""
    blind = {one.quantity: one.value for one in blind_figures(RIG, run(RIG, 8, 5, without_eccentricity(RIG)))}
    assert blind["zero of the encoder, no eccentricity fitted"] < 0.8
    assert blind["range of points, no eccentricity fitted"] > 0.8
