"""Text of a rig file for one sensor of many."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

from ruamel.yaml import YAML

from workbench.model.yamlfile import parse_document


def rig_text_of(text: str, serial: str, settings: Mapping[str, Mapping[str, object]] | None = None) -> str:
    """Text of a rig file with another serial number; comments are kept.

    Args:
        text: valid rig file.
        serial: serial number of the sensor.
        settings: further values, by block and key.
    """
    data = parse_document(text, Path("rig file")).data
    data["serial"] = serial
    for block, values in (settings or {}).items():
        data[block].update(values)
    stream = io.StringIO()
    YAML().dump(data, stream)
    return stream.getvalue()
