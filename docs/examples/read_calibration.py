"""A ranger of its own, written from docs/calibration-format.md alone: PyYAML and numpy.

    python docs/examples/read_calibration.py calibration.yaml spots.csv

reads a CSV file whose first line is `laser_id,u_px,v_px,u_sd_px,v_sd_px`, and prints the range of each spot
and its 1 sigma, in mm.
"""

import csv
import sys
from pathlib import Path

import numpy as np
import yaml


class Sensor:
    """The numbers of a calibration file."""

    def __init__(self, path):
        document = yaml.safe_load(Path(path).read_text())
        own = document["laser_ranger"]
        if own["fit"]["verdict"] == "refused":
            raise SystemExit(f"{path}: this calibration was refused: {own['fit'].get('reasons')}")
        k = document["camera_matrix"]["data"]
        self.lens = np.array([k[0], k[2], k[5], *document["distortion_coefficients"]["data"]])
        self.rays = {
            laser["id"]: np.array([*laser["origin_mm"][:2], *laser["direction"][:2]])
            for laser in own["lasers"]
        }
        self.offset_mm = own["reference_plane"]["offset_mm"]
        self.speckle_sd_px = own["noise"]["speckle_sd_px"]
        self.names = own["parameters"]["names"]
        count = len(self.names)
        self.covariance = np.array(own["parameters"]["covariance"]["data"]).reshape(count, count)

    def range(self, laser_id, u, v, u_sd, v_sd):
        """Range, its derivatives by the parameters, its variance from the spot; None beyond infinity."""
        ray = self.rays[laser_id]
        seen = np.array([u, v])
        sd = np.hypot([u_sd, v_sd], self.speckle_sd_px)
        w = 0.0
        for _ in range(30):
            m = self._slope(ray, w) / sd
            w -= m @ ((spot(self.lens, ray, w) - seen) / sd) / (m @ m)
        if w <= 0:
            return None
        m = self._slope(ray, w) / sd
        to_range = np.zeros(len(self.names))
        to_range[self.names.index("offset_mm")] = -1.0
        lens_names = ["f_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"]
        ray_names = [f"{laser_id}.{name}" for name in ("x_mm", "y_mm", "tx", "ty")]
        for i, name in enumerate([*lens_names, *ray_names]):
            step = np.zeros(12)
            step[i] = 1e-6 * max(1.0, abs([*self.lens, *ray][i]))
            ahead = spot(self.lens + step[:8], ray + step[8:], w)
            back = spot(self.lens - step[:8], ray - step[8:], w)
            g = (ahead - back) / (2 * step[i]) / sd
            to_range[self.names.index(name)] = (m @ g) / (m @ m) / w**2
        return 1 / w - self.offset_mm, to_range, 1 / (w**4 * (m @ m))

    def sigma(self, to_range, spot_variance):
        """1 sigma of a range."""
        return float(np.sqrt(to_range @ self.covariance @ to_range + spot_variance))

    def _slope(self, ray, w):
        step = 1e-7
        return (spot(self.lens, ray, w + step) - spot(self.lens, ray, w - step)) / (2 * step)


def spot(lens, ray, w):
    """Where the ray's point at depth 1 / w appears, pixels."""
    f, cx, cy, k1, k2, p1, p2, k3 = lens
    x, y = ray[2] + ray[0] * w, ray[3] + ray[1] * w
    r2 = x * x + y * y
    d = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = cx + f * (x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x))
    v = cy + f * (y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y)
    return np.array([u, v])


def main(calibration, spots):
    """Print a line for each spot."""
    sensor = Sensor(calibration)
    with Path(spots).open() as file:
        for row in csv.DictReader(file):
            numbers = [float(row[name]) for name in ("u_px", "v_px", "u_sd_px", "v_sd_px")]
            found = sensor.range(row["laser_id"], *numbers)
            if found is None:
                print(row["laser_id"], "beyond infinity")
            else:
                range_mm, to_range, spot_variance = found
                print(row["laser_id"], repr(float(range_mm)), repr(sensor.sigma(to_range, spot_variance)))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(f"usage: {sys.argv[0]} calibration.yaml spots.csv")
    main(*sys.argv[1:])
