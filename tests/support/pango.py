"""System library that makes PDF files."""

from __future__ import annotations

import importlib
import os

import pytest

from tests.support.browser import REQUIRE


def need_pango() -> None:
    """Skip a test of PDF files where the library is missing; with the browser required, it fails."""
    try:
        importlib.import_module("weasyprint")
    except OSError:
        missing = "not installed: pango (Debian: libpango-1.0-0 libpangoft2-1.0-0 libharfbuzz-subset0)"
        if os.environ.get(REQUIRE) == "1":
            pytest.fail(missing)
        pytest.skip(missing)
