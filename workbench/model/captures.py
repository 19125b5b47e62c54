"""Reader of captures.csv, one row per capture, for data of any origin (docs/captures-format.md)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import isfinite, isnan, nan
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError, model_validator

from workbench.model.csvfile import CsvRow, check_header, parse_csv, read_csv
from workbench.model.errors import BadInputError
from workbench.model.file_kind import kind_of_content
from workbench.model.problems import problems
from workbench.model.yamlfile import FileModel

EXPECTED = "a captures file (CSV)"
ALL_LASERS = "all"
BOARD = "board"
"""Value of `laser_id` for a frame of the printed board in room light, all lasers off."""
REQUIRED = ("laser_id", "standoff_mm", "repeat")
IMAGES = ("on", "off")
POSITION = ("u_px", "v_px")
OPTIONAL = (
    "scene",
    "placement",
    "standoff_sd_mm",
    "u_sd_px",
    "v_sd_px",
    "tilt_deg",
    "exposure",
    "exposure_unit",
    "time_s",
    "part",
)
LARGEST = 1e6
"""Largest accepted number of millimetres or pixels."""
LARGEST_S = 1e11
"""Largest accepted time, some 3000 years: seconds since 1970 are accepted too."""
NEAREST_MM = 1e-3
SMALLEST_SD_PX = 1e-6
MOST_REPEATS = 99_999_999
COLUMNS = (*REQUIRED, *IMAGES, *POSITION, *OPTIONAL)


Millimetres = Annotated[float, Field(le=LARGEST)]
Pixels = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
PixelSd = Annotated[float, Field(ge=SMALLEST_SD_PX, le=LARGEST)]


class CaptureRow(FileModel):
    """One row. Empty numbers are NaN; `on` is None for a row that states a position instead of images."""

    row: int
    """Line number in the file; the header is row 1."""
    laser_id: str
    standoff_mm: Annotated[Millimetres, Field(ge=NEAREST_MM)] = nan
    repeat: Annotated[int, Field(ge=0, le=MOST_REPEATS)]
    on: Path | None = None
    off: Path | None = None
    u_px: Pixels = nan
    v_px: Pixels = nan
    scene: str = ""
    """Empty if not stated."""
    placement: str = ""
    """Name of the placement for a fit; empty: the scene, or else the standoff, is the placement."""
    standoff_sd_mm: Annotated[Millimetres, Field(ge=0)] = nan
    u_sd_px: PixelSd = nan
    v_sd_px: PixelSd = nan
    tilt_deg: Annotated[float, Field(gt=-90, lt=90)] = nan
    exposure: Annotated[float, Field(gt=0, le=LARGEST)] = nan
    """Exposure of the frames, for the record only."""
    exposure_unit: str = ""
    """Unit of `exposure`; empty: the camera driver's own."""
    time_s: Annotated[float, Field(ge=-LARGEST_S, le=LARGEST_S)] = nan
    """Time of the capture, from any zero."""
    part: str = ""
    """Name of the uninterrupted part of the session."""

    @property
    def placement_key(self) -> str:
        """Name of the placement for a fit: as stated, else the scene, else the standoff.

        A view of a board at no stated standoff is a placement of its own, named by its image.
        """
        if self.laser_id == BOARD and isnan(self.standoff_mm) and self.on is not None:
            return self.placement or self.scene or self.on.name
        return self.placement or self.scene or f"{self.standoff_mm:g} mm"

    @model_validator(mode="after")
    def _has_an_image_or_a_position(self) -> CaptureRow:
        measured = isfinite(self.u_px) or isfinite(self.v_px)
        if (self.on is not None) == measured:
            got = "both" if measured else "neither"
            raise ValueError(f"on: expected either an image, or a position in u_px or v_px, got {got}")
        if measured and self.laser_id in {ALL_LASERS, BOARD}:
            raise ValueError(
                f"laser_id: expected the id of one laser in a row with a position, got {self.laser_id}"
            )
        return self


def load_captures(path: Path) -> tuple[CaptureRow, ...]:
    """Read a captures file; the image paths returned are relative to the current folder.

    Raises:
        BadInputError: see `read_captures_file` and `parse_captures`.
    """
    return parse_captures(path, read_captures_file(path))


