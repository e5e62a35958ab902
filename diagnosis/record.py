"""What a campaign measured, as a diagnosis takes it: no store, no files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from ..schema.known_facts import KnownFact
from ..twin.gun.bench import GunBench
from ..twin.plate.modal import ModalPlate
from ..twin.setting import ElasticMaterial

Factor = str | float


@dataclass(frozen=True, eq=False)
class Series:
    """Evenly spaced samples (n,), SI. Sample i is at `start_s + i / sampling_rate_hz`; 0 s is when
    contact begins."""

    values: Floats
    sampling_rate_hz: float
    start_s: float

    @property
    def time_s(self) -> Floats:
        return np.asarray(self.start_s + np.arange(self.values.size) / self.sampling_rate_hz)

    @property
    def rest(self) -> float:
        """Median of the samples before contact; 0 where there are none."""
        before = self.values[self.time_s < 0]
        return float(np.median(before)) if before.size else 0.0

    @property
    def excursions(self) -> tuple[float, float]:
        """How far the samples rise above their rest, and how far they fall below it."""
        above_rest = self.values - self.rest
        return float(above_rest.max(initial=0.0)), float(-above_rest.min(initial=0.0))


@dataclass(frozen=True)
class RunConfiguration:
    """A setting that runs share. `factors` by the names of the store, without units in them,
    numbers in SI.

    ("tip_material", "tip_radius", "anvil_material", "insulator", "impact_position",
    "tank_pressure", "bullet_mass", "hammer_speed" and the lab's own.)
    """

    label: str
    factors: Mapping[str, Factor]


@dataclass(frozen=True, eq=False)
class Run:
    """One impact or shot. What was not measured is None. `order` is its place in the order of runs,
    from 0.

    `configuration` is a row of `CampaignRecord.configurations`. Pressures are gauge, as read.
    `velocity_m_s` is the recorded one: muzzle velocity of a shot, impact velocity of a hammer.
    `travel_m` is the projectile's travel to the vent holes where the campaign states it for each
    run; else that of the gun holds. `force` is what the force channel shows of the contact, with
    some samples before it; `accelerations` by channel, on the same clock, as long as they ring.
    `tank_pressure` is the record of a shot's tank, in means over half a millisecond, and its 0 s is
    the middle of the projectile's passage through the laser. `set_pressure_pa` is what the
    regulator was set to, where it is another instrument than the transducer: they differ.
    """

    configuration: int
    run: int
    repetition: int
    order: int
    tank_pressure_pa: float | None = None
    bullet_mass_kg: float | None = None
    velocity_m_s: float | None = None
    velocity_u_m_s: float | None = None
    travel_m: float | None = None
    force: Series | None = None
    accelerations: Mapping[str, Series] = field(default_factory=dict)
    tank_pressure: Series | None = None
    set_pressure_pa: float | None = None


@dataclass(frozen=True, eq=False)
class CampaignRecord:
    """A campaign as it was measured, and the bench as the lab believes it to be.

    `plate` is the measured modal table (or a solved model) with the channels' names as its sensors.
    `plate_points_known` is false for a model whose impact points and sensors were assumed: then its
    frequencies count, and its shapes do not. `plate_model_material` is what such a model was solved
    for. `plate_material` and `plate_outline_m` (corners in m) are those of `[bench.plate]`; a
    configuration with a factor `plate_material` goes by that. `materials` by the words of the
    factors. `known_facts` are what the laboratory measured of its bench, by parameters of effects.
    `assumptions` are sentences for the report: what was taken for granted on reading.
    """

    name: str
    kind: str  # "hammer" or "gun"
    configurations: tuple[RunConfiguration, ...]
    runs: tuple[Run, ...]
    gun: GunBench | None = None
    hammer_mass_kg: float | None = None
    plate: ModalPlate | None = None
    plate_points_known: bool = True
    plate_model_material: str | None = None
    plate_thickness_m: float = 0.010
    plate_material: str | None = None
    plate_outline_m: tuple[tuple[float, float], ...] = ()
    materials: Mapping[str, ElasticMaterial] = field(default_factory=dict)
    known_facts: tuple[KnownFact, ...] = ()
    assumptions: tuple[str, ...] = ()

    def plate_material_of(self, configuration: RunConfiguration) -> str | None:
        """The material of the plate that a configuration strikes; None where the campaign does not
        state it.

        Parameters:
            configuration: The configuration; its factor `plate_material` goes before that of the
                campaign.
        """
        factor = configuration.factors.get("plate_material")
        return self.plate_material if factor is None else str(factor)

    @property
    def configuration_of(self) -> NDArray[np.intp]:
        """(R,): the configuration of each run."""
        return np.array([run.configuration for run in self.runs], dtype=np.intp)

    def run_values(self, name: str) -> Floats:
        """A number of each run (R,); NaN where it was not measured.

        Parameters:
            name: The name of the number in `Run`.
        """
        return np.array([getattr(run, name) for run in self.runs], dtype=np.float64)
