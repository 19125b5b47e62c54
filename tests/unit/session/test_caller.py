"""Operator and time of a record."""

from __future__ import annotations

import getpass
import os
import time
from datetime import datetime

import pytest

from workbench.session.caller import now, operator


def test_the_time_has_its_zone() -> None:
    before = time.time()
    at = datetime.strptime(now(), "%Y-%m-%dT%H:%M:%S%z")
    assert before - 1 <= at.timestamp() <= time.time()


def test_an_account_without_a_name_is_its_number(monkeypatch: pytest.MonkeyPatch) -> None:
    def nameless() -> str:
        raise KeyError

    monkeypatch.setattr(getpass, "getuser", lambda: "technician")
    assert operator() == "technician"
    assert operator("A. Person") == "A. Person"
    monkeypatch.setattr(getpass, "getuser", nameless)
    assert operator() == str(os.getuid())
