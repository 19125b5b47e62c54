"""Calibration of a fitted scanning head, and the text of its file."""

from __future__ import annotations

from math import degrees, hypot

import numpy as np

from workbench.calibration.scanning.fit import HeadFit
from workbench.calibration.scanning.prediction import HeadLayout
from workbench.calibration.verdict.assessment import basis
from workbench.calibration.verdict.yaml_text import yaml_text
from workbench.model.calibration import Matrix, Noise, Parameters, Provenance
from workbench.model.head_calibration import HeadCalibration, HeadFitSummary, ScanningHead

SIGNIFICANT_SD = 2.0
"""Amplitude of an eccentricity, in its standard deviations, below which its phase is not determined."""


def calibrated_head(fit: HeadFit, provenance: Provenance) -> HeadCalibration:
    """Calibration of a fit."""
    rig, spots = fit.rig, fit.spots
    standoffs = [one.standoff_mm for one in spots.placements]
    return HeadCalibration(
        scanning_head=ScanningHead(
            format=1,
            laser=rig.scanning_head.laser,
            image_width=rig.camera.width_px,
            image_height=rig.camera.height_px,
            distortion_model=rig.camera.lens,
            reading_sd_deg=rig.scanning_head.reading_sd_deg,
            noise=Noise(spot_sd_px=rig.noise.spot_sd_px, speckle_sd_px=rig.noise.speckle_sd_px),
            parameters=_parameters(fit),
            readings_deg=(float(spots.reading_deg.min()), float(spots.reading_deg.max())),
            standoffs_mm=(min(standoffs), max(standoffs)),
            fit=HeadFitSummary(
                moves=len(spots.placement),
                rms_px=float(np.sqrt(np.mean(fit.residual_px**2))),
                chi2=fit.chi2,
                degrees_of_freedom=fit.degrees_of_freedom,
                noise_scale=fit.noise_scale,
                warnings=tuple(warnings(fit)),
            ),
            provenance=provenance,
        )
    )


def render(calibration: HeadCalibration) -> str:
    """Text of the file."""
    return yaml_text(calibration.model_dump(mode="json"))


def warnings(fit: HeadFit) -> list[str]:
    """Warnings of undetermined parameters, and of noise beyond the stated one."""
    found = []
    if fit.noise_scale > 1:
        found.append(
            f"the residuals are {fit.noise_scale:.2f} times as large as stated; all deviations are scaled by"
            " this"
        )
    own = [name for name in undetermined(fit) if not name.startswith("head.eccentricity")]
    if own:
        found.append(f"not determined by these captures, as known before: {', '.join(own)}")
    amplitude, amplitude_sd, phase_sd = eccentricity_deg(fit)
    if phase_sd is None:
        found.append(
            f"the phase of the encoder's eccentricity is not determined: its amplitude is {amplitude:.2g} +-"
            f" {amplitude_sd:.2g} deg (1 sigma); only a larger arc separates it from zero and scale"
        )
    return found


def undetermined(fit: HeadFit) -> list[str]:
    """Names of the sensor's parameters whose priors the captures hardly narrow."""
    sensor = range(HeadLayout(fit.rig.camera.lens).head.stop)
    return [
        fit.table.parameters[n].name
        for n in sensor
        if fit.table.prior_sd[n] > 0
        and basis(float(fit.data_share[n]), float(fit.sd[n]), float(fit.table.prior_sd[n])) == "prior"
    ]


def eccentricity_deg(fit: HeadFit) -> tuple[float, float, float | None]:
    """Amplitude of the encoder's eccentricity and its deviation, and that of its phase; None: not determined.

    The deviation along the vector (a, b) is that of the amplitude r. The one across it, divided by r, is that
    of the phase. Where r is below SIGNIFICANT_SD times the larger of both deviations, there is no phase.
    """
    names = [parameter.name for parameter in fit.table.parameters]
    at = [names.index(f"head.eccentricity_{part}_rad") for part in ("cos", "sin")]
    (a, b), covariance = fit.values[at].tolist(), fit.covariance[np.ix_(at, at)]
    amplitude = hypot(a, b)
    along = np.array([a, b]) / amplitude if amplitude > 0 else np.array([1.0, 0.0])
    across = np.array([-along[1], along[0]])
    sd, across_sd = (float(np.sqrt(one @ covariance @ one)) for one in (along, across))
    phase = degrees(across_sd / amplitude) if amplitude > SIGNIFICANT_SD * max(sd, across_sd) else None
    return degrees(amplitude), degrees(sd), phase


def _parameters(fit: HeadFit) -> Parameters:
    sensor = slice(0, HeadLayout(fit.rig.camera.lens).head.stop)
    known = fit.table.parameters[sensor]
    share, sd, prior_sd = (column[sensor].tolist() for column in (fit.data_share, fit.sd, fit.table.prior_sd))
    covariance = fit.covariance[sensor, sensor]
    return Parameters(
        names=tuple(parameter.name for parameter in known),
        units=tuple(parameter.unit for parameter in known),
        values=tuple(fit.values[sensor].tolist()),
        sd=tuple(sd),
        prior_sd=tuple(prior_sd),
        data_share=tuple(share),
        determined_by=tuple(basis(*one) for one in zip(share, sd, prior_sd, strict=True)),
        covariance=Matrix(
            rows=len(known), cols=len(known), data=tuple(((covariance + covariance.T) / 2).ravel().tolist())
        ),
    )
