"""The real Rerun viewer in a test, without a display: started on loopback, asked what it shows, and ended."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.viewer.window import LOOPBACK, viewer_environment, viewer_executable

REQUIRE = "WORKBENCH_REQUIRE_VIEWER"
"""Set to 1, a machine that cannot run the viewer fails the test instead of skipping it."""
START_SECONDS = 30.0
SETTLE_SECONDS = 60.0
STOP_SECONDS = 5.0
_ICD_FOLDERS = (Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"))

Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Viewer:
    """A running viewer."""

    client: Any
    """A `rerun.experimental.ViewerClient`: experimental, so it is not leant on by type."""
    log_file: Path

    def open(self, recording: Path) -> None:
        """Load a recording and wait until it is the one on screen."""
        self.open_url(str(recording.resolve()))

    def open_url(self, url: str) -> None:
        """Watch a recording that is served, and wait until it is the one on screen."""
        self.client.open(url)
        deadline = time.monotonic() + START_SECONDS
        while time.monotonic() < deadline:
            with suppress(ConnectionError):  # what it answers while nothing is on screen
                self.client.get_blueprint()
                return
            time.sleep(0.1)
        raise AssertionError(f"the viewer shows no recording after {START_SECONDS} s")

    def state(self) -> Any:
        """Recordings, timelines and views, with what the views report."""
        return self.client.get_state()

    def problems(self) -> list[str]:
        """Everything that the viewer and its views complain of, but for the missing graphics card."""
        logs = [
            f"{entry.level} {entry.target}: {entry.message}"
            for entry in self.client.get_logs()
            if entry.level in {"WARN", "ERROR"} and "Software rasterizer" not in entry.message
        ]
        return logs + [f"{view.name}: {report}" for view in self.state().views for report in view.reports]

    def view_id(self, name: str) -> Any:
        """Id of the view with a title."""
        (found,) = [view.view_id for view in self.state().views if view.name == name]
        return found

    def go_to(self, timeline: str, sequence: int) -> None:
        """Put the time cursor onto a place of a timeline that counts."""
        self.client.set_time(timeline, sequence=sequence, play_state="paused")

    def tabs(self) -> list[str]:
        """Names of the screens, from the left."""
        layout = self.layout()
        screens = _root(layout)["contents"]
        return [layout[f"/{screen}"]["ContainerBlueprint"]["display_name"] for screen in screens]

    def show_tab(self, name: str) -> None:
        """Bring a tab of the layout to the front: a view in a hidden tab cannot be photographed."""
        layout = self.layout()
        named = {
            path.lstrip("/")
            for path, parts in layout.items()
            for kind in ("ContainerBlueprint", "ViewBlueprint")
            if parts.get(kind, {}).get("display_name") == name
        }
        found = [(tabs, tab) for tabs in _tabs(layout) for tab in named.intersection(tabs["contents"])]
        assert found, f"no tab {name}"
        for tabs, tab in found:
            tabs["active_tab"] = tab
        self.lay_out(layout)

    def layout(self) -> Any:
        """The present layout."""
        return self.client.get_blueprint().blueprint

    def lay_out(self, layout: Any) -> None:
        """Replace the layout."""
        self.client.set_blueprint(layout, "recording")

    def change(self, part: str, values: Callable[[Any], dict[str, Any]]) -> None:
        """Change the values of each part of the layout of a kind, such as `VisualBounds2D`."""
        layout = self.layout()
        for parts in layout.values():
            if part in parts:
                parts[part] |= values(parts[part])
        self.lay_out(layout)

    def views_in_front(self) -> list[Any]:
        """Views that no other tab hides."""
        layout = self.layout()
        front = set(_in_front(layout, _root_path(layout)))
        return [view for view in self.state().views if f"view/{view.view_id}" in front]

    def shot(self, view_id: Any = None) -> Picture:
        """A screenshot (H, W, 3) BGR once two in a row are the same: what a recording holds is loaded lazily.

        Raises:
            AssertionError: the picture does not come to rest.
        """
        deadline = time.monotonic() + SETTLE_SECONDS
        before = b""
        while time.monotonic() < deadline:
            now = self.client.take_screenshot(view_id)
            if now == before:
                return _decoded(now)
            before = now
            time.sleep(0.3)
        raise AssertionError(f"the viewer's picture still changes after {SETTLE_SECONDS} s")

    def glance(self, view_id: Any) -> Picture:
        """A screenshot of one view as it is now; for views that a `shot` of the whole has seen at rest."""
        return _decoded(self.client.take_screenshot(view_id))


@contextmanager
def headless_viewer(folder: Path, size: str = "1600x900") -> Iterator[Viewer]:
    """Run the viewer until the block ends, its files in `folder`; skips the test where it cannot run."""
    _need_vulkan()
    port = _free_port()
    command = [str(viewer_executable()), "--headless", "--bind", LOOPBACK, "--port", str(port)]
    command += ["--window-size", size, "--hide-welcome-screen"]
    home = folder / "viewer-home"
    home.mkdir()
    environment = {**viewer_environment(), "HOME": str(home)}
    log_file = folder / "viewer.log"
    with log_file.open("wb") as log:
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log, cwd=folder)
        try:
            yield Viewer(_connected(process, port, log_file), log_file)
        finally:
            _end(process)


def _tabs(layout: Any) -> list[Any]:
    """Containers of tabs in a layout."""
    containers = (parts["ContainerBlueprint"] for parts in layout.values() if "ContainerBlueprint" in parts)
    return [container for container in containers if container.get("container_kind") == "Tabs"]


def _root_path(layout: Any) -> str:
    """The container that has all others."""
    return f"container/{layout['/viewport']['ViewportBlueprint']['root_container']}"


def _root(layout: Any) -> Any:
    return layout[f"/{_root_path(layout)}"]["ContainerBlueprint"]


def _in_front(layout: Any, part: str) -> Iterator[str]:
    """Views below a part of a layout that no other tab hides."""
    if part.startswith("view/"):
        yield part
        return
    container = layout[f"/{part}"]["ContainerBlueprint"]
    contents = [container["contents"]] if isinstance(container["contents"], str) else container["contents"]
    is_tabs = container.get("container_kind") == "Tabs"
    for below in [container.get("active_tab", contents[0])] if is_tabs else contents:
        yield from _in_front(layout, below)


def write_png(path: Path, picture: Picture) -> None:
    """Write a picture; the file is less than half as large as with OpenCV's defaults, which are for speed."""
    best = (cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_DEFAULT)
    cv2.imwrite(str(path), picture, best)


