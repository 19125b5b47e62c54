"""A real browser without a window: Debian's Chromium, driven by Selenium, on this computer only."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

REQUIRE = "WORKBENCH_REQUIRE_BROWSER"
"""Set to 1, a machine without the browser fails the test instead of skipping it."""
LOAD_S = 120.0
OPTIONS = (
    "--headless=new",
    "--no-sandbox",  # tests may run as root
    "--disable-dev-shm-usage",
    "--use-angle=swiftshader",  # WebGL without a graphics card
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
)

Picture = NDArray[np.uint8]


class Browser:
    """One page in a browser."""

    def __init__(self, driver: webdriver.Chrome) -> None:
        self.driver = driver

    def open(self, url: str) -> None:
        """Open a page; returns when its document is loaded."""
        self.driver.get(url)

    def value_of(self, expression: str) -> Any:
        """Value of a JavaScript expression on the page."""
        return self.driver.execute_script(f"return {expression}")

    def shot(self) -> Picture:
        """A screenshot (H, W, 3) BGR of the window."""
        png = np.frombuffer(self.driver.get_screenshot_as_png(), dtype=np.uint8)
        picture = cv2.imdecode(png, cv2.IMREAD_COLOR)
        assert picture is not None
        return np.asarray(picture, dtype=np.uint8)

    def wait_for(self, shows: Callable[[Picture], bool], within_s: float = LOAD_S) -> Picture:
        """The first screenshot that satisfies a condition.

        Raises:
            AssertionError: none does.
        """
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            picture = self.shot()
            if shows(picture):
                return picture
            time.sleep(0.5)
        raise AssertionError(f"the page does not show it after {within_s} s")


@contextmanager
def headless_browser(folder: Path, width_px: int = 1280, height_px: int = 720) -> Iterator[Browser]:
    """Run a browser until the block ends, its files in `folder`; skips the test where there is none."""
    program, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if program is None or driver is None:
        reason = "no browser (Debian: chromium chromium-driver)"
        if os.environ.get(REQUIRE) == "1":
            pytest.fail(f"{REQUIRE}=1, but there is {reason}")
        pytest.skip(reason)
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for option in (
        *OPTIONS,
        f"--window-size={width_px},{height_px}",
        f"--user-data-dir={folder / 'browser'}",
    ):
        options.add_argument(option)
    chrome = webdriver.Chrome(options=options, service=Service(driver))
    try:
        yield Browser(chrome)
    finally:
        chrome.quit()
