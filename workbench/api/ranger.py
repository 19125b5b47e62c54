"""Ranging of frame pairs with a calibration."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from workbench.api.arguments import shape_prior_of, text_of
from workbench.api.calibration import Calibration, calibration_of
from workbench.model.arrays import Image
from workbench.model.errors import BadInputError
from workbench.ranging.ranger import Ranger as SpotRanger
from workbench.ranging.ranger import Reading
from workbench.ranging.shape import DEFAULT_PRIOR
from workbench.ranging.shape_prior import ShapePrior
from workbench.spots import SpotFinder


class Ranger:
    """Ranges and shape from pairs of frames; needs a calibration and nothing else.

    Examples:
        >>> import workbench as wb
        >>> session = wb.open_session("data/session-0.1.0")
        >>> ranger = wb.Ranger(session.calibration)
        >>> capture = session.captures.query("laser_id == 'all'").iloc[0]
        >>> on, off = session.frame(capture["capture"]), session.frame(capture["capture"], off=True)
        >>> reading = ranger.range(on, off)
        >>> reading.status, round(reading.closest_mm)
        ('done', 800)

    Args:
        calibration: a calibration, or the path of its file.
        shape_prior: prior over the shapes in front of a line of lasers.

    Raises:
        BadInputError: the file is missing or wrong, or the calibration is refused and was not accepted with a
            reason. The prior is none.
    """

    def __init__(
        self, calibration: Calibration | str | Path, shape_prior: ShapePrior = DEFAULT_PRIOR
    ) -> None:
        self.calibration = calibration_of("calibration", calibration)
        self.shape_prior = shape_prior_of(shape_prior)
        if not self.calibration.file.laser_ranger.fit.usable:
            reasons = "; ".join(self.calibration.reasons)
            raise BadInputError(f"calibration: expected an accepted one, got one refused: {reasons}")

    def range(self, on: Image, off: Image | None = None, scene: str = "") -> Reading:
        """One reading of a frame with every laser on.

        Args:
            on: (height, width), uint8 or uint16, every laser on.
            off: the same with all lasers off; None where there is no ambient light.
            scene: name for the reading.

        Returns:
            Ranges in mm from the reference plane, 1 sigma, with intervals of 95 %. Lasers with ambiguous
            spots have no range.

        Raises:
            BadInputError: a frame has another size or type than the calibration's, or the name is no text.
        """
        name = text_of("scene", scene)
        return self._ranger.read_lit(name, self._finder.find(on, off).spots)

    @cached_property
    def _ranger(self) -> SpotRanger:
        return SpotRanger(self.calibration.file, shape_prior=self.shape_prior)

    @cached_property
    def _finder(self) -> SpotFinder:
        """Searches the bands of all lasers."""
        lasers = self._ranger.sensor.ids
        width, height = self._ranger.size_px
        return SpotFinder(
            (height, width),
            self._ranger.searched(lasers),
            expected=len(lasers),
            speckle_sd_px=self._ranger.speckle_sd_px,
        )
