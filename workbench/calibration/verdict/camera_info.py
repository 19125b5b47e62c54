"""Parts that calibration files with and without lasers share: the camera, and the parameters."""

from __future__ import annotations

import numpy as np

from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.verdict.assessment import determined_by
from workbench.model.calibration import CameraInfo, Matrix, Parameters


def camera_info(fit: CalibrationFit) -> CameraInfo:
    """Camera of the fit."""
    camera, model, lens = fit.rig.camera, fit.layout.model, fit.layout.lens
    values = dict(zip((p.name for p in fit.table.parameters[lens]), fit.values[lens].tolist(), strict=True))
    f, cx, cy = values["f_px"], values["cx_px"], values["cy_px"]
    return CameraInfo(
        image_width=camera.width_px,
        image_height=camera.height_px,
        camera_name=fit.rig.rig,
        camera_matrix=Matrix(rows=3, cols=3, data=(f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0)),
        distortion_model=model.name,
        distortion_coefficients=Matrix(
            rows=1, cols=len(model.coefficients), data=tuple(values[name] for name in model.coefficients)
        ),
        rectification_matrix=Matrix(rows=3, cols=3, data=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)),
        projection_matrix=Matrix(rows=3, cols=4, data=(f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0)),
    )


def parameters(fit: CalibrationFit, part: slice) -> Parameters:
    """Parameters of a part of the fit that contains the lens, with their covariance."""
    table = fit.table.parameters[part]
    names = [p.name for p in table]
    covariance = np.array(fit.covariance[part, part])
    # The image was anywhere along its drift: half the drift is added as the deviation of the image centre.
    centre = [names.index(name) for name in ("cx_px", "cy_px")]
    covariance[centre, centre] += (fit.drift_px / 2) ** 2
    symmetric = (covariance + covariance.T) / 2
    return Parameters(
        names=tuple(names),
        units=tuple(p.unit for p in table),
        values=tuple(fit.values[part].tolist()),
        sd=tuple(np.sqrt(np.diag(symmetric)).tolist()),
        prior_sd=tuple(p.prior.sd for p in table),
        data_share=tuple(fit.data_share[part].tolist()),
        determined_by=determined_by(fit)[part],
        covariance=Matrix(rows=len(table), cols=len(table), data=tuple(symmetric.ravel().tolist())),
    )
