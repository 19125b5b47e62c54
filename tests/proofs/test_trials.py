"""Proofs of the trials, at a small size."""

from __future__ import annotations

import numpy as np
import pytest

from tests.proofs.trials import (
    PROOFS,
    Figure,
    Proof,
    gauge,
    incline,
    missing_spots,
    precision,
    target_check,
    verify,
)


@pytest.mark.parametrize("proof", [precision, gauge])
def test_intervals_hold_their_share(proof: Proof) -> None:
    """400 and 200 trials; a figure is missed beyond two deviations of their number."""
    assert [figure.line() for figure in proof(40) if figure.is_missed] == []


@pytest.mark.parametrize("proof", [incline, missing_spots, target_check, verify])
def test_a_small_proof_has_finite_figures(proof: Proof) -> None:
    figures = list(proof(2))
    assert figures
    assert np.isfinite([figure.value for figure in figures if "named" not in figure.quantity]).all()
    assert proof in PROOFS


@pytest.mark.parametrize(("value", "is_missed"), [(0.95, False), (0.92, False), (0.85, True), (1.0, True)])
def test_a_figure_outside_its_bounds_is_missed(value: float, is_missed: bool) -> None:
    figure = Figure("trial", "quantity", value, (0.93, 0.97), 400)
    assert figure.is_missed == is_missed
    assert ("MISSED" in figure.line()) == is_missed
