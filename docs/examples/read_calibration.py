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
        self.model = document["distortion_model"]
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
            w -= m @ ((spot(self.model, self.lens, ray, w) - seen) / sd) / (m @ m)
        if w <= 0:
            return None
        m = self._slope(ray, w) / sd
        to_range = np.zeros(len(self.names))
        to_range[self.names.index("offset_mm")] = -1.0
        lens_names = ["f_px", "cx_px", "cy_px", *COEFFICIENTS[self.model]]
        size = len(lens_names)
        ray_names = [f"{laser_id}.{name}" for name in ("x_mm", "y_mm", "tx", "ty")]
        for i, name in enumerate([*lens_names, *ray_names]):
            step = np.zeros(size + 4)
            step[i] = 1e-6 * max(1.0, abs([*self.lens, *ray][i]))
            ahead = spot(self.model, self.lens + step[:size], ray + step[size:], w)
            back = spot(self.model, self.lens - step[:size], ray - step[size:], w)
            g = (ahead - back) / (2 * step[i]) / sd
            to_range[self.names.index(name)] = (m @ g) / (m @ m) / w**2
        return 1 / w - self.offset_mm, to_range, 1 / (w**4 * (m @ m))

    def sigma(self, to_range, spot_variance):
        """1 sigma of a range."""
        return float(np.sqrt(to_range @ self.covariance @ to_range + spot_variance))

    def _slope(self, ray, w):
        step = 1e-7
        ahead = spot(self.model, self.lens, ray, w + step)
        return (ahead - spot(self.model, self.lens, ray, w - step)) / (2 * step)


def spot(model, lens, ray, w):
    """Pixels at which the ray's point at depth 1 / w appears."""
    f, cx, cy = lens[:3]
    x, y = DISTORT[model](lens[3:], ray[2] + ray[0] * w, ray[3] + ray[1] * w)
    return np.array([cx + f * x, cy + f * y])


def plumb_bob(coefficients, x, y):
    """Brown-Conrady."""
    k1, k2, p1, p2, k3 = coefficients
    r2 = x * x + y * y
    d = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    return x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def equidistant(coefficients, x, y):
    """Fisheye: the radius is a polynomial in the angle."""
    k1, k2, k3, k4 = coefficients
    r = np.hypot(x, y)
    a = np.arctan(r)
    d = (a / r if r > 0 else 1.0) * (1 + k1 * a**2 + k2 * a**4 + k3 * a**6 + k4 * a**8)
    return x * d, y * d


DISTORT = {"plumb_bob": plumb_bob, "equidistant": equidistant}
COEFFICIENTS = {"plumb_bob": ["k1", "k2", "p1", "p2", "k3"], "equidistant": ["k1", "k2", "k3", "k4"]}


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
