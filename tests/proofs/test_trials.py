"""Proofs of the trials, at a small size."""

from __future__ import annotations

import numpy as np
import pytest

from tests.proofs.trials import (
    PROOFS,
    Proof,
    gauge,
    incline,
    missing_spots,
    precision,
    target_check,
    verify,
)


@pytest.mark.parametrize("proof", [precision, pytest.param(gauge, marks=pytest.mark.thorough)])
def test_intervals_hold_their_share(proof: Proof) -> None:
    """400 and 200 trials; a figure is missed where they contradict its bounds."""
    assert [figure.line() for figure in proof(40) if figure.is_missed] == []


@pytest.mark.parametrize("proof", [incline, missing_spots, target_check, verify])
def test_a_small_proof_has_finite_figures(proof: Proof) -> None:
    figures = list(proof(2))
    assert figures
    assert np.isfinite([figure.value for figure in figures if "named" not in figure.quantity]).all()
    assert proof in PROOFS
