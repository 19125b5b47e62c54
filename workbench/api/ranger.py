"""Ranging of frame pairs with a calibration."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from workbench.api.calibration import Calibration
from workbench.model.arrays import Image
from workbench.model.errors import BadInputError
from workbench.ranging.ranger import Ranger as SpotRanger
from workbench.ranging.ranger import Reading
from workbench.spots import SpotFinder


@dataclass(frozen=True)
class Ranger:
    """Ranges and shape from pairs of frames; needs a calibration and nothing else.

    >>> import workbench as wb
    >>> session = wb.open_session("data/session-0.1.0")
    >>> ranger = wb.Ranger(session.calibration)
    >>> capture = session.captures.query("laser_id == 'all'").iloc[0]
    >>> on, off = session.frame(capture["capture"]), session.frame(capture["capture"], off=True)
    >>> reading = ranger.range(on, off)
    >>> reading.status, round(reading.closest_mm)
    ('done', 800)

    Raises:
        BadInputError: the calibration is refused and was not accepted with a reason.
    """

    calibration: Calibration

    def __post_init__(self) -> None:
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
            BadInputError: a frame has another size or type than the calibration's.
        """
        return self._ranger.read_lit(scene, self._finder.find(on, off).spots)

    @cached_property
    def _ranger(self) -> SpotRanger:
        return SpotRanger(self.calibration.file)

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