def distinct_colors(picture: Picture) -> int:
    """How many colours a picture has."""
    return len(np.unique(picture.reshape(-1, 3), axis=0))


def _connected(process: subprocess.Popen[bytes], port: int, log_file: Path) -> Any:
    from rerun.experimental import ViewerClient

    deadline = time.monotonic() + START_SECONDS
    while time.monotonic() < deadline:
        if process.poll() is not None:
            cannot(f"the viewer ended with {process.returncode}: {log_file.read_text()[-2000:]}")
        try:
            client = ViewerClient.connect(f"rerun+http://{LOOPBACK}:{port}/proxy")
            client.get_state()
        except (ConnectionError, RuntimeError, OSError):
            time.sleep(0.2)
        else:
            return client
    return cannot(f"the viewer did not answer in {START_SECONDS} s: {log_file.read_text()[-2000:]}")


def _need_vulkan() -> None:
    if not any(folder.glob("*.json") for folder in _ICD_FOLDERS if folder.is_dir()):
        cannot("no Vulkan driver (Debian: mesa-vulkan-drivers libvulkan1)")


def cannot(reason: str) -> Any:
    """Skip the test for a reason, or fail it where the viewer is required."""
    if os.environ.get(REQUIRE) == "1":
        pytest.fail(f"{REQUIRE}=1, but {reason}")
    pytest.skip(f"the viewer cannot run here: {reason}")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(STOP_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait(STOP_SECONDS)


def _decoded(png: bytes) -> Picture:
    picture = cv2.imdecode(np.frombuffer(png, dtype=np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None, "the viewer's screenshot is not a picture"
    return np.asarray(picture, dtype=np.uint8)
