"""Causes outside the catalogue, by family: development sees some, calibration others, the sealed
check the rest.

A family that a published table was made with is not sealed any more: those of the tables up to
2026-11-22 are for development.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .case import STAGES

SPLITS = ("development", "calibration", "sealed")


@dataclass(frozen=True)
class Family:
    """`high`: the largest amount that is plausible; `drift`: it grows over the order of runs.

    `varies`: the setting that must differ within a plan. Where it does not, the family is the same
    error everywhere, which is what the catalogue calls a gain.
    """

    name: str
    split: str
    high: float
    text: str
    drift: bool = False
    varies: str = ""

    @property
    def stage(self) -> str:
        """Where it acts."""
        return self.name.split(".")[0]


_ROWS = (
    Family(
        "gun.tank_drift", "development", 0.5, "the tank cools over the day: ln v falls evenly", True
    ),
    Family(
        "gun.tumbling", "development", 0.6, "above a velocity the bullet tumbles and loses speed"
    ),
    Family(
        "gun.relief",
        "calibration",
        0.9,
        "a relief valve opens above a pressure: its excess counts less",
    ),
    Family(
        "gun.velocity_warm_up",
        "calibration",
        0.5,
        "the laser's clock is off until it is warm",
        True,
    ),
    Family(
        "gun.partial_opening",
        "calibration",
        0.5,
        "the trigger opens the valve in part for the lightest bullet",
        varies="mass_kg",
    ),
    Family(
        "gun.cleaned_barrel",
        "development",
        0.4,
        "the barrel is cleaned in the middle of the day",
        True,
    ),
    Family(
        "gun.worn_trigger",
        "development",
        0.6,
        "the trigger wears, and hampers high pressures only",
        True,
    ),
    Family(
        "gun.tight_sabot",
        "development",
        0.5,
        "the sabot of one bullet of middle mass is tight",
        varies="mass_kg",
    ),
    Family(
        "contact.oblique",
        "development",
        0.5,
        "the blow is oblique, more so with a larger tip",
        varies="tip_radius_mm",
    ),
    Family(
        "contact.force_drift", "development", 0.6, "the load cell's gain falls over the day", True
    ),
    Family(
        "contact.double_hit", "development", 0.8, "a second, smaller hit on the heels of the first"
    ),
    Family("contact.worn_target", "calibration", 1.0, "the target softens from blow to blow", True),
    Family("contact.clipping", "calibration", 0.8, "the force is clipped above a level"),
    Family(
        "contact.loose_tip",
        "calibration",
        0.6,
        "the tip of one material is loose",
        varies="tip_material",
    ),
    Family(
        "contact.changed_range", "development", 0.6, "the amplifier's range is changed midway", True
    ),
    Family(
        "contact.ringing_cell",
        "development",
        1.2,
        "the load cell rings on its mount after first contact",
    ),
    Family("contact.slew", "development", 0.8, "the amplifier cannot follow the steepest rises"),
    Family(
        "contact.torn_layer",
        "development",
        0.6,
        "the insulator is torn where one tip hits it",
        varies="insulator",
    ),
    Family(
        "plate.cable_whip",
        "development",
        0.6,
        "a cable whips: low frequencies grow as force squared",
    ),
    Family("plate.amplitude_damping", "development", 6.0, "damping grows with the force"),
    Family(
        "plate.local_mode",
        "calibration",
        2.0,
        "a bracket rings at a frequency that is not in the table",
    ),
    Family("plate.gain_drift", "calibration", 0.8, "the amplifiers' gain falls over the day", True),
    Family("plate.cross_axis", "calibration", 0.9, "one channel takes a share of the other"),
    Family(
        "plate.loose_sensor", "calibration", 1.0, "a sensor is loose in one part of the campaign"
    ),
    Family(
        "plate.rattle",
        "development",
        5.0,
        "a fixture rattles at high frequencies after the hard blows",
    ),
    Family(
        "plate.loosening_bolts",
        "development",
        0.15,
        "bolts loosen: frequencies fall over the day",
        True,
    ),
    Family(
        "plate.tuned_mass", "calibration", 0.6, "something hung on the plate splits one mode in two"
    ),
    Family(
        "plate.saturation", "calibration", 0.9, "an accelerometer's amplifier bends above a level"
    ),
    Family(
        "plate.softening_joint",
        "development",
        0.15,
        "a joint gives way: frequencies fall with the force",
    ),
    Family(
        "plate.warming_pads",
        "development",
        9.0,
        "pads under the plate warm up: damping grows over the day",
        True,
    ),
    Family(
        "plate.clamped_mode",
        "development",
        0.95,
        "a clamp stands where one mode swings most, and stills it",
    ),
    Family(
        "plate.moved_sensor",
        "development",
        0.95,
        "a sensor comes off midway and is put back elsewhere",
        True,
    ),
    Family(
        "gun.standing_wave",
        "sealed",
        0.4,
        "a wave in the supply line meets the shot: late or early by its time",
    ),
    Family(
        "gun.closing_valve",
        "sealed",
        0.5,
        "the valve bounces shut: shots that take long get less gas",
    ),
    Family(
        "gun.stiff_grease",
        "sealed",
        0.7,
        "grease is stiff in the morning, and holds slow shots most",
        True,
    ),
    Family(
        "contact.ringing_handle",
        "sealed",
        0.7,
        "the handle bends at 900 Hz and swings with the blow",
    ),
    Family(
        "contact.cable_charge",
        "sealed",
        0.8,
        "the moved cable gives a charge that rises during the blow",
    ),
    Family("contact.oil_film", "sealed", 0.8, "a film of oil cushions the soft blows"),
    Family(
        "plate.asymmetric_sensor",
        "sealed",
        0.8,
        "an accelerometer that reads up otherwise than down",
    ),
    Family(
        "plate.base_strain",
        "sealed",
        3.0,
        "the sensors read the strain under them, at low frequencies",
    ),
    Family(
        "plate.crack",
        "sealed",
        0.12,
        "a crack where the plate is hit: modes that swing there fall and lose",
    ),
)
#: Every family by name.
FAMILIES: Mapping[str, Family] = {row.name: row for row in _ROWS}


def families(kind: str, split: str) -> tuple[str, ...]:
    """Names of the families that a kind's campaign can show. Raises `ValueError` for an unknown
    split."""
    if split not in SPLITS:
        raise ValueError(f"split {split!r}: expected one of {', '.join(SPLITS)}")
    return tuple(row.name for row in _ROWS if row.split == split and row.stage in STAGES[kind])
