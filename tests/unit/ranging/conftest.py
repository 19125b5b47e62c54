"""Rangers shared by the tests of this package."""

from __future__ import annotations

import pytest

from tests.support.rangers import coplanar_ranger, thesis_ranger
from workbench.ranging.ranger import Ranger


@pytest.fixture(scope="session")
def ranger() -> Ranger:
    return thesis_ranger()


@pytest.fixture(scope="session")
def coplanar() -> Ranger:
    return coplanar_ranger()
