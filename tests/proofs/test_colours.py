"""Study of lasers of several colours, at a small size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.proofs.colours import COLOURED, OURS, RESPONSE, RESPONSE_SD, THESIS, ResponseEstimate, run


def test_colours_take_one_pair_and_assign_no_spot_wrongly(tmp_path: Path) -> None:
    scores, response, true = run(6, 1, tmp_path)
    assert scores[COLOURED].pairs == scores[COLOURED].readings == 6
    assert scores[THESIS].pairs > scores[OURS].pairs >= 6
    assert (scores[COLOURED].wrong, scores[COLOURED].invented) == (0, 0)
    # Firing each laser alone replaces the prior; the noise of an amplitude is taken from the residuals of
    # a profile that is not quite that of a spot in speckle, so that the error may be several deviations.
    assert np.abs(response.mean - true).max() < RESPONSE_SD / 5
    assert response.sd.max() < RESPONSE_SD / 10


@pytest.mark.parametrize("colour", [0, 1, 2])
def test_a_spot_has_the_colour_whose_response_it_shows(colour: int) -> None:
    known = ResponseEstimate(RESPONSE, np.where(np.eye(3) > 0, 0.0, 0.01))
    noise = np.full(3, 1.0)
    random = np.random.default_rng(1)
    bright = [known.colour(100 * RESPONSE[:, colour] + random.standard_normal(3), noise) for _ in range(200)]
    assert set(bright) == {colour}
    # A spot as dim as its noise has no colour, rather than a wrong one.
    dim = [known.colour(2 * RESPONSE[:, colour] + random.standard_normal(3), noise) for _ in range(200)]
    assert sum(one is None for one in dim) > 100
    assert sum(one not in (None, colour) for one in dim) < 10
