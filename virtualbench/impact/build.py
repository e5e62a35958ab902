"""What strikes and what is struck. Positive is towards the plate.

What tips and faces are made of.

Elastic data and yield strength are those of Table 4.2 of the thesis; PLA is not in it. The relaxing
fraction r and its time tau are of one Maxwell branch: the instantaneous modulus is 1 + r times the
relaxed one, and the loss factor at the angular frequency w is r w tau / (1 + (1 + r) w^2 tau^2).

The two impactors of the thesis: the hammer in the hand, and the projectile of the gun.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from ..effects import Effects

#: Mean pressure of a fully plastic contact over the yield strength (Tabor, The Hardness of Metals,
#: 1951).
HARDNESS_RATIO = 2.8
#: Yield strength of a surface that has been struck before, at an impact's rate of strain, over that
#: of the data sheet. Assumed: with 1 the pulses of a small hammer widen with force other than
#: recorded ones do (log-log slope -0.131, not
#: -0.158), from 1.5 on they nearly do as these.
HARDENING = 1.5


@dataclass(frozen=True)
class ContactMaterial:
    """One material. Raises `ValueError` for numbers that no material has."""

    name: str
    youngs_modulus_pa: float
    poisson_ratio: float
    density_kg_m3: float
    yield_strength_pa: float
    relaxing_fraction: float
    relaxation_time_s: float
    polymer: bool

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float) and not (math.isfinite(value) and value > 0):
                raise ValueError(
                    f"{field.name} of {self.name} = {value!r}: expected a number above 0"
                )
        if not self.poisson_ratio < 0.5:
            raise ValueError(
                f"poisson_ratio of {self.name} = {self.poisson_ratio!r}: expected less than 0.5"
            )

    @property
    def compliance_1_pa(self) -> float:
        """(1 - nu^2) / E, its share of 1 / E* in a contact."""
        return (1 - self.poisson_ratio**2) / self.youngs_modulus_pa

    @property
    def hardness_pa(self) -> float:
        return HARDNESS_RATIO * HARDENING * self.yield_strength_pa


#: The losses are assumed, of the order of loss factors near 1 kHz in Lakes, Viscoelastic Materials
#: (2009): metals below
#: 0.01 (the joint between tip and head included), polyacetal and PLA some 0.05, polyurethane 0.1 to
#: 0.3.
MATERIALS = {
    row.name: row
    for row in (
        ContactMaterial("aluminum", 69.9e9, 0.33, 2700.0, 276e6, 0.02, 50e-6, False),
        ContactMaterial("steel", 200e9, 0.30, 7800.0, 400e6, 0.015, 50e-6, False),
        ContactMaterial("delrin", 3.2e9, 0.35, 1410.0, 71.7e6, 0.15, 150e-6, True),
        ContactMaterial("polyurethane", 0.03e9, 0.39, 1210.0, 51e6, 0.5, 1.0e-3, True),
        # Printed PLA: Farah, Anderson and Langer, Adv. Drug Deliv. Rev. 107 (2016) 367, Table 1,
        # middle of its range.
        ContactMaterial("PLA", 3.5e9, 0.36, 1240.0, 60e6, 0.15, 150e-6, True),
    )
}


def contact_material(name: str) -> ContactMaterial:
    """A material of tips and faces.

    Parameters:
        name: A name of `MATERIALS`, in any case.

    Raises:
        ValueError: For an unknown material; the message lists the known ones.
    """
    for material, row in MATERIALS.items():
        if material.lower() == name.strip().lower():
            return row
    raise ValueError(f"unknown contact material {name!r}: expected one of {', '.join(MATERIALS)}")


@dataclass(frozen=True)
class Impactor:
    """A tip on a front mass, and behind a neck the mass on which the accelerometer sits.

    `mass_kg` is all that moves (nominal). With `rear_fraction` 0 it is one rigid body. The load
    cell sits between the tip and the front mass. The spreads are standard deviations of the
    logarithm from one strike to the next, under `bench.hand_scatter`; `mass_error` is what
    `contact.effective_mass` adds at strength 1. Raises `ValueError` for figures that no impactor
    has.
    """

    tip: ContactMaterial
    tip_radius_m: float
    mass_kg: float
    tip_height_m: float = math.inf  # of a polymer tip, which stiffens against its metal holder
    tip_mass_kg: float = 0.0
    rear_fraction: float = 0.0
    rear_resonance_hz: float = 0.0
    rear_damping: float = 0.0
    wave_delay_s: float = 0.0
    mass_error: float = 0.05
    mass_spread: float = 0.0
    radius_spread: float = 0.0

    def __post_init__(self) -> None:
        for name in ("tip_radius_m", "mass_kg", "tip_height_m"):
            _check(name, getattr(self, name), getattr(self, name) > 0, "a number above 0")
        for name in ("tip_mass_kg", "wave_delay_s", "mass_spread", "radius_spread", "rear_damping"):
            _check(name, getattr(self, name), 0 <= getattr(self, name) < math.inf, "0 or more")
        _check("mass_kg", self.mass_kg, math.isfinite(self.mass_kg), "a finite number")
        _check(
            "rear_fraction",
            self.rear_fraction,
            0 <= self.rear_fraction < 1,
            "a number from 0 to below 1",
        )
        _check(
            "rear_damping", self.rear_damping, self.rear_damping < 1, "less than critical damping"
        )
        resonance = self.rear_resonance_hz
        _check(
            "rear_resonance_hz",
            resonance,
            (resonance > 0) == (self.rear_fraction > 0),
            "above 0 with a rear mass",
        )
        front = self.mass_kg * (1 - self.rear_fraction)
        _check(
            "tip_mass_kg",
            self.tip_mass_kg,
            self.tip_mass_kg < front,
            "less than the front mass it is a part of",
        )


@dataclass(frozen=True)
class Anvil:
    """A plate of metal that is bolted to the resonant plate through a stiff joint.

    The size is assumed (100 x 100 x 15 mm), and so is the joint: pressed dry metal faces some 100
    cm^2 wide.
    """

    material: ContactMaterial
    volume_m3: float = 0.1 * 0.1 * 0.015
    joint_stiffness_n_m: float = 2e9
    joint_damping: float = 0.05  # of critical, anvil on its joint

    def __post_init__(self) -> None:
        for name in ("volume_m3", "joint_stiffness_n_m"):
            _check(
                name, getattr(self, name), 0 < getattr(self, name) < math.inf, "a number above 0"
            )
        _check(
            "joint_damping",
            self.joint_damping,
            0 <= self.joint_damping < 1,
            "0 to below critical damping",
        )

    @property
    def mass_kg(self) -> float:
        return self.material.density_kg_m3 * self.volume_m3


@dataclass(frozen=True)
class Layer:
    """The insulator: a polymer sheet that the tip presses against the anvil (thesis chapter 4).

    Its kind and size are not given there: a sheet of polyethylene, 3 mm, is assumed.
    """

    thickness_m: float = 3e-3
    oedometric_modulus_pa: float = (
        1.3e9  # E (1 - nu) / ((1 + nu) (1 - 2 nu)) of E = 0.5 GPa, nu = 0.42
    )
    retardation_time_s: float = 10e-6
    crushed_share: float = 0.7  # of the thickness, where it is solid
    seating_force_n: float = 20.0  # with which the sheet is held down

    def __post_init__(self) -> None:
        for name in (
            "thickness_m",
            "oedometric_modulus_pa",
            "retardation_time_s",
            "crushed_share",
            "seating_force_n",
        ):
            _check(
                name, getattr(self, name), 0 < getattr(self, name) < math.inf, "a number above 0"
            )


@dataclass(frozen=True)
class ImpactTarget:
    """What the impactor meets. `plate_impedance_n_s_m` is the force per velocity of the resonant
    plate's surface."""

    face: ContactMaterial
    plate_impedance_n_s_m: float
    anvil: Anvil | None = None
    insulator: Layer | None = None

    def __post_init__(self) -> None:
        impedance = self.plate_impedance_n_s_m
        _check("plate_impedance_n_s_m", impedance, 0 < impedance < math.inf, "a number above 0")
        if self.insulator is not None and self.anvil is None:
            raise ValueError("an insulator without an anvil: expected an anvil on which it lies")


