"""Distribution functions under scipy.stats' names and order of arguments.

They call scipy.special, because importing scipy.stats takes longer than a fit. Arguments broadcast; results
are scalars or arrays accordingly. NaN propagates.
"""

from __future__ import annotations

from typing import Any

from scipy import special


def chi2_sf(x: Any, df: Any) -> Any:
    """Probability that a chi-square variable of `df` degrees of freedom exceeds `x`."""
    return special.chdtrc(df, x)


def chi2_isf(q: Any, df: Any) -> Any:
    """The value that a chi-square variable of `df` degrees of freedom exceeds with probability `q`."""
    return special.chdtri(df, q)


def f_sf(x: Any, dfn: Any, dfd: Any) -> Any:
    """Probability that an F variable of `dfn` and `dfd` degrees of freedom exceeds `x`."""
    return special.fdtrc(dfn, dfd, x)


def t_cdf(x: Any, df: Any) -> Any:
    """Probability that a Student t variable of `df` degrees of freedom is below `x`."""
    return special.stdtr(df, x)


def t_ppf(q: Any, df: Any) -> Any:
    """The value that a Student t variable of `df` degrees of freedom is below with probability `q`."""
    return special.stdtrit(df, q)


def f_ppf(q: Any, dfn: Any, dfd: Any) -> Any:
    """The value that an F variable of `dfn` and `dfd` degrees of freedom is below with probability `q`."""
    return special.fdtri(dfn, dfd, q)


def norm_cdf(x: Any) -> Any:
    """Probability that a standard normal variable is below `x`."""
    return special.ndtr(x)


def norm_ppf(q: Any) -> Any:
    """The value that a standard normal variable is below with probability `q`."""
    return special.ndtri(q)


def gamma_cdf(x: Any, a: Any) -> Any:
    """Probability that a gamma variable of shape `a` and scale 1 is below `x`."""
    return special.gammainc(a, x)


def gamma_sf(x: Any, a: Any) -> Any:
    """Probability that a gamma variable of shape `a` and scale 1 exceeds `x`."""
    return special.gammaincc(a, x)
