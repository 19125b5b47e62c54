"""Opening of the bench that a rig file names: separate devices, or a driver of a whole bench."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from workbench.devices import real_bench
from workbench.devices.drivers import BENCHES, BenchDriver, DriverUnusableError, installed, load_driver
from workbench.devices.protocols import Bench, LaserBank
from workbench.model.errors import BadInputError
from workbench.model.problems import SchemaProblem
from workbench.model.rig import Rig, load_rig
from workbench.model.yamlfile import read_document, refuse, schema_problems

SEPARATE = "opencv+serial"
"""Value of `driver` for separate devices; a rig with `devices` and no `driver` means the same."""


def open_bench(rig: Rig, session_dir: Path) -> Bench:
    """Open the bench that the rig names.

    Raises:
        BadInputError: a driver is not installed, or its block of the rig file is wrong.
        RigNotReadyError, LaserOffNotConfirmedError: a device fails.
    """
    check_driver(rig)
    whole = whole_bench(rig)
    return real_bench.open_bench(rig) if whole is None else whole.open(rig, session_dir)


def open_lasers(rig: Rig) -> LaserBank:
    """Open only the lasers of separate devices, all off.

    Raises:
        BadInputError: the rig has no devices, the driver is not installed, or its block is wrong.
        RigNotReadyError, LaserOffNotConfirmedError: the device fails.
    """
    if rig.devices is None:
        check_driver(rig)
    return real_bench.open_lasers(rig)


def whole_bench(rig: Rig) -> BenchDriver | None:
    """Driver that opens all devices of the rig together; None for separate devices."""
    if rig.driver not in installed(BENCHES):
        return None
    driver: BenchDriver = load_driver(BENCHES, rig.driver)
    return driver


def check_driver(rig: Rig) -> None:
    """Refuse a rig that cannot be run.

    Raises:
        BadInputError: the rig has no devices, or names a driver that is not installed.
    """
    if not has_bench(rig.driver, rig.devices):
        raise BadInputError(
            f"rig {rig.rig}: expected `devices`, or a `driver` that opens a whole bench, got none; a rig"
            " without them can be fitted but not run"
        )
    found = [one.message for one in _driver_problems(rig.driver)]
    if found:
        raise BadInputError("\n".join(f"rig {rig.rig}: {one}" for one in found))


def load_bench_rig(path: Path, kinds: Sequence[str] = tuple(real_bench.KINDS)) -> Rig:
    """Read a rig file for a run and check the blocks that its drivers read.

    Args:
        path: rig file.
        kinds: kinds of separate devices that will be opened.

    Raises:
        BadInputError: see `load_yaml_model`.
    """
    rig, document = load_rig(path), read_document(path)
    refuse(path, [document.mistake(one) for one in bench_problems(document.data, rig, kinds)])
    return rig


def has_bench(driver: object, devices: object) -> bool:
    """Whether a rig file with these values names a bench."""
    return driver is not None or devices is not None


def bench_problems(
    data: Mapping[str, Any], rig: Rig | None, kinds: Sequence[str] = tuple(real_bench.KINDS)
) -> Iterator[SchemaProblem]:
    """Problems of a rig file's `driver` and of the blocks that its drivers read.

    Args:
        data: content of the file.
        rig: valid rig; None if the file is not valid.
        kinds: kinds of separate devices to check.
    """
    driver, devices = data.get("driver"), data.get("devices")
    if not has_bench(driver, devices) or not isinstance(driver, str | None):
        return
    unusable = list(_driver_problems(driver))
    yield from unusable
    if unusable:
        return
    if driver is None or driver == SEPARATE:
        yield from _devices_problems(devices, rig, kinds)
    else:
        whole: BenchDriver = load_driver(BENCHES, driver)
        for key, model in whole.blocks.items():
            yield from schema_problems(model, data.get(key) or {}, (key,), rig)


def _devices_problems(devices: object, rig: Rig | None, kinds: Sequence[str]) -> Iterator[SchemaProblem]:
    blocks = {} if devices is None else devices
    if not isinstance(blocks, dict):
        return  # the rig's own schema reports this mistake
    for kind in kinds:
        block = blocks.get(kind) or {}
        if isinstance(block, dict):
            yield from real_bench.block_problems(kind, block, rig)


def _driver_problems(driver: str | None) -> Iterator[SchemaProblem]:
    if driver is None or driver == SEPARATE:
        return
    if driver not in installed(BENCHES):
        known = ", ".join(sorted([*installed(BENCHES), SEPARATE]))
        yield SchemaProblem(
            ("driver",),
            f"expected an installed bench driver ({known}), got {driver}; a rig without a driver and without"
            " devices can be fitted but not run",
        )
        return
    try:
        load_driver(BENCHES, driver)
    except DriverUnusableError as error:
        yield SchemaProblem(("driver",), str(error))
