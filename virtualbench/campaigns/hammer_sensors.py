"""The instruments of the hammer campaign (thesis, chapter 4), and two accelerometers on the plate."""

from __future__ import annotations

from ..sensors import SensorBuild

LOAD_CELL = SensorBuild(  # after the thesis's Dytran 5800B4; its range wide enough for the hardest blow
    "force", "force", "N", 2e4, noise=0.2, bandwidth_hz=25e3, gain_fault=0.01, gain_drift=0.002, offset_drift=0.5,
    position="tip",
)  # fmt: skip
REAR = SensorBuild(  # after its B&K 8309, with the resonance of the data sheet
    "acceleration_hammer", "acceleration", "m/s2", 1e5, noise=2.0, mount_resonance_hz=180e3, gain_drift=0.002,
    offset_drift=1.0, position="hammer",
)  # fmt: skip
PLATE = tuple(
    SensorBuild(
        f"acceleration_{i}", "acceleration", "g", 1000.0, 9.80665, noise=0.02, mount_resonance_hz=45e3,
        gain_fault=0.01, zero_shift_fault=0.001, gain_drift=0.002, offset_drift=0.02, position="plate", axis="z",
    )
    for i in (1, 2)
)  # fmt: skip

SENSORS = (LOAD_CELL, REAR, *PLATE)
