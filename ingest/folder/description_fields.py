"""What a description of a campaign asks for: each key of campaign.toml and each column of runs.csv
with its words, its unit, and the reason why it is needed.

A key that no file states stays empty, and a person is asked for it with this reason.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

GUN, HAMMER, PLATE = DESCRIBED_KINDS = ("gun", "hammer", "plate")
#: What `kind` of `[campaign]` is for each.
KIND_IN_FILE = {GUN: "gun", HAMMER: "hammer", PLATE: "hammer"}


@dataclass(frozen=True)
class DescribedKey:
    """A key of campaign.toml. `unit` is that of its number, "" of a text; `needed`: without it the
    ingest refuses the campaign."""

    keys: tuple[str, ...]
    label: str
    why: str
    unit: str = ""
    kinds: tuple[str, ...] = DESCRIBED_KINDS
    needed: bool = False
    is_number: bool = False

    @property
    def name(self) -> str:
        """The path of keys with points between them."""
        return ".".join(self.keys)


def _number(
    path: str, label: str, unit: str, why: str, kinds: tuple[str, ...] = DESCRIBED_KINDS
) -> DescribedKey:
    return DescribedKey(tuple(path.split(".")), label, why, unit, kinds, is_number=True)


#: Of the campaign.
FACTS: tuple[DescribedKey, ...] = (
    DescribedKey(
        ("campaign", "name"),
        "Name",
        "Pages, datasets and reports name the campaign by it; a store has each name once.",
        needed=True,
    ),
    DescribedKey(
        ("campaign", "date"),
        "Date",
        "Lists are in the order of dates, and a calibration is judged by its age.",
        needed=True,
    ),
    DescribedKey(
        ("campaign", "operator"), "Operator", "Whoever has a question later can ask this person."
    ),
    DescribedKey(
        ("campaign", "description"),
        "Description",
        "Others learn from it what the campaign was for.",
    ),
)
#: Of the bench. The gun's seven dimensions are stated together, or not at all.
_OF_GUN = (GUN,)
_NOMINAL = "The muzzle velocity is predicted from it (equation 2.16 of the nominal gun)."
BENCH: tuple[DescribedKey, ...] = (
    _number("bench.gun.tank_volume_m3", "Volume of the tank", "m³", _NOMINAL, _OF_GUN),
    _number("bench.gun.bore_diameter_m", "Inner diameter of the barrel", "m", _NOMINAL, _OF_GUN),
    _number(
        "bench.gun.projectile_diameter_m",
        "Diameter of the projectile",
        "m",
        "The air that passes beside the projectile follows from it; it is at most the bore.",
        _OF_GUN,
    ),
    _number(
        "bench.gun.travel_m",
        "Travel of the projectile, from rest to the vent holes",
        "m",
        _NOMINAL,
        _OF_GUN,
    ),
    _number("bench.gun.friction_coefficient", "Friction coefficient", "", _NOMINAL, _OF_GUN),
    _number(
        "bench.gun.heat_capacity_ratio",
        "Heat capacity ratio of the gas (1.4 for air)",
        "",
        _NOMINAL,
        _OF_GUN,
    ),
    _number(
        "bench.gun.efficiency",
        "Efficiency of the gun (above 0, at most 1)",
        "",
        _NOMINAL,
        _OF_GUN,
    ),
    _number(
        "bench.gun.max_regulated_pressure_pa",
        "Largest pressure of the regulator",
        "Pa",
        "Rows above it are refused; without it the limit is 8 bar.",
        _OF_GUN,
    ),
    _number(
        "bench.hammer.mass_kg",
        "Effective mass of the hammer",
        "kg",
        "Models of the contact learn from the mass, and the impulse is compared with mass times "
        "velocity.",
        (HAMMER,),
    ),
    DescribedKey(
        ("bench", "plate", "material"),
        "Material of the plate",
        "The plate's response is computed from its elastic constants.",
    ),
    _number(
        "bench.plate.thickness_m",
        "Thickness of the plate",
        "m",
        "The plate's response and the stiffness of the contact follow from it.",
    ),
    DescribedKey(
        ("bench", "plate", "outline_m"),
        "Outline of the plate",
        "Its modes are computed from the outline; a rectangle is enough as 0.6 x 0.4.",
        "m",
    ),
    DescribedKey(
        ("bench", "plate", "modes"),
        "Table of measured modes",
        "Measured modes stand in the place of computed ones.",
    ),
)
#: The parts of the gun that go together.
GUN_DIMENSIONS = tuple(key.keys for key in BENCH if key.keys[1] == "gun")[:-1]

#: Of the recordings as a whole.
READING: tuple[DescribedKey, ...] = (
    _number(
        "recordings.sampling_rate_hz",
        "Sampling rate",
        "Hz",
        "The files state neither a rate nor times.",
    ),
    DescribedKey(
        ("recordings", "columns"),
        "Names of the columns, in their order",
        "The files have no names of their own; separate the names by commas.",
    ),
    DescribedKey(
        ("recordings", "decimal"), "Decimal sign", "Only for text that can be read in two ways."
    ),
    DescribedKey(
        ("recordings", "delimiter"),
        "Sign between the columns",
        "Only for text that can be read in two ways.",
    ),
    DescribedKey(
        ("recordings", "harmless_fields"),
        "Fields of the files that change no number",
        "A file with a field that the reader does not know is refused until you say that the field "
        "changes no number.",
    ),
    DescribedKey(
        ("recordings", "uneven_time"),
        "Uneven time steps",
        "Records whose time steps are uneven are refused, or put on an even grid.",
    ),
)

#: Of a channel: key -> words and reason.
CHANNEL_WORDS: Mapping[str, tuple[str, str]] = {
    "quantity": ("What it measures", "The role decides what the record is used for."),
    "unit": ("Unit", "Numbers become newtons, metres per second squared or pascals by it."),
    "sensitivity": (
        "Sensitivity (V per unit)",
        "The recordings hold volts: without it nobody knows what a volt means.",
    ),
    "offset_v": ("Offset (V)", "Volts of the sensor at zero."),
    "position": ("Position", "Sensors of one quantity are told apart by their places."),
    "axis": ("Axis", "Sensors of one place are told apart by their axes."),
    "range": ("Full scale, in the unit", "A record that reached it is clipped."),
}

#: Column of runs.csv -> its words and the reason why it is needed.
COLUMN_WORDS: Mapping[str, tuple[str, str]] = {
    "bullet_mass_kg": ("Mass of the projectile (kg)", "Velocity and impulse follow from it."),
    "tank_pressure_bar": ("Pressure of the tank (bar)", "The velocity follows from it."),
    "tip_material": ("Material of the tip", "The contact's stiffness follows from it."),
    "tip_radius_mm": (
        "Radius of the tip (mm)",
        "Models of the contact learn from it: an impact without it is left out of datasets.",
    ),
    "plate_material": ("Material of the plate", "The contact's stiffness follows from it."),
    "anvil_material": ("Material of the anvil (none)", "An anvil changes the contact."),
    "insulator": ("Insulator (none)", "A polymeric layer softens the contact."),
    "boundary_conditions": ("Plate free or fixed", "The plate's response depends on it."),
    "impact_position": ("Place of the impact", "The plate's response depends on it."),
    "hammer_speed": ("Speed of the hammer", "Runs are compared by it."),
    "impact_velocity_m_s": (
        "Impact velocity (m/s)",
        "It is needed where no accelerometer rides on what strikes.",
    ),
    "measured_velocity_m_s": (
        "Muzzle velocity (m/s)",
        "It is needed where no sensor sees the projectile pass.",
    ),
    "measured_velocity_u_m_s": ("Its standard uncertainty (m/s)", "Fits are weighted by it."),
    "bullet_length_mm": (
        "Length of the projectile (mm)",
        "The velocity follows from it and from the time in the light of the laser.",
    ),
    "bullet_length_u_mm": (
        "Its standard uncertainty (mm)",
        "That of the velocity follows from it.",
    ),
}
_LAYERS = (
    "plate_material",
    "anvil_material",
    "insulator",
    "boundary_conditions",
    "impact_position",
)
#: The columns that a table of runs of each kind begins with.
COLUMNS: Mapping[str, tuple[str, ...]] = {
    GUN: (
        "bullet_mass_kg",
        "tank_pressure_bar",
        "tip_material",
        "tip_radius_mm",
        *_LAYERS,
        "bullet_length_mm",
        "bullet_length_u_mm",
        "measured_velocity_m_s",
        "measured_velocity_u_m_s",
    ),
    HAMMER: ("tip_material", "tip_radius_mm", *_LAYERS, "hammer_speed", "impact_velocity_m_s"),
    PLATE: ("tip_material", "tip_radius_mm", *_LAYERS, "impact_velocity_m_s"),
}
#: Those without which the ingest refuses a row.
NEEDED_COLUMNS: Mapping[str, tuple[str, ...]] = {
    GUN: ("bullet_mass_kg", "tank_pressure_bar"),
    HAMMER: (),
    PLATE: (),
}


@dataclass(frozen=True)
class ChannelRole:
    """What a channel is: its `quantity`, and the `position` that gives the role its meaning."""

    words: str
    quantity: str
    position: str = ""

    @property
    def value(self) -> str:
        """How a form sends it."""
        return f"{self.quantity}@{self.position}" if self.position else self.quantity


#: A channel that is not read.
NOT_USED = "not used"
ROLES: tuple[ChannelRole, ...] = (
    ChannelRole("force of the contact", "force"),
    ChannelRole("acceleration of the plate", "acceleration"),
    ChannelRole("acceleration of the hammer or projectile", "acceleration", "impactor"),
    ChannelRole("pressure", "pressure"),
    ChannelRole("light barrier or laser at the muzzle, in mm", "displacement", "muzzle"),
    ChannelRole("light barrier or laser at the muzzle, in V", "voltage", "muzzle"),
    ChannelRole("velocity", "velocity"),
    ChannelRole("displacement", "displacement"),
    ChannelRole("strain", "strain"),
    ChannelRole("voltage", "voltage"),
    ChannelRole("temperature", "temperature"),
)
