"""Sensors, their conditioners and the recorder's converters: from a physical signal to the numbers
in a file."""

from __future__ import annotations

from .build import SensorBuild
from .chain import analog, digitised, record

__all__ = ["SensorBuild", "analog", "digitised", "record"]
