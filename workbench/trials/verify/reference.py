"""Ruler and rail of a verification: scale of the ruler and tilt of the target's mount, with their covariance.

A standoff s is read off a ruler; the target has the slopes m, n that all placements share. The true range at
the point (x, y) of a beam is s + B b, with b = (ruler_scale, m, n) and B = (s, x, y). The sensor measures it
with the error -G d, where d is the error of the calibration's parameters. Measured - standoff is therefore
B b - G d: all placements and lasers share b and d.

Of the bench of the calibration, b is known by the calibration itself, and correlated with d. A ruler that is
long by 0.1 % gives a calibration whose ranges are long too, and the two cancel. Of any other bench, b has the
priors of the rig file and is independent of d. The variance of the errors is then larger in every direction
that the two share. A bench taken for another one refuses fewer valid calibrations, never more; another bench
taken for that of the calibration refuses more.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError
from workbench.model.rig import TARGET_TILT, BenchSpec
from workbench.sensor.calibrated import CalibratedSensor

SHARED = ("ruler_scale", *TARGET_TILT)
"""Parameters of the bench that all placements share."""
OFFSET = "offset_mm"


@dataclass(frozen=True)
class Reference:
    """Errors that all standoffs of a verification share, by calibration and bench."""

    shared: FloatArray
    """(3,) expected ruler scale and slopes of the target."""
    covariance: FloatArray
    """(P + 3, P + 3) of the calibration's parameters and of `shared`."""
    tilt_sd: float
    """1 sigma of the tilt of one placement about each axis, rad."""
    offset_mm: float
    """Distance of the pinhole behind the plane from which standoffs count, by the calibration."""
    offset_column: int
    """Index of this parameter."""

    @classmethod
    def own(cls, sensor: CalibratedSensor, bench: BenchSpec) -> Reference:
        """Ruler and rail independent of those of the calibration, as the rig file states them."""
        priors = (bench.ruler_scale, bench.target_slope_x, bench.target_slope_y)
        count = len(sensor.covariance)
        covariance = np.zeros((count + len(SHARED),) * 2)
        covariance[:count, :count] = sensor.covariance
        covariance[count:, count:] = np.diag([prior.sd**2 for prior in priors])
        expected = np.array([prior.value for prior in priors])
        return cls(
            expected, covariance, radians(bench.tilt_sd_deg), sensor.offset_mm, _names(sensor).index(OFFSET)
        )

    @classmethod
    def of_calibration(cls, sensor: CalibratedSensor, bench: BenchSpec) -> Reference:
        """Ruler and rail of the calibration, unchanged since.

        Raises:
            BadInputError: the calibration does not contain the parameters of its bench.
        """
        parameters = sensor.calibration.laser_ranger.parameters
        if missing := [name for name in SHARED if name not in parameters.names]:
            raise BadInputError(
                f"same_bench: expected a calibration with {', '.join(SHARED)} among its parameters, got one"
                f" without {', '.join(missing)}; remove same_bench, or calibrate again"
            )
        columns = [parameters.names.index(name) for name in SHARED]
        order = [*range(len(parameters.names)), *columns]
        return cls(
            np.array(parameters.values)[columns],
            sensor.covariance[np.ix_(order, order)],
            radians(bench.tilt_sd_deg),
            sensor.offset_mm,
            _names(sensor).index(OFFSET),
        )

    def gradient(self, by_parameter: FloatArray, by_shared: FloatArray) -> FloatArray:
        """(n, P + 3) derivatives of n errors by the true parameters.

        Args:
            by_parameter: (n, P) derivatives of the ranges by the parameters of the calibration.
            by_shared: (n, 3) standoff, x and y of each range, mm.
        """
        return np.concatenate([-by_parameter, by_shared], axis=1)


def _names(sensor: CalibratedSensor) -> tuple[str, ...]:
    return sensor.calibration.laser_ranger.parameters.names
