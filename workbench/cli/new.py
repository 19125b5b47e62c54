"""`workbench new`."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.model.errors import BadInputError

if TYPE_CHECKING:
    from workbench.cli.sensor_rig import Sensor

PARTS = ("procedures", "rigs")
"""Folders that a laboratory starts from."""

PAGES = {
    "build-a-sensor.md": "parts, wiring, alignment, first calibration, practice",
    "procedures.md": "procedure files, prompts, limits; resuming and repairing a session",
    "rig-format.md": "all keys of rig files",
    "laser-controller.md": "the laser controller, and what turns the lasers off",
    "board.md": "the printed board",
    "trials.md": "trials and their statistics",
    "worlds.md": "worlds, and drives of the sensor on its vehicle",
    "viewer.md": "live view, replay, finding a bad standoff",
    "certificate.md": "reports, certificates, `lab.yaml`, `workbench sessions`",
    "history.md": "verifications, control charts, calibration in force",
}
"""Pages of the documentation that a technician needs, with their contents."""
README = """\
# Laboratory

Written by `workbench new`. `workbench --help` lists the commands, `workbench COMMAND --help` their options.

| folder | contents |
|---|---|
| `procedures/` | what is measured: edit them, then `workbench check` and `workbench plan` |
| `rigs/` | sensors and benches; `rigs/firmware/` is the laser controller's |
| `docs/` | pages of the documentation, below |
| `sessions/` | made by the first `workbench run`, one folder for each |

| page | contents |
|---|---|
{pages}

Links from these pages to others, and pictures, are in the documentation of the project.
"""
CALIBRATE = "procedures/calibrate-flat.yaml"
DEMO = f"workbench run {CALIBRATE} procedures/accuracy-flat.yaml --rig rigs/thesis-emulated.yaml"
SEED = 1
"""Seed of the virtual bench to practise on."""
NOT_COPIED = shutil.ignore_patterns("build", "__pycache__")


def lay_out(folder: Path, ask: bool = False) -> str:
    """Copy procedures, rigs, firmware and pages of this version into `folder`; return the next commands.

    Args:
        folder: new or empty folder.
        ask: whether to ask about the laboratory's own sensor first, and write its rig file.

    Raises:
        BadInputError: the folder is not empty, or cannot be written.
        AnswerNeededError: the input ended before the last answer; nothing is written.
    """
    _check_empty(folder)
    if not ask:
        _copy(folder)
        written = f"{folder}: procedures, rigs and documentation (README.md) written. Next:"
        return "\n".join((written, _enter(folder), DEMO))
    from workbench.cli.dialogue import ask_all
    from workbench.cli.found_devices import found_cameras, found_ports
    from workbench.cli.sensor_questions import parse_yes, sensor_questions
    from workbench.cli.sensor_rig import Sensor

    taken = [path.stem for path in (_templates() / "rigs").glob("*.yaml")]
    given = ask_all(sensor_questions(found_cameras(), found_ports(), taken))
    _copy(folder)
    return _write_sensor(folder, Sensor.of(given), practise=parse_yes(given["practise"]))


def _write_sensor(folder: Path, sensor: Sensor, *, practise: bool) -> str:
    from workbench.cli.sensor_rig import paths, practice_text, rig_text

    real, practice = paths(sensor, folder)
    _write(real, rig_text(sensor))
    lines = [f"{folder / 'README.md'}: how to read the documentation in {folder / 'docs'}."]
    lines += [f"{real}: written. Its comments name the source of each number; correct what is known better."]
    steps: list[tuple[str, str]] = [("", _enter(folder))]
    if practise:
        _write(practice, practice_text(sensor, SEED))
        lines.append(f"{practice}: the same sensor on the virtual bench.")
        steps.append(("to practise, without hardware", _calibrate(practice, folder)))
    steps += [
        ("with camera and controller connected", f"workbench doctor {real.relative_to(folder)}"),
        ("where doctor finds all ready", _calibrate(real, folder)),
    ]
    commands = [line for note, command in steps for line in ([f"# {note}:"] if note else []) + [command]]
    return "\n".join((*lines, "Next:", *commands))


def _calibrate(rig: Path, folder: Path) -> str:
    return f"workbench run {CALIBRATE} --rig {rig.relative_to(folder)}"


def _check_empty(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInputError(f"{folder}: expected a new or empty folder, found files; nothing was written")
    except OSError as error:
        raise BadInputError(f"{folder}: cannot be written: {error.strerror or error}") from None


def _copy(folder: Path) -> None:
    try:
        for part in PARTS:
            shutil.copytree(
                _templates() / part, folder / part, ignore=NOT_COPIED, copy_function=shutil.copyfile
            )
        (folder / "docs").mkdir()
        for page in PAGES:
            shutil.copyfile(_templates() / "docs" / page, folder / "docs" / page)
    except OSError as error:
        raise BadInputError(f"{folder}: cannot be written: {error.strerror or error}") from None
    pages = "\n".join(f"| [{page}](docs/{page}) | {contents} |" for page, contents in PAGES.items())
    _write(folder / "README.md", README.format(pages=pages))


def _write(path: Path, text: str) -> None:
    from workbench.session.files import write_output

    write_output(path, text.encode())


def _enter(folder: Path) -> str:
    return f"cd {shlex.quote(str(folder))}"


def _templates() -> Path:
    """Folder with `PARTS` and `docs`: data of an installed workbench, the repository of an editable one."""
    package = Path(__file__).parents[1]
    installed = package / "templates"
    return installed if installed.is_dir() else package.parent