def target(
    plate_material: str,
    plate_thickness_m: float,
    *,
    anvil_material: str = "none",
    insulator: str = "none",
    edge_factor: float = 1.0,
) -> ImpactTarget:
    """A target in the words of a plan's table.

    The plate carries flexural waves away as the point impedance 8 sqrt(D rho h) of an infinite thin
    plate does, before their echoes come back.

    Parameters:
        plate_material: The material of the resonant plate, of `MATERIALS`.
        plate_thickness_m: The thickness h of the resonant plate.
        anvil_material: The material of the anvil, of `MATERIALS`, or "none", which is the default.
        insulator: "polymeric" for a sheet on the anvil, or "none", which is the default.
        edge_factor: A factor on the impedance, above 0 and at most 1, by which it is lower near an
            edge: 0.44 on a free one (3.5 for 8). By default 1, far from all edges.

    Raises:
        ValueError: For unknown words and impossible figures.

    Source:
        Cremer, Heckl and Petersson, Structure-Borne Sound, 2005, section 5.4, also for the free
        edge; Zener, Phys. Rev. 59 (1941) 669.
    """
    plate = contact_material(plate_material)
    _check(
        "plate_thickness_m", plate_thickness_m, 0 < plate_thickness_m < math.inf, "a number above 0"
    )
    _check(
        "edge_factor", edge_factor, 0 < edge_factor <= 1, "a share of the impedance far from edges"
    )
    if insulator not in ("none", "polymeric"):
        raise ValueError(f"insulator {insulator!r}: expected 'none' or 'polymeric'")
    anvil = None if anvil_material == "none" else Anvil(contact_material(anvil_material))
    rigidity = plate_thickness_m**3 / (12 * plate.compliance_1_pa)
    impedance = 8 * math.sqrt(rigidity * plate.density_kg_m3 * plate_thickness_m)
    layer = Layer() if insulator == "polymeric" else None
    return ImpactTarget(
        plate if anvil is None else anvil.material, edge_factor * impedance, anvil, layer
    )


