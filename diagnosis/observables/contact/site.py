"""What strikes and what is struck in every run, out of a campaign's record."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats, Rows
from ....twin.contact.bodies import Bodies
from ....twin.contact.effect import ContactEffect
from ....twin.contact.impact import impact
from ....twin.contact.impacts import plate_impedance
from ....twin.contact.pulse import ContactPulse
from ....twin.materials import ElasticMaterial
from ...record import CampaignRecord, Factor, Run, RunConfiguration

#: Of each contact's own time: peak and times are within 1e-6 of the solver's full steps.
_STEPS = 32
_OF_MATERIAL = ("youngs_modulus_pa", "poisson_ratio", "density_kg_m3", "yield_strength_pa")


@dataclass(frozen=True, eq=False)
class Sites:
    """n nominal impacts: the tip on a rigid target of the first layer's material, all but their velocity."""

    bodies: Bodies  # at 1 m/s
    insulated: NDArray[np.bool_]
    impedance_n_s_m: Floats  # of the plate below, whatever lies on it

    def __len__(self) -> int:
        return len(self.bodies)

    def take(self, rows: Rows) -> Sites:
        """Some of them, each as often as it is named."""
        quantities = {name: value for name, value in vars(self.bodies).items() if value is not None}
        bodies = replace(self.bodies, **{name: value[rows] for name, value in quantities.items()})
        return Sites(bodies, self.insulated[rows], self.impedance_n_s_m[rows])

    def pulses(self, velocity_m_s: Floats, effects: tuple[ContactEffect, ...] = ()) -> ContactPulse:
        """At these velocities (n,), all above 0. Raises `ArithmeticError` where a contact does not end."""
        bodies, place = replace(self.bodies, impact_velocity_m_s=velocity_m_s), self.impedance_n_s_m
        return impact(bodies, effects, insulated=self.insulated, plate_impedance_n_s_m=place, steps=_STEPS)


def sites_of(record: CampaignRecord) -> Sites:
    """One for each run. Raises `ValueError` naming configuration and factor for what a record does not tell."""
    rows = [_row(record, record.configurations[run.configuration], run) for run in record.runs]
    columns = {name: [row[name] for row in rows] for name in (rows[0] if rows else {})}
    insulated = np.array(columns.pop("insulated"), dtype=np.bool_)
    impedance = np.array(columns.pop("impedance"), dtype=np.float64)
    quantities = {name: None if None in values else np.array(values) for name, values in columns.items()}
    return Sites(Bodies.of(**quantities, impact_velocity_m_s=np.ones(len(rows))), insulated, impedance)


def _row(record: CampaignRecord, configuration: RunConfiguration, run: Run) -> dict[str, float | bool | None]:
    tip, plate, anvil = layers(record, configuration)
    elastic = (plate.youngs_modulus_pa, plate.poisson_ratio, plate.density_kg_m3, record.plate_thickness_m)
    return {
        **{f"impactor_{name}": getattr(tip, name) for name in _OF_MATERIAL},
        **{f"target_{name}": getattr(anvil or plate, name) for name in _OF_MATERIAL},
        "impactor_radius_m": float(_stated(configuration, "tip_radius", configuration.factors.get("tip_radius"))),
        "impactor_mass_kg": impactor_mass_kg(record, run),
        "plate_thickness_m": record.plate_thickness_m,
        "insulated": configuration.factors.get("insulator", "none") != "none",
        "impedance": float(plate_impedance(*(np.array(value) for value in elastic))),
    }


def layers(
    record: CampaignRecord, configuration: RunConfiguration
) -> tuple[ElasticMaterial, ElasticMaterial, ElasticMaterial | None]:
    """Tip, plate and anvil, None without one. Raises `ValueError` as `sites_of`."""
    factors = {**configuration.factors, "plate_material": record.plate_material_of(configuration)}

    def material(name: str) -> ElasticMaterial:
        word = str(_stated(configuration, name, factors.get(name)))
        if word not in record.materials:
            names = ", ".join(record.materials) or "none"
            raise ValueError(f"{name} = {word!r}: no such material in the record; there are: {names}")
        return record.materials[word]

    anvil = factors.get("anvil_material", "none") != "none"
    return material("tip_material"), material("plate_material"), material("anvil_material") if anvil else None


def impactor_mass_kg(record: CampaignRecord, run: Run) -> float:
    """The hammer's, or the bullet's: the run's own, else its configuration's. Raises `ValueError` without any."""
    configuration = record.configurations[run.configuration]
    mass = record.hammer_mass_kg if record.kind == "hammer" else run.bullet_mass_kg
    mass = configuration.factors.get("bullet_mass") if mass is None else mass  # type: ignore[assignment]
    if mass is None:
        raise ValueError(f"{record.name}, run {run.run}: no mass; give [bench.hammer] mass_kg or bullet_mass_kg")
    return float(mass)


def _stated(configuration: RunConfiguration, name: str, value: Factor | None) -> Factor:
    if value is None:
        elsewhere = ", or as material in [bench.plate]" if name == "plate_material" else ""
        raise ValueError(
            f"configuration {configuration.label!r} has no {name}: give it as a column of the table of runs{elsewhere}"
        )
    return value
