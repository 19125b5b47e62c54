"""The band in which a laser's spots are searched, by the rig file and by a calibration."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import FISHEYE_STANDOFFS_MM, PROVENANCE, World, fisheye_rig, prior, thesis_rig
from workbench.calibration.data.spot_rows import BEAM_HALF_WIDTH_PX, prior_scanline
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.rig import Rig
from workbench.ranging.ranger import SCANLINE_HALF_WIDTH_PX, Ranger
from workbench.spots.strip import distance_px


def tilted(ty: float) -> Rig:
    """A fisheye rig known but for small tolerances, its beams tilted across their baseline."""
    rig = fisheye_rig()
    lasers = tuple(laser.model_copy(update={"ty": prior(ty, 0.0005)}) for laser in rig.lasers)
    camera = rig.camera.model_copy(
        update={"cx_px": prior(319.5, 0.1), "cy_px": prior(239.5, 0.1), "f_px": prior(305.6, 0.5)}
    )
    return rig.model_copy(update={"lasers": lasers, "camera": camera})


@pytest.mark.parametrize("ty", [0.0, 0.2, -0.4])
def test_bands_hold_the_bent_line_of_a_tilted_beam_before_a_fisheye(ty: float) -> None:
    rig = tilted(ty)
    world = World(rig, 1)
    fitted = fit(rig, world.observations(FISHEYE_STANDOFFS_MM))
    ranger = Ranger(calibrate(fitted, Acceptance(), PROVENANCE)[0])
    for laser, calibrated in zip(rig.lasers, ranger.scanlines, strict=True):
        spots = np.array([world.pixel(laser.id, z) for z in np.geomspace(45.0, 5000.0, 40)])
        spots = spots[(spots[:, 0] > 0) & (spots[:, 0] < 639)]
        for line in (prior_scanline(rig, laser), calibrated):
            # Two thirds of the beam's own width are left beside the line's bend.
            assert (distance_px(line, *spots.T) < line.half_width_px - 0.6 * BEAM_HALF_WIDTH_PX).all()


def test_a_straight_line_has_the_width_of_its_beam() -> None:
    rig = thesis_rig()
    camera = {"cx_px": prior(319.5, 0.0), "cy_px": prior(239.5, 0.0)}
    lasers = tuple(s.model_copy(update={"tx": prior(0, 0), "ty": prior(0, 0)}) for s in rig.lasers)
    rig = rig.model_copy(update={"camera": rig.camera.model_copy(update=camera), "lasers": lasers})
    assert [prior_scanline(rig, s).half_width_px for s in rig.lasers] == [BEAM_HALF_WIDTH_PX] * 4
    fitted = fit(thesis_rig(), World(thesis_rig(), 1).observations())
    ranger = Ranger(calibrate(fitted, Acceptance(), PROVENANCE)[0])
    assert [line.half_width_px for line in ranger.scanlines] == [SCANLINE_HALF_WIDTH_PX] * 4
