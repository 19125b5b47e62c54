"""Scanning head of the virtual bench: truth, readings, and the turned beam in rendered frames."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.scanned_head import SimulatedHead
from workbench.emulator.head import reading_error_deg, turned
from workbench.emulator.lens import Lens
from workbench.emulator.scene import BenchScene
from workbench.emulator.truth import TrueRay
from workbench.model.rig import Rig, load_rig
from workbench.model.target import Placement

RIG = Path(__file__).parents[3] / "rigs/scanning-head-emulated.yaml"


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig(RIG)


def test_truths_follow_their_priors(rig: Rig) -> None:
    heads = [SimulatedHead.of(rig, seed).truth.head for seed in range(400)]
    head = rig.scanning_head
    for name, sd in (
        ("axis_z_mm", head.axis_z_mm.sd),
        ("scale", head.scale.sd),
        ("eccentricity_cos_deg", head.eccentricity_sd_deg),
        ("eccentricity_sin_deg", head.eccentricity_sd_deg),
    ):
        drawn = np.array([getattr(one, name) for one in heads])
        assert drawn.std() == pytest.approx(sd, rel=0.15)  # four deviations of 400 draws
        assert abs(drawn.mean()) < 4 * sd / 20


def test_a_move_is_repeated_with_its_error_and_another_has_another(rig: Rig) -> None:
    head = SimulatedHead.of(rig, 3)
    true = head.truth.head
    assert true is not None
    errors = [reading_error_deg(true, head.spec, key, 5.0) for key in ("a", "a", "b")]
    assert errors[0] == errors[1] != errors[2]
    many = [reading_error_deg(true, head.spec, "a", float(n)) for n in range(400)]
    assert np.std(many) == pytest.approx(rig.scanning_head.reading_sd_deg, rel=0.15)


def test_an_eccentric_disc_has_no_error_at_0_and_one_period_a_turn(rig: Rig) -> None:
    true = SimulatedHead.of(rig, 1).truth.head
    assert true is not None
    perfect = replace(
        true,
        axis_slope_x=0.0,
        axis_slope_z=0.0,
        scale=0.0,
        eccentricity_cos_deg=0.3,
        eccentricity_sin_deg=-0.1,
    )
    ray = TrueRay(90.0, 0.0, 0.0, 0.0)

    def error_deg(reading_deg: float) -> float:
        return float(np.degrees(np.arctan(turned(ray, perfect, reading_deg).tx))) - reading_deg

    assert error_deg(0.0) == pytest.approx(0.0, abs=1e-12)
    assert error_deg(60.0) == pytest.approx(0.3 * (0.5 - 1) - 0.1 * np.sqrt(3) / 2)


def test_the_rendered_spot_is_that_of_the_turned_beam(rig: Rig, tmp_path: Path) -> None:
    assert rig.emulator is not None
    quiet = rig.model_copy(update={"emulator": {"seed": 5, "beam": {"speckle_contrast": 0.0}}})
    head = SimulatedHead.of(rig, 5)
    scene = BenchScene(
        quiet,
        head.spec.model_copy(update={"beam": head.spec.beam.model_copy(update={"speckle_contrast": 0.0})}),
        head.truth,
        tmp_path / "t.yaml",
    )
    for reading_deg in (-20.0, 0.0, 8.0):
        scene.place(Placement(key="p", standoff_mm=600.0, head_deg=reading_deg))
        (spot,) = scene.spots("S")
        rows, columns = np.indices(spot.rate.shape)
        total = spot.rate.sum()
        centre = spot.left + (columns * spot.rate).sum() / total, spot.top + (rows * spot.rate).sum() / total
        point = head.point("p", head.plane("p", 600.0), reading_deg)
        np.testing.assert_allclose(centre, Lens(head.truth).project(point[None])[0], atol=0.03)
    assert "head:" in (tmp_path / "t.yaml").read_text()
