"""Drive trial: the sensor on its vehicle in a world, compared with the truth and a simulated sonar."""

from workbench.trials.drive.step import DriveStep

__all__ = ["DriveStep"]
