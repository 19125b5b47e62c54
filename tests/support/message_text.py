"""What a message says, without its wording."""

from __future__ import annotations

import re


def numbers(text: str) -> list[float]:
    """Every number, in order; digits of a name such as `L2` are none."""
    return [float(n) for n in re.findall(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", text)]


def laser_ids(text: str) -> list[str]:
    """Lasers named `L1`, `L2`, ..., in order."""
    return re.findall(r"\bL\d+\b", text)
