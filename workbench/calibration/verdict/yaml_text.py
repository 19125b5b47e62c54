"""The YAML text of a calibration, in the subset that OpenCV, ROS, yaml-cpp and PyYAML read alike.

A writer of YAML in general does not keep to it. OpenCV refuses a plain string that begins with a digit, one
that goes on in the next line, an empty value, and a list of mappings that is not indented under its key;
PyYAML takes 1e-05 for a string. So strings are quoted, floats have a decimal point, None is written as `null`
(OpenCV reads it as a node without a value), and a list of numbers or words is one line.

What no escape or length brings through all of them is not written: a control character becomes a space, and a
string that is too long for OpenCV, which would read nothing of the whole file, ends with an ellipsis.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\ufffe\uffff]")
"""What YAML wants escaped by a code, which OpenCV does not read; tab and the ends of lines it does."""
LONGEST_BYTES = 4095
"""Of a string in UTF-8 that OpenCV reads."""
ELLIPSIS = "…"


def yaml_text(document: Mapping[str, Any]) -> str:
    """A document of mappings (none of them empty), lists, strings, finite numbers, booleans and None.

    Raises:
        ValueError: a number is not finite.
    """
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
        if not math.isfinite(value):
            raise ValueError(f"expected a finite number, got {value}")
        text = float.__repr__(value)  # numpy's are floats too, with a text of their own
        return text if "." in text else text.replace("e", ".0e")
    if isinstance(value, str):
        return json.dumps(plain(value), ensure_ascii=False)  # JSON's escapes are YAML's as well
    return json.dumps(value)


def plain(text: str) -> str:
    """As much of a text as every reader reads."""
    spaced = UNPRINTABLE.sub(" ", text)
    if len(spaced.encode()) <= LONGEST_BYTES:
        return spaced
    return spaced.encode()[: LONGEST_BYTES - len(ELLIPSIS.encode())].decode(errors="ignore") + ELLIPSIS
