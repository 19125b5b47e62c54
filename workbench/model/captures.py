"""captures.csv: the door for anyone's data, one row a capture. The format is in docs/captures-format.md."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path

from workbench.model.contents import not_text
from workbench.model.errors import BadInputError
from workbench.model.problems import one_of, short

ALL_LASERS = "all"
BOARD = "board"
"""In the place of a laser's id: a frame of the printed board in room light, no laser lit."""
REQUIRED = ("laser_id", "standoff_mm", "repeat")
IMAGES = ("on", "off")
POSITION = ("u_px", "v_px")
OPTIONAL = ("scene", "standoff_sd_mm", "u_sd_px", "v_sd_px", "tilt_deg", "exposure", "exposure_unit")
LARGEST = 1e6
"""Of any millimetres or pixels: a kilometre, and beyond every camera."""
NEAREST_MM = 1e-3
SMALLEST_SD_PX = 1e-6
LONGEST_REPEAT = 9
SEPARATORS = {";": "semicolons (;)", "\t": "tabs", "|": "bars (|)"}
"""Of other tables, and what people call them."""
COLUMNS = (*REQUIRED, *IMAGES, *POSITION, *OPTIONAL)


@dataclass(frozen=True)
class CaptureRow:
    """One row. NaN where a number was left empty; `on` is None for a row that gives the position itself."""

    row: int
    """Line of the file; the header is row 1."""
    laser_id: str
    standoff_mm: float
    repeat: int
    on: Path | None
    off: Path | None
    u_px: float
    v_px: float
    scene: str
    """Empty when not given."""
    standoff_sd_mm: float
    u_sd_px: float
    v_sd_px: float
    tilt_deg: float
    exposure: float = nan
    """Tells how a frame came about, nothing is computed from it."""
    exposure_unit: str = ""
    """Empty for the camera driver's own."""


def load_captures(path: Path) -> tuple[CaptureRow, ...]:
    """Read a captures file; image paths come back relative to the current folder.

    Raises:
        BadInputError: see `read_captures_file` and `parse_captures`.
    """
    return parse_captures(path, read_captures_file(path))


def read_captures_file(path: Path) -> bytes:
    """The file's bytes.

    Raises:
        BadInputError: it cannot be read.
    """
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise BadInputError(
            f"{path}: No such file; expected a captures file. A session has one once it came to its fit:"
            " `workbench resume` goes on with one that was stopped before"
        ) from None
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path}: expected a captures file: {error}") from None


def parse_captures(path: Path, content: bytes) -> tuple[CaptureRow, ...]:
    """The rows in `content`; `path` is where it comes from, and image paths are relative to.

    Raises:
        BadInputError: no such columns, no rows, or a wrong value; every wrong value is listed with its row
            and column, what was expected and what came.
    """
    if (came := not_text(content)) is not None:
        raise BadInputError(f"{path}: expected a captures file (CSV), got {came}")
    try:
        reader = csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline=""))
        _check_header(path, reader.fieldnames or [])
        rows, problems = [], []
        for cells in reader:
            try:
                rows.append(_Parser(path, reader.line_num, cells).row())
            except BadInputError as error:
                problems.append(str(error))
    except csv.Error as error:
        raise BadInputError(f"{path}: expected a captures file (CSV): {error}") from None
    if problems:
        raise BadInputError("\n".join(problems))
    if not rows:
        raise BadInputError(f"{path}: expected at least one row below the header, got none")
    return tuple(rows)


def check_images(path: Path, rows: Sequence[CaptureRow]) -> None:
    """See that all images are there.

    Raises:
        BadInputError: some are not; a line for each.
    """
    wrong = [
        f"{path}: row {row.row}, column {column}: expected an image, there is no file {image}"
        for row in rows
        for column, image in (("on", row.on), ("off", row.off))
        if image is not None and not image.is_file()
    ]
    if wrong:
        raise BadInputError("\n".join(wrong))


@contextmanager
def of_file(path: Path) -> Iterator[None]:
    """What is said of rows is said with the file that they stand in.

    Raises:
        BadInputError: as within.
    """
    try:
        yield
    except BadInputError as error:
        raise BadInputError("\n".join(f"{path}: {line}" for line in str(error).splitlines())) from None


