"""Proof of the scanning head, at a small size."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.proofs.scanning import HEADS, SCANNED_DEG, SCANNED_MM, figures, run, without_eccentricity
from workbench.model.rig import load_rig

RIG = load_rig(Path(__file__).parents[2] / "rigs/scanning-head-emulated.yaml")


def test_few_heads_are_as_good_as_they_state() -> None:
    outcome = run(RIG, 8, 5)
    assert outcome.point.shape == (8, len(SCANNED_MM), len(SCANNED_DEG), 2)
    seen = np.isfinite(outcome.parameter)
    # Some 20 parameters of eight heads, each with a z of 1 sigma.
    assert np.sqrt((outcome.parameter[seen] ** 2).mean()) < 1 + 4 / np.sqrt(2 * seen.sum())
    together = {one.quantity: one for one in figures(RIG, outcome) if one.trial == "together"}
    assert set(together) == {"parameters", "x of points", "range of points"}
    assert all(one.value > 0.8 for one in together.values())
    assert HEADS >= 200


def test_an_encoder_that_is_taken_for_perfect_is_noticed() -> None:
    """What zero and scale cannot absorb of an eccentricity makes its intervals too small."""
    blind = run(RIG, 6, 5, without_eccentricity(RIG))
    honest = run(RIG, 6, 5)
    worst = [np.nanmax(np.abs(one.parameter)) for one in (blind, honest)]
    assert worst[0] > worst[1]
