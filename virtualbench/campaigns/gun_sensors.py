"""The instruments at the gun (thesis, section 2.2.1)."""

from __future__ import annotations

from ..sensors import SensorBuild

#: GENSPEC GS 4002 with the thesis's calibration; 16 bits over ±10 V.
TANK = SensorBuild(
    "tank_pressure", "pressure", "bar", 16.0, 1e5, bits=16, sensitivity=0.5621, offset_v=0.3624, noise=0.002,
    bandwidth_hz=1e3, gain_fault=0.005, offset_fault=0.005, gain_drift=0.001, offset_drift=0.002,
)  # fmt: skip
#: Panasonic LM10 ANR1215: 130 ± 50 mm over ±5 V, 20 µm; the electronics' corner is assumed.
LASER = SensorBuild(
    "laser", "displacement", "mm", 180.0, 1e-3, bits=16, sensitivity=0.1, offset_v=-13.0, noise=0.02, bandwidth_hz=10e3,
    offset_drift=0.05, position="muzzle",
)  # fmt: skip
#: PCB 350B43, its axis normal to the plate; in-plane axes have no model here and are not recorded.
PLATE = tuple(
    SensorBuild(
        f"acceleration_{i}", "acceleration", "g", 10_000.0, 9.80665, noise=0.5, mount_resonance_hz=45e3,
        gain_fault=0.01, zero_shift_fault=0.001, gain_drift=0.002, offset_drift=0.1, position="plate", axis="z",
    )
    for i in (1, 2)
)  # fmt: skip
#: Four Kistler 9107C, of whose 700 kN a fifth is preload.
ARRAY = tuple(
    SensorBuild(
        f"force_{i}", "force", "kN", 560.0, 1e3, noise=0.005, bandwidth_hz=25e3, gain_fault=0.01, gain_drift=0.002,
        offset_drift=0.01, position=f"cell {i}",
    )
    for i in (1, 2, 3, 4)
)  # fmt: skip
#: The blow does not fall on the centre of the array: what share each cell carries.
ARRAY_SHARES = (0.27, 0.24, 0.26, 0.23)

SENSORS = (TANK, LASER, *PLATE, *ARRAY)
