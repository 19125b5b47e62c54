"""The public interface for notebooks and programs; `workbench` exports its names.

Everything returns values or data frames and prints nothing. Errors are subclasses of `WorkbenchError`.
"""

from workbench.api.calibration import Calibration, CalibrationComparison, compare, fit, load_calibration
from workbench.api.calibration_design import CalibrationDesign, design
from workbench.api.charts import draw
from workbench.api.priors import with_prior
from workbench.api.ranger import Ranger
from workbench.api.report import Report
from workbench.api.session import Session, Trial, open_session, sessions
from workbench.api.simulation import Simulation, simulate
from workbench.model.errors import BadInputError, LimitFailedError, WorkbenchError
from workbench.model.rig import Rig
from workbench.ranging.ranger import Reading
from workbench.ranging.shape_prior import ShapePrior

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
