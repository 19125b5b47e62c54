"""Programs that are not Python packages: a browser, and the system library that makes PDF files."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import NoReturn

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
REQUIRED = "WORKBENCH_REQUIRE_BROWSER"
"""Variable that makes a missing browser, or a missing pango, a failure."""


def opened(page: Path, profile: Path, script: str = "") -> str:
    """The page's elements after a script ran in it; its result is the text of the page's title."""
    browser = next(filter(None, map(shutil.which, NAMES)), "")
    if not browser:
        _missing("Chromium or Chrome (Debian: chromium)")
    measured = profile / "measured.html"
    text = page.read_text()
    measured.write_text(text.replace("</body>", f"<script>document.title = {script}</script></body>"))
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}"]
    command += ["--window-size=1200,900", "--dump-dom", measured.as_uri()]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    found = re.search("<title>(.*?)</title>", result.stdout, re.DOTALL)
    assert found is not None
    return found[1]


def need_pango() -> None:
    """Skip a test of PDF files where the system library is missing."""
    try:
        importlib.import_module("weasyprint")
    except OSError:
        _missing("pango (Debian: libpango-1.0-0 libpangoft2-1.0-0 libharfbuzz-subset0)")


def _missing(what: str) -> NoReturn:
    if os.environ.get(REQUIRED):
        pytest.fail(f"not installed: {what}")
    pytest.skip(f"not installed: {what}")
