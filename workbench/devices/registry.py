"""From the `driver` of a rig file to an opened bench."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

from workbench.devices.protocols import Bench
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.yamlfile import FileModel

GROUP = "workbench.benches"


def open_bench(rig: Rig, session_dir: Path) -> Bench:
    """Open the bench that the rig names.

    A driver is an entry point in the group `workbench.benches`: a function (rig, session_dir) -> Bench.

    Raises:
        BadInputError: the rig names no driver, or one that is not installed.
        RigNotReadyError: a device does not answer.
    """
    bench: Bench = entry_points(group=GROUP)[check_driver(rig)].load()(rig, session_dir)
    return bench


def blocks_of(driver: str) -> Mapping[str, type[FileModel]]:
    """Blocks of the rig file that an installed driver reads: `BLOCKS` of its module, where it has that."""
    module = import_module(entry_points(group=GROUP)[driver].module)
    blocks: Mapping[str, type[FileModel]] = getattr(module, "BLOCKS", {})
    return blocks


def check_driver(rig: Rig) -> str:
    """Name of the rig's driver, which is installed.

    Raises:
        BadInputError: it names none, or one that is not.
    """
    driver = rig.driver or "none"
    if (wrong := not_installed(driver)) is not None:
        raise BadInputError(f"rig {rig.rig}: driver: {wrong}")
    return driver


def not_installed(driver: str) -> str | None:
    """What is wrong with the name of a driver; None where it is installed."""
    known = sorted(entry_points(group=GROUP).names)
    if driver in known:
        return None
    return (
        f"expected an installed bench driver ({', '.join(known) or 'there is none'}), got {driver};"
        " a rig without a driver can be fitted but not run"
    )
