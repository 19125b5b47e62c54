"""Text of numbers with as many digits as their standard deviation justifies."""

from __future__ import annotations

from math import floor, log10

SECONDS_BELOW_S = 120
MINUTES_BELOW_S = 7200


def significant(value: float, sd: float) -> str:
    """Text of `value` to the second significant digit of its standard deviation; all digits if `sd` is 0."""
    if sd <= 0:
        return f"{value:g}"
    digits = max(0, 1 - floor(log10(sd)))
    # Adding zero turns a rounded -0.0 into 0.0.
    return f"{round(value, digits) + 0.0:.{digits}f}"


def with_sd(value: float, sd: float) -> str:
    """Text of a value with its standard deviation: `500.3 +- 0.4`."""
    return f"{significant(value, sd)} +- {two_digits(sd)}"


def two_digits(sd: float) -> str:
    """Text with two significant digits, without an exponent for moderate numbers."""
    return f"{float(f'{sd:.2g}'):g}"


def probability(p: float) -> str:
    """Text of a p value: `p = 0.031`; close to 1, where its digits mean nothing, `p > 0.99`."""
    return "p > 0.99" if p > 0.99 else f"p = {p:.2g}"


def counted(number: int, thing: str) -> str:
    """Text of a number of things whose plural ends with s: `1 spot`, `2 spots`."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def duration(seconds: float) -> str:
    """Text of a duration: seconds below two minutes, minutes below two hours, else hours (`3.5 h`)."""
    if seconds < SECONDS_BELOW_S:
        return f"{seconds:.0f} s"
    if seconds < MINUTES_BELOW_S:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