def read_captures_file(path: Path) -> bytes:
    """Bytes of a captures file.

    Raises:
        BadInputError: the file cannot be read, or is of another kind.
    """
    content = read_csv(path, EXPECTED)
    if (kind := kind_of_content(content)) is not None:
        raise BadInputError(f"{path}: expected {EXPECTED}, got {kind}")
    return content


def parse_captures(path: Path, content: bytes) -> tuple[CaptureRow, ...]:
    """Rows of a captures file.

    Args:
        path: file that `content` was read from; image paths are relative to its folder.
        content: bytes of the file.

    Raises:
        BadInputError: a column is missing or unknown, there are no rows, or values are wrong; one line for
            each wrong value, with row, column, expected value and actual value.
    """
    lines: dict[tuple[str, ...], int] = {}
    repeated: list[tuple[int, int]] = []

    def parse_row(row: CsvRow) -> CaptureRow:
        if (first := lines.setdefault((*row.cells, *row.cells.values()), row.line)) != row.line:
            repeated.append((row.line, first))
        return _row(path, row)

    rows = parse_csv(path, content, EXPECTED, lambda names: _check_header(path, names), parse_row)
    if not rows:
        raise BadInputError(f"{path}: expected at least one row below the header, got none")
    _refuse_repeated(path, repeated)
    return tuple(rows)


def _refuse_repeated(path: Path, repeated: Sequence[tuple[int, int]]) -> None:
    """Refuse rows that are pasted twice: as further repeats they would understate every deviation.

    Args:
        path: file, for messages.
        repeated: line of each repeated row, and of the first one with the same values.
    """
    if repeated:
        line, first = repeated[0]
        more = f" ({len(repeated) - 1} more rows repeat others)" if len(repeated) > 1 else ""
        raise BadInputError(
            f"{path}: row {line} repeats row {first} in every column{more}; remove it, or give another"
            " capture its own number in the column repeat"
        )


def check_images(path: Path, rows: Sequence[CaptureRow]) -> None:
    """Check that all images exist.

    Raises:
        BadInputError: images are missing; one line for each.
    """
    wrong = [
        f"{path}: row {row.row}, column {column}: no such file: {image}; expected an image"
        for row in rows
        for column, image in (("on", row.on), ("off", row.off))
        if image is not None and not image.is_file()
    ]
    if wrong:
        raise BadInputError("\n".join(wrong))


@contextmanager
def errors_name_file(path: Path) -> Iterator[None]:
    """Prefix every line of an error about rows with the file that contains them.

    Raises:
        BadInputError: raised within the context.
    """
    try:
        yield
    except BadInputError as error:
        raise BadInputError("\n".join(f"{path}: {line}" for line in str(error).splitlines())) from None


def _check_header(path: Path, present: list[str]) -> None:
    if len(present) == 1 and (
        present[0].startswith("%YAML") or present[0].rstrip().endswith(":") or ": " in present[0]
    ):
        raise BadInputError(
            f"{path}: expected a captures file (CSV) with the columns {', '.join(COLUMNS)}; got YAML"
        )
    check_header(path, present, REQUIRED, COLUMNS)
    if "on" not in present and not set(POSITION) & set(present):
        raise BadInputError(
            f"{path}: row 1: expected either the column on (images) or u_px and v_px (positions)"
        )


def _row(path: Path, row: CsvRow) -> CaptureRow:
    """Validate the cells of one row.

    Raises:
        BadInputError: values are wrong; one line for each, with row and column.
    """
    given = row.cells
    images = {name: path.parent / given[name] for name in IMAGES if name in given}
    try:
        return CaptureRow.model_validate({**given, **images, "row": row.line})
    except ValidationError as error:
        found = problems(CaptureRow, given, error.errors())
        # A rule about the whole row names its column in its own text.
        lines = [one.message if one.location else one.text for one in found]
        where = f"{path}: row {row.line}"
        raise BadInputError("\n".join(f"{where}, column {line}" for line in lines)) from None