def _check(name: str, value: float, fine: bool, expected: str) -> None:
    if not fine:
        raise ValueError(f"{name} = {value!r}: expected {expected}")


#: Nominal speeds of the two levels of Table 4.1, which gives none: a tap and a blow.
HAND_SPEEDS_M_S = {"low": 0.8, "high": 1.8}
#: Standard deviation of the logarithm of a hand's speed at one level.
HAND_SPREAD = 0.10


def hammer(tip_material: str, tip_radius_m: float, *, mass_kg: float = 0.32) -> Impactor:
    """The instrumented hammer of the thesis: load cell at the front, accelerometer at the rear of
    the head.

    The rear fifth rings on the neck of the head at 7 kHz. The wave along the head takes 12.4 us
    (thesis, section 4.1); with the phase of the charge amplifier the lag is put at 25 us, between
    one and two samples of 51.2 kHz.

    Parameters:
        tip_material: The material of the tip, of `MATERIALS`.
        tip_radius_m: The radius of the tip at its apex.
        mass_kg: All that moves; 0.32 by default.

    Raises:
        ValueError: For an unknown material, and for figures that no impactor has.
    """
    tip = contact_material(tip_material)
    return Impactor(
        tip,
        tip_radius_m,
        mass_kg,
        tip_height_m=0.015 if tip.polymer else math.inf,
        tip_mass_kg=0.04 * mass_kg,
        rear_fraction=0.2,
        rear_resonance_hz=7000.0,
        rear_damping=0.03,
        wave_delay_s=25e-6,
        mass_spread=0.03,
        radius_spread=0.08,
    )


def projectile(mass_kg: float, tip_material: str, tip_radius_m: float) -> Impactor:
    """The bullet: one rigid body whose tip meets the target a little off its axis.

    Parameters:
        mass_kg: All that moves.
        tip_material: The material of the tip, of `MATERIALS`.
        tip_radius_m: The radius of the tip at its apex.

    Raises:
        ValueError: For an unknown material, and for figures that no impactor has.
    """
    tip = contact_material(tip_material)
    height = 0.030 if tip.polymer else math.inf
    return Impactor(
        tip,
        tip_radius_m,
        mass_kg,
        tip_height_m=height,
        mass_error=0.01,
        mass_spread=0.001,
        radius_spread=0.03,
    )


def hand_speed(level: str, effects: Effects, rng: np.random.Generator) -> float:
    """The speed (m/s) of one blow, with the operator's scatter.

    Parameters:
        level: A name of `HAND_SPEEDS_M_S`: "low" or "high".
        effects: Which effects act, and how strongly; only `bench.hand_scatter` matters.
        rng: Generator of random numbers, of which one is drawn.

    Raises:
        ValueError: For another level.
    """
    if level not in HAND_SPEEDS_M_S:
        raise ValueError(f"hammer speed {level!r}: expected one of {', '.join(HAND_SPEEDS_M_S)}")
    scatter = HAND_SPREAD * effects["bench.hand_scatter"] * float(rng.standard_normal())
    return HAND_SPEEDS_M_S[level] * math.exp(scatter)
