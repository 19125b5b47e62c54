"""The YAML text of a calibration, in the subset that OpenCV, ROS, yaml-cpp and PyYAML read alike.

General YAML writers produce more than this subset. OpenCV refuses plain strings that begin with a digit or
span several lines, and empty values. A list of mappings must be indented under its key. PyYAML reads 1e-05
as a string. Therefore strings are quoted, floats have a decimal point, and a list of numbers or words is
one line. None is written as `null`, which OpenCV reads as a node without a value.

Text that some reader cannot read in any form is changed. A control character becomes a space. A string beyond
OpenCV's limit, with which it could not read the file, ends with an ellipsis.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\ufffe\uffff]")
"""Characters that YAML requires as numeric escapes, which OpenCV does not read."""
LONGEST_BYTES = 4095
"""Longest string that OpenCV reads, in bytes of UTF-8."""
ELLIPSIS = "…"


def yaml_text(document: Mapping[str, Any]) -> str:
    """YAML of a document of non-empty mappings, lists, strings, finite numbers, booleans and None.

    Raises:
        ValueError: a number is not finite.
    """
    return "\n".join(["%YAML 1.2", "---", *_mapping(document, ""), ""])


def _mapping(mapping: Mapping[str, Any], indent: str) -> list[str]:
    lines = []
    for key, value in mapping.items():
        if isinstance(value, Mapping):
            lines += [f"{indent}{key}:", *_mapping(value, indent + "  ")]
        elif isinstance(value, tuple | list) and any(map(_needs_own_line, value)):
            lines.append(f"{indent}{key}:")
            for item in value:
                lines += _item(item, indent + "  ")
        else:
            lines.append(f"{indent}{key}: {_flow(value)}")
    return lines


def _needs_own_line(item: Any) -> bool:
    """Whether an item is a mapping or a sentence."""
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
        text = float.__repr__(value)  # numpy's float64 is a float with another repr
        return text if "." in text else text.replace("e", ".0e")
    if isinstance(value, str):
        return json.dumps(plain(value), ensure_ascii=False)  # JSON's escapes are YAML's as well
    return json.dumps(value)


def plain(text: str) -> str:
    """A text without unprintable characters, cut at the length that every reader reads."""
    spaced = UNPRINTABLE.sub(" ", text)
    if len(spaced.encode()) <= LONGEST_BYTES:
        return spaced
    return spaced.encode()[: LONGEST_BYTES - len(ELLIPSIS.encode())].decode(errors="ignore") + ELLIPSIS
