"""Valid answers to the questions about a sensor."""

from __future__ import annotations

GIVEN = {
    "name": "three",
    "serial": "LS-0042/B",
    "camera": "/dev/video0",
    "size": "1280 x 720",
    "pitch": "3",
    "lens": "4 mm",
    "f_number": "f/2",
    "wavelength": "650 nm",
    "baselines": "-60 30 60",
    "measured": "calliper",
    "laser_class": "2",
    "port": "/dev/ttyACM0",
    "practise": "yes",
}
