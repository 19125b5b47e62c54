"""Where a spot that was not seen is expected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.calibration.data.observations import Observation
from workbench.calibration.design.expected_spot import expected_spot
from workbench.calibration.model.parameters import sensor_parameters
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig, load_rig

RIG = load_rig(Path(__file__).parents[4] / "rigs/thesis-emulated.yaml")
DRAWS = 300


def drawn(rig: Rig, rng: np.random.Generator) -> dict[str, float]:
    """A sensor as the rig file lets it be."""
    return {p.name: float(rng.normal(p.prior.value, p.prior.sd)) for p in sensor_parameters(rig)}


def spot(sensor: dict[str, float], laser_id: str, standoff_mm: float) -> FloatArray:
    """(2,) on a square flat, by the formulas of a pinhole with two radial terms."""
    z = standoff_mm * (1 + sensor["ruler_scale"]) + sensor["offset_mm"]
    x = np.array([sensor[f"{laser_id}.{axis}_mm"] / z + sensor[f"{laser_id}.t{axis}"] for axis in "xy"])
    r2 = float(x @ x)
    bent = x * (1 + sensor["k1"] * r2 + sensor["k2"] * r2**2)
    return np.asarray(sensor["f_px"] * bent + [sensor["cx_px"], sensor["cy_px"]])


def seen(
    sensor: dict[str, float], standoffs_mm: list[float], lasers: str, rng: np.random.Generator
) -> list[Observation]:
    """Readings of the lasers at placements that are as wrong as the rig file lets them be."""
    observations = []
    for asked in standoffs_mm:
        at = asked + rng.normal(0, RIG.bench.placement_sd_mm)
        for name in lasers.split():
            u, v = spot(sensor, name, at) + rng.normal(0, 0.05, 2)
            observations.append(
                Observation("s", name, f"{asked:g}", asked, 0, float(u), float(v), 0.05, 0.05)
            )
    return observations


@pytest.mark.parametrize(
    ("standoffs_mm", "lasers"),
    [([], ""), ([160.0, 210.0], "L1 L2 L3"), ([160.0, 210.0, 400.0], "L1 L2 L3 L4")],
)
def test_the_spot_is_where_it_is_said_to_be(standoffs_mm: list[float], lasers: str) -> None:
    """In sensors drawn from the rig's tolerances it lies as far off as stated: no bias, the right spread.

    The tilt of a target, for which the statement leaves room, is not drawn: the spread may be smaller.
    """
    rng = np.random.default_rng(11)
    off = []
    for _ in range(DRAWS):
        sensor = drawn(RIG, rng)
        told = expected_spot(RIG, seen(sensor, standoffs_mm, lasers, rng), "L4", 125.0)
        true = spot(sensor, "L4", 125.0 + rng.normal(0, RIG.bench.placement_sd_mm))
        off.append((np.array([told.u_px, told.v_px]) - true) / [told.u_sd_px, told.v_sd_px])
    z = np.array(off)
    assert np.abs(z.mean(axis=0)).max() < 4 / np.sqrt(DRAWS)
    assert z.std(axis=0).min() > 0.5
    assert z.std(axis=0).max() < 1 + 4 / np.sqrt(2 * DRAWS)


def test_spots_seen_narrow_it_down() -> None:
    """By the rig file alone nobody knows whether L4 is in the picture at 125 mm; the others' spots tell."""
    sensor = {p.name: p.prior.value for p in sensor_parameters(RIG)}
    sensor["cx_px"] += 80.0
    rng = np.random.default_rng(3)
    assert expected_spot(RIG, [], "L4", 125.0).place == "at the edge"
    shifted = seen(sensor, [125.0, 160.0], "L1 L2 L3", rng)
    assert spot(sensor, "L4", 125.0)[0] > RIG.camera.width_px
    assert expected_spot(RIG, shifted, "L4", 125.0).place == "outside"
    sensor["cx_px"] -= 80.0
    assert expected_spot(RIG, seen(sensor, [125.0, 160.0], "L1 L2 L3", rng), "L4", 125.0).place == "inside"
