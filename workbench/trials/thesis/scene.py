"""Scenes of the thesis's stand-alone simulation: lines of parallel lasers in front of an analytic surface.

Deborah L. Tran, "Obstacle Detection for Robot Navigation Using Structured Light", MIT 2001, section
5.2.3.2.1. Beams are parallel and have no width where they meet the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, degrees, radians, tan
from typing import Literal

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.errors import BadInputError
from workbench.model.lens import COEFFICIENTS
from workbench.model.rig import Rig
from workbench.optics.rows import rows_of_rig
from workbench.trials.thesis.schema import LineName, SimulatedScene

BEAM_EXIT_MM = 1.5
DIVERGENCE = 1.6e-3
"""Full angle, radians."""
FRONT_STEP_MM = 0.1
FEWEST_LASERS = 2


@dataclass(frozen=True)
class LaserLine:
    """Line of lasers, with the row or column of pixels along which their spots move."""

    axis: Literal["u", "v"]
    ids: tuple[str, ...]
    baselines_mm: FloatArray
    """(n,) ascending; negative for lasers left of the camera or above it."""
    f_px: float
    centre_px: float
    """Position of the optical axis along the row (column); pixel centres are whole numbers."""
    length_px: int
    speckle_sd_px: float

    @property
    def baselines_by_id(self) -> dict[str, float]:
        """Baselines by laser id, mm."""
        return dict(zip(self.ids, self.baselines_mm.tolist(), strict=True))

    @property
    def front_mm(self) -> FloatArray:
        """Positions (n,) along the front, from the first laser."""
        return np.asarray(self.baselines_mm - self.baselines_mm[0])

    def spots_px(self, depths_mm: FloatArray) -> FloatArray:
        """Positions (n,) of the spots of beams that end at these depths: (4.1) and (4.2) of the thesis."""
        return np.asarray(self.centre_px + self.f_px * self.baselines_mm / depths_mm)

    def radii_px(self, depths_mm: FloatArray) -> FloatArray:
        """Radii (n,) of the spots at 1/e^2: (4.5) of the thesis, projected into the image."""
        return np.asarray((BEAM_EXIT_MM + DIVERGENCE * depths_mm) / 2 * self.f_px / depths_mm)


@dataclass(frozen=True)
class Outcome:
    """Result of a chain for one reading, or the truth."""

    closest_mm: float | None
    """Smallest range along the front; None if no spot was seen."""
    shape: str
    """`flat`, `incline`, `round 2` and so on, `cylinder`, `unknown`, `none`."""
    angle_deg: float | None = None
    sigma_mm: float | None = None
    """1 sigma of the closest range; None if the chain states none."""


def line_of(rig: Rig, name: LineName) -> LaserLine:
    """Line of lasers of an ideal rig: pinhole, parallel beams, values of the rig file.

    Raises:
        BadInputError: the rig has fewer than two lasers on the line, or its lens or beams are not ideal.
    """
    along: Literal["u", "v"] = "u" if name == "horizontal" else "v"
    camera = rig.camera
    rows = [row for row in rows_of_rig(rig) if row.name == name]
    lasers = sorted(
        (rig.lasers[n] for n in max((row.members for row in rows), key=len, default=())),
        key=lambda laser: laser.x_mm.value if along == "u" else laser.y_mm.value,
    )
    if len(lasers) < FEWEST_LASERS:
        raise BadInputError(
            f"rig {rig.rig}: expected at least {FEWEST_LASERS} lasers in a {name} row, got {len(lasers)}"
        )
    if camera.lens != "plumb_bob":
        raise BadInputError(f"rig {rig.rig}: expected camera.lens plumb_bob, a pinhole, got {camera.lens}")
    bent = [name for name in COEFFICIENTS[camera.lens] if camera.lens_priors[name].value != 0]
    bent += [f"{x.id}.{t}" for x in lasers for t in ("tx", "ty") if getattr(x, t).value != 0]
    if bent or rig.bench.offset_mm.value != 0:
        raise BadInputError(
            f"rig {rig.rig}: expected a pinhole in the reference plane and parallel beams, as in the thesis's"
            f" simulation; set to 0: {', '.join(bent) or 'bench.offset_mm'}"
        )
    baselines = np.array([(x.x_mm if along == "u" else x.y_mm).value for x in lasers])
    return LaserLine(
        axis=along,
        ids=tuple(laser.id for laser in lasers),
        baselines_mm=baselines,
        f_px=camera.f_px.value,
        centre_px=camera.cx_px.value if along == "u" else camera.cy_px.value,
        length_px=camera.width_px if along == "u" else camera.height_px,
        speckle_sd_px=rig.noise.speckle_sd_px,
    )


def surface_mm(scene: SimulatedScene, x_mm: FloatArray, set_mm: float) -> FloatArray:
    """Distances (n,) of the surface from the front at positions x."""
    if scene.incline_deg is not None:
        return set_mm + tan(radians(scene.incline_deg)) * x_mm
    powers = np.arange(1, len(scene.coefficients) + 1)
    from_vertex = x_mm - scene.shift_mm
    return np.asarray(set_mm + (from_vertex[:, None] ** powers) @ np.array(scene.coefficients, float))


def truth(scene: SimulatedScene, lines: Sequence[LaserLine], set_mm: float) -> Outcome:
    """Truth of a scene: the smallest distance along the front, whether or not a beam falls there."""
    closest = min(float(surface_mm(scene, _front(line), set_mm).min()) for line in lines)
    return Outcome(closest, scene.shape, scene.incline_deg)


def seen(scene: SimulatedScene, line: LaserLine) -> BoolArray:
    """Mask (n,) of the lasers whose spots are visible.

    Raises:
        BadInputError: `lost` names a laser that the line does not have.
    """
    if (missing := [n for n in scene.lost if n > len(line.ids)]) != []:
        raise BadInputError(
            f"scene {scene.name}: lost: expected numbers from 1 to {len(line.ids)}, got {missing[0]}"
        )
    return np.array([n not in scene.lost for n in range(1, len(line.ids) + 1)])


def angle_deg(slope: float) -> float:
    """Incline of a slope, degrees."""
    return degrees(atan(slope))


def _front(line: LaserLine) -> FloatArray:
    return np.arange(0.0, line.front_mm[-1] + FRONT_STEP_MM / 2, FRONT_STEP_MM)
