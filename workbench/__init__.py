"""Calibration and lab-measurement workbench for laser-spot range sensors.

The names in `__all__` are the public interface, documented in docs/api.md. They are imported on first use, so
that the command line starts fast. All other modules are private to the project.
"""

import os
from importlib import import_module
from typing import TYPE_CHECKING

# Read by OpenCV when it is imported: an image file of 1 MB may decode to gigabytes. The largest cameras have
# 150 million pixels.
os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(2**28))

if TYPE_CHECKING:
    from workbench.api import BadInputError as BadInputError
    from workbench.api import Calibration as Calibration
    from workbench.api import CalibrationComparison as CalibrationComparison
    from workbench.api import CalibrationDesign as CalibrationDesign
    from workbench.api import LimitFailedError as LimitFailedError
    from workbench.api import Ranger as Ranger
    from workbench.api import Reading as Reading
    from workbench.api import Report as Report
    from workbench.api import Rig as Rig
    from workbench.api import Session as Session
    from workbench.api import ShapePrior as ShapePrior
    from workbench.api import Simulation as Simulation
    from workbench.api import Trial as Trial
    from workbench.api import WorkbenchError as WorkbenchError
    from workbench.api import compare as compare
    from workbench.api import design as design
    from workbench.api import draw as draw
    from workbench.api import fit as fit
    from workbench.api import load_calibration as load_calibration
    from workbench.api import open_session as open_session
    from workbench.api import sessions as sessions
    from workbench.api import simulate as simulate
    from workbench.api import with_prior as with_prior

__all__ = [
    "BadInputError",
    "Calibration",
    "CalibrationComparison",
    "CalibrationDesign",
    "LimitFailedError",
    "Ranger",
    "Reading",
    "Report",
    "Rig",
    "Session",
    "ShapePrior",
    "Simulation",
    "Trial",
    "WorkbenchError",
    "compare",
    "design",
    "draw",
    "fit",
    "load_calibration",
    "open_session",
    "sessions",
    "simulate",
    "with_prior",
]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("workbench.api"), name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
