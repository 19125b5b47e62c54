from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.firmware.parts import KINDS, Kind, Running, build


@pytest.fixture(scope="session", params=KINDS)
def kind(request: pytest.FixtureRequest) -> Kind:
    found: Kind = request.param
    return found


@pytest.fixture(scope="session")
def built(kind: Kind, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp(f"firmware-{kind}")
    build(kind, folder)
    return folder


@pytest.fixture
def controller(kind: Kind, built: Path, tmp_path: Path) -> Iterator[Running]:
    """The controller, freshly booted; every test that uses it runs on the chip and on the host."""
    running = Running(kind, built, tmp_path / "pins.log")
    yield running
    running.stop()
