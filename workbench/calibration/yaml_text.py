"""The YAML text of a calibration, in the subset that OpenCV, ROS, yaml-cpp and PyYAML read alike.

A writer of YAML in general does not keep to it. OpenCV refuses a plain string that begins with a digit, one
that goes on in the next line, an empty value, and a list of mappings that is not indented under its key;
PyYAML takes 1e-05 for a string. So strings are quoted, numbers have a decimal point, nothing is `null`, and
a list of numbers or words is one line.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

UNPRINTABLE = re.compile("[\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\ufffe\uffff]")
"""What YAML wants escaped, and JSON leaves as it is."""


def yaml_text(document: Mapping[str, Any]) -> str:
    """A document of mappings (none of them empty), lists, strings, numbers, booleans and None."""
    return "\n".join(["%YAML 1.2", "---", *_mapping(document, ""), ""])


def _mapping(mapping: Mapping[str, Any], indent: str) -> list[str]:
    lines = []
    for key, value in mapping.items():
        if isinstance(value, Mapping):
            lines += [f"{indent}{key}:", *_mapping(value, indent + "  ")]
        elif isinstance(value, tuple | list) and any(map(_has_its_own_line, value)):
            lines.append(f"{indent}{key}:")
            for item in value:
                lines += _item(item, indent + "  ")
        else:
            lines.append(f"{indent}{key}: {_flow(value)}")
    return lines


def _has_its_own_line(item: Any) -> bool:
    """Mappings, and sentences."""
    return isinstance(item, Mapping) or (isinstance(item, str) and " " in item)


def _item(item: Any, indent: str) -> list[str]:
    if not isinstance(item, Mapping):
        return [f"{indent}- {_flow(item)}"]
    first, *rest = _mapping(item, indent + "  ")
    return [f"{indent}- {first.lstrip()}", *rest]


def _flow(value: Any) -> str:
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_flow, value))}]"
    if isinstance(value, float):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    if isinstance(value, str):
        # JSON's escapes are YAML's as well; `\u` of four digits is enough for the few that JSON has none for.
        return UNPRINTABLE.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(value, ensure_ascii=False))
    return json.dumps(value)
