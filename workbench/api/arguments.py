"""Arguments of the public interface: checked, and converted to the types of the project."""

from __future__ import annotations

import errno
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from workbench.model.errors import BadInputError
from workbench.model.problems import short
from workbench.model.rig import Rig, load_rig
from workbench.ranging.shape_prior import ShapePrior

MOST = 1_000_000
"""Largest accepted whole number."""
MOST_MM = 1e6
"""Largest accepted length, mm: 1 km, beyond every sensor of this kind."""
NO_FILE = {errno.ENOENT, errno.ENOTDIR, errno.EACCES}
"""Errors of a path that can be one, whose file a reader names, or a writer makes."""


def path_of(name: str, given: object, expected: str) -> Path:
    """Path from a string or a path.

    Args:
        name: name of the argument, for messages.
        given: its value.
        expected: what it should be, for messages.

    Raises:
        BadInputError: it is neither, an empty string, or has a character or a length that no path can have.
    """
    if isinstance(given, str | Path) and str(given) and _can_be_path(given):
        return Path(given)
    raise BadInputError(f"{name}: expected {expected}, got {_shown(given)}")


def _can_be_path(given: str | Path) -> bool:
    try:
        Path(given).stat()
    except OSError as error:
        return error.errno in NO_FILE
    except ValueError:  # a character of no path
        return False
    return True


def rig_of(rig: object) -> Rig:
    """The rig itself, or the contents of its file.

    Raises:
        BadInputError: it is no rig, or the file is missing or wrong.
    """
    return rig if isinstance(rig, Rig) else load_rig(path_of("rig", rig, "a rig, or the path of its file"))


def millimetres_of(name: str, given: object) -> tuple[float, ...]:
    """Lengths from one number or several.

    Args:
        name: name of the argument, for messages.
        given: its value.

    Raises:
        BadInputError: it is not a number, or a sequence or set of them, within 1 km.
    """
    if isinstance(given, Collection) and not isinstance(given, str | bytes | Mapping | np.ndarray):
        given = list(given)  # also a set
    try:
        array = np.asarray(given)
    except ValueError:  # rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in "iuf" or array.ndim > 1 or not (np.abs(array) <= MOST_MM).all():
        raise BadInputError(
            f"{name}: expected a number in mm or a list of them, at most {MOST_MM:g}, got {_shown(given)}"
        )
    return tuple(np.atleast_1d(array).astype(float).tolist())


def whole_of(name: str, given: object, least: int = 1) -> int:
    """A whole number from `least` to `MOST`.

    Raises:
        BadInputError: it is none.
    """
    if isinstance(given, int | np.integer) and not isinstance(given, bool) and least <= given <= MOST:
        return int(given)
    raise BadInputError(f"{name}: expected a whole number from {least} to {MOST}, got {_shown(given)}")


def words_of(name: str, given: object, expected: str) -> str:
    """A string that is not blank.

    Args:
        name: name of the argument, for messages.
        given: its value.
        expected: what it should be, for messages.

    Raises:
        BadInputError: it is no string, or blank.
    """
    if isinstance(given, str) and given.strip():
        return given
    raise BadInputError(f"{name}: expected {expected}, got {_shown(given)}")


def text_of(name: str, given: object) -> str:
    """A string, which may be empty.

    Raises:
        BadInputError: it is no string.
    """
    if isinstance(given, str):
        return given
    raise BadInputError(f"{name}: expected a text, got {_shown(given)}")


def names_of(name: str, given: object) -> tuple[str, ...]:
    """Names from one string or several.

    Raises:
        BadInputError: it is not a string or a collection of them.
    """
    if isinstance(given, str):
        return (given,)
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if isinstance(given, Collection) and all(isinstance(each, str) for each in given):
        return tuple(given)
    raise BadInputError(f"{name}: expected a name or a list of names, got {_shown(given)}")


def shape_prior_of(given: object) -> ShapePrior:
    """The prior itself.

    Raises:
        BadInputError: it is none.
    """
    if isinstance(given, ShapePrior):
        return given
    raise BadInputError(f"shape_prior: expected a ShapePrior, got {_shown(given)}")


def _shown(given: object) -> str:
    """A value in a message, in one line."""
    return " ".join(short(given).split())
