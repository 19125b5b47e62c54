"""Quality of the repeats of one laser at one placement."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.model.spot import Failure, Spot
from workbench.procedure.capture.quality import quality_of


def spot(u: float, v: float, flags: tuple[Failure, ...] = ()) -> Spot:
    return Spot(
        laser_id=None,
        u_px=u,
        v_px=v,
        u_sd_px=0.05,
        v_sd_px=0.05,
        flux_dn=1,
        width_px=2,
        peak_dn=1,
        flags=frozenset(flags),
    )


def test_quality_is_what_the_repeats_say() -> None:
    u, v = [10.0, 10.2, 10.7], [5.0, 5.1, 5.0]
    found = [[spot(a, b)] for a, b in zip(u, v, strict=True)] + [[], [spot(0, 0), spot(1, 1)]]
    quality = quality_of(found)
    assert quality.repeats == 5
    assert quality.missing == pytest.approx(2 / 5)
    assert quality.snr == pytest.approx(2 / 0.05)
    assert quality.scatter_px == pytest.approx(np.std(u, ddof=1))
    assert (quality.u_px, quality.v_px) == pytest.approx((np.mean(u), np.mean(v)))
    assert quality_of([[spot(0, 0, (Failure.SATURATED,))], [spot(0, 0)]]).saturated == 0.5
    assert quality_of([[]]).snr is None
    assert quality_of([[spot(0, 0)]]).scatter_px is None
