"""Node that runs `workbench range` and publishes its readings as `range` and `scan`.

Parameters: `command` (list of words, without `--json`), `calibration` (path of the YAML), `frame_id`.
"""

from __future__ import annotations

import json
import subprocess
import threading
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import rclpy
import yaml
from sensor_msgs.msg import LaserScan, Range

from laser_range_node.messages import SensorGeometry, geometry_of, range_values, scan_values


class Publisher:
    """Publishes each line that `workbench range --json` prints."""

    def __init__(self, node: Any, geometry: SensorGeometry, frame_id: str) -> None:
        self._node, self._geometry, self._frame_id = node, geometry, frame_id
        self._range = node.create_publisher(Range, "range", 10)
        self._scan = node.create_publisher(LaserScan, "scan", 10)

    def publish_all(self, ranger: subprocess.Popen[str]) -> None:
        """Publish the lines of a running ranger until it ends."""
        for line in ranger.stdout or ():
            reading = json.loads(line)
            stamp = self._node.get_clock().now().to_msg()
            self._send(self._range, Range(), stamp, asdict(range_values(reading, self._geometry)))
            self._send(self._scan, LaserScan(), stamp, asdict(scan_values(reading, self._geometry)))
        self._node.get_logger().error(f"workbench range ended with exit code {ranger.wait()}")

    def _send(self, publisher: Any, message: Any, stamp: Any, values: Mapping[str, Any]) -> None:
        message.header.stamp = stamp
        message.header.frame_id = self._frame_id
        for name, value in values.items():
            if hasattr(message, name):  # `variance` of Range is newer than some distributions
                setattr(message, name, list(value) if isinstance(value, tuple) else value)
        publisher.publish(message)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the node until it is interrupted. The lasers are off afterwards."""
    rclpy.init(args=arguments)
    node = rclpy.create_node("laser_range")
    calibration = node.declare_parameter("calibration", "calibration.yaml").value
    default = ["workbench", "range", "--rig", "my-rig.yaml", "--calibration", calibration]
    command = node.declare_parameter("command", default).value
    frame_id = node.declare_parameter("frame_id", "laser_range").value
    publisher = Publisher(node, geometry_of(yaml.safe_load(Path(calibration).read_text())), frame_id)
    # The guardian of the lasers watches this process: they are off when it ends, in good order or not.
    ranger = subprocess.Popen([*command, "--json"], stdout=subprocess.PIPE, text=True)  # noqa: S603  # the user's
    threading.Thread(target=publisher.publish_all, args=(ranger,), daemon=True).start()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        ranger.terminate()
        ranger.wait()
        node.destroy_node()
