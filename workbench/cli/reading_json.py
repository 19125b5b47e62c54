"""Readings of the ranger as JSON."""

from __future__ import annotations

import math
from typing import Any

from workbench.ranging.lines import LineShape
from workbench.ranging.ranger import Reading
from workbench.ranging.shape import Shape


def plain(reading: Reading) -> dict[str, Any]:
    """Reading as plain numbers and texts: mm, degrees, 1 sigma, 95 % intervals (null: no upper end)."""
    shapes = [line.shape for line in reading.lines]
    nearest = min(shapes, key=lambda shape: shape.closest_mm) if shapes else None
    return {
        "scene": reading.scene,
        "status": reading.status,
        "closest_mm": reading.closest_mm,
        "sigma_mm": reading.sigma_mm,
        "interval_mm": _interval(reading.interval_mm),
        "mean_mm": reading.mean_mm,
        "mean_sigma_mm": reading.mean_sigma_mm,
        "shape": {"kind": "unknown"} if nearest is None else _shape(nearest),
        "lines": [_line(line, reading) for line in reading.shapes],
        "lasers": [
            {
                "id": laser.laser_id,
                "range_mm": laser.range_mm,
                "sigma_mm": laser.sigma_mm,
                "interval_mm": [laser.low_mm, laser.high_mm],
                "u_px": laser.u_px,
                "v_px": laser.v_px,
            }
            for laser in reading.lasers
        ],
        "notes": list(reading.notes),
    }


def _line(line: LineShape, reading: Reading) -> dict[str, Any]:
    return {
        "line": line.row.name,
        "lasers": [reading.lasers[i].laser_id for i in line.indices],
        "closest_mm": line.shape.closest_mm,
        "sigma_mm": line.shape.closest_sigma_mm,
        "interval_mm": _interval(line.shape.closest_interval_mm),
        "shape": _shape(line.shape),
    }


def _shape(shape: Shape) -> dict[str, Any]:
    data: dict[str, Any] = {"kind": shape.kind}
    if shape.kind != "unknown":
        data["probability"] = shape.probability
        data["probabilities"] = dict(shape.probabilities)
    if shape.degree is not None:
        data |= {"degree": shape.degree, "coefficients": list(shape.coefficients)}
    if shape.angle_rad is not None and shape.angle_sigma_rad is not None:
        data |= {
            "angle_deg": math.degrees(shape.angle_rad),
            "angle_sigma_deg": math.degrees(shape.angle_sigma_rad),
        }
    if shape.angle_interval_rad is not None:
        data["angle_interval_deg"] = [math.degrees(end) for end in shape.angle_interval_rad]
    if shape.cylinder is not None:
        data["cylinder"] = {
            "radius_mm": shape.cylinder.radius_mm,
            "radius_sigma_mm": shape.cylinder.radius_sigma_mm,
            "axis_x_mm": shape.cylinder.axis_x_mm,
            "axis_range_mm": shape.cylinder.axis_range_mm,
        }
    return data


def _interval(interval_mm: tuple[float, float] | None) -> list[float | None] | None:
    if interval_mm is None:
        return None
    return [end if math.isfinite(end) else None for end in interval_mm]