def _check_header(path: Path, names: object) -> None:
    present = list(names) if isinstance(names, list) else []
    where = f"{path}: row 1"
    if not present:
        raise BadInputError(
            f"{path}: the file is empty; expected a header with {', '.join(REQUIRED)} and more"
        )
    if len(present) == 1 and (others := [name for mark, name in SEPARATORS.items() if mark in present[0]]):
        raise BadInputError(
            f"{where}: expected columns separated by commas, got {others[0]}; save it as CSV with commas, and"
            " with points in its numbers"
        )
    if len(present) == 1 and (
        present[0].startswith("%YAML") or present[0].rstrip().endswith(":") or ": " in present[0]
    ):
        raise BadInputError(
            f"{path}: expected a captures file (CSV), got YAML; its columns are {', '.join(COLUMNS)}"
        )
    if missing := [name for name in REQUIRED if name not in present]:
        needed, came = ", ".join(REQUIRED), ", ".join(map(str, present))
        raise BadInputError(
            f"{where}: expected the columns {needed}; missing: {', '.join(missing)}; got {short(came)}"
        )
    if unknown := [str(name) for name in present if name not in COLUMNS]:
        told = "; ".join(f"no such column: {name}; {one_of(name, COLUMNS)}" for name in unknown)
        raise BadInputError(f"{where}: {told}")
    if len(set(present)) != len(present):
        raise BadInputError(f"{where}: expected every column once, got {', '.join(present)}")
    if "on" not in present and not set(POSITION) & set(present):
        raise BadInputError(f"{where}: expected either the column on (images) or u_px and v_px (positions)")


class _Parser:
    """One row's cells to a `CaptureRow`."""

    def __init__(self, path: Path, number: int, cells: dict[str, str | None]) -> None:
        self._path, self._number = path, number
        if None in cells or None in cells.values():
            raise self._error("row", "as many values as the header has columns", "another number")
        self._cells = {name: (value or "").strip() for name, value in cells.items()}

    def row(self) -> CaptureRow:
        laser_id = self._cells["laser_id"]
        if not laser_id:
            raise self._error("laser_id", "a laser's id or 'all'", "nothing")
        on, off = self._image("on"), self._image("off")
        u, v = self._number_in("u_px"), self._number_in("v_px")
        measured = isfinite(u) or isfinite(v)
        if (on is not None) == measured:
            came = "both" if measured else "neither"
            raise self._error("on", "either an image, or a position in u_px or v_px", came)
        if measured and laser_id in {ALL_LASERS, BOARD}:
            raise self._error("laser_id", "one laser's id where a position is given", laser_id)
        return CaptureRow(
            row=self._number,
            laser_id=laser_id,
            standoff_mm=self._number_in("standoff_mm", at_least=NEAREST_MM),
            repeat=self._repeat(),
            on=on,
            off=off,
            u_px=u,
            v_px=v,
            scene=self._cells.get("scene", ""),
            standoff_sd_mm=self._number_in("standoff_sd_mm", at_least=0.0),
            u_sd_px=self._number_in("u_sd_px", at_least=SMALLEST_SD_PX),
            v_sd_px=self._number_in("v_sd_px", at_least=SMALLEST_SD_PX),
            tilt_deg=self._number_in("tilt_deg", above=-90.0, below=90.0),
            exposure=self._number_in("exposure", above=0.0),
            exposure_unit=self._cells.get("exposure_unit", ""),
        )

    def _image(self, column: str) -> Path | None:
        name = self._cells.get(column, "")
        if "\0" in name:
            raise self._error(column, "the path of an image", "a path with a zero byte in it")
        return self._path.parent / name if name else None

    def _repeat(self) -> int:
        text = self._cells["repeat"]
        if not (text.isdecimal() and len(text) < LONGEST_REPEAT):
            raise self._error("repeat", "a whole number from 0", text[:20] or "nothing")
        return int(text)

    def _number_in(
        self,
        column: str,
        *,
        above: float | None = None,
        at_least: float | None = None,
        below: float | None = None,
    ) -> float:
        text = self._cells.get(column, "")
        if not text:
            return nan
        try:
            value = float(text)
        except ValueError:
            raise self._error(column, "a number", text) from None
        if not isfinite(value):
            raise self._error(column, "a finite number", text)
        if abs(value) > LARGEST:
            raise self._error(column, f"a number up to {LARGEST:g}", text)
        if above is not None and value <= above:
            raise self._error(column, f"a number above {above:g}", text)
        if at_least is not None and value < at_least:
            raise self._error(column, f"a number of at least {at_least:g}", text)
        if below is not None and value >= below:
            raise self._error(column, f"a number below {below:g}", text)
        return value

    def _error(self, column: str, expected: str, came: str) -> BadInputError:
        return BadInputError(
            f"{self._path}: row {self._number}, column {column}: expected {expected}, got {came}"
        )
