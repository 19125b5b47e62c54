"""File of a calibrated scanning head: its parameters are complete."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.rigs import PROVENANCE
from workbench.calibration.verdict.yaml_text import yaml_text
from workbench.model.errors import BadInputError
from workbench.model.head_calibration import HEAD, HeadCalibration
from workbench.model.yamlfile import load_yaml_model
from workbench.optics.head import Head
from workbench.optics.rays import RAY
from workbench.sensor.scanning import CalibratedHead

NAMES = ["f_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3", "offset_mm"]
NAMES += [f"S.{name}" for name in RAY] + [f"head.{name}" for name in HEAD]


def document(names: list[str]) -> dict[str, Any]:
    count = len(names)
    values = dict(zip(NAMES, [500.0, 320.0, 240.0, *[0.0] * 6, 90.0, *[0.0] * 10], strict=True))
    head = {
        "format": 1,
        "laser": "S",
        "image_width": 640,
        "image_height": 480,
        "distortion_model": "plumb_bob",
        "reading_sd_deg": 0.01,
        "noise": {"spot_sd_px": 0.05, "speckle_sd_px": 0.0},
        "parameters": {
            "names": names,
            "units": ["1"] * count,
            "values": [values[name] for name in names],
            "sd": [1e-3] * count,
            "prior_sd": [1.0] * count,
            "data_share": [1.0] * count,
            "determined_by": ["data"] * count,
            "covariance": {"rows": count, "cols": count, "data": (1e-6 * np.eye(count)).ravel().tolist()},
        },
        "readings_deg": [-10.0, 10.0],
        "standoffs_mm": [300.0, 900.0],
        "fit": {"moves": 9, "rms_px": 0.05, "chi2": 9.0, "degrees_of_freedom": 10.0, "noise_scale": 1.0},
        "provenance": PROVENANCE.model_dump(),
    }
    return {"scanning_head": head}


def load(path: Path, names: list[str]) -> HeadCalibration:
    path.write_text(yaml_text(document(names)))
    return load_yaml_model(path, HeadCalibration)


def test_a_file_in_any_order_of_parameters_gives_the_same_points(tmp_path: Path) -> None:
    spot, sd = np.array([[370.0, 240.0]]), np.full((1, 2), 0.05)
    found = [
        CalibratedHead(load(tmp_path / "head.yaml", names)).points(np.zeros(1), spot, sd)
        for names in (NAMES, NAMES[::-1])
    ]
    # 50 px at f = 500 px and a beam 90 mm beside the axis: 900 mm.
    np.testing.assert_allclose(found[0].position_mm, [[90.0, 0.0, 900.0]], atol=1e-9)
    np.testing.assert_allclose(found[0].position_mm, found[1].position_mm)
    np.testing.assert_allclose(found[0].covariance_mm2, found[1].covariance_mm2)


def test_the_names_are_those_of_the_optics() -> None:
    assert Head._fields == HEAD
    assert tuple(name.removeprefix("S.") for name in NAMES[9:13]) == RAY


@pytest.mark.parametrize("name", ["k3", "S.tx", "head.scale", "offset_mm"])
def test_a_missing_parameter_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInputError, match=f"expected {name} among them"):
        load(tmp_path / "head.yaml", [one for one in NAMES if one != name])
