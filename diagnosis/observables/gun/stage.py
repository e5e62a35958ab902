"""The gun: from the tank's pressure and the projectile's mass, as read, to the velocity that the bench shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import cast

import numpy as np

from ....array_types import Floats
from ....signals.valve_profile import ValveProfile
from ....twin.effects import Effect
from ....twin.gun.bench import GunBench
from ....twin.gun.effects.valve_flow import ValveFlow
from ....twin.gun.shot import GunEffect
from ....twin.gun.shots import gun_velocity
from ...record import CampaignRecord, RunConfiguration
from ..base import Observable, Stage, Upstream, at_rows, batched_changes, sensor_chain

#: 1 % of velocity counts as agreement; the scatter where no run states its uncertainty.
TOLERANCE, ASSUMED_FLOOR = 0.01, 0.01
#: Velocities that are compared within a hundredth need no more than five digits.
_COARSER = 30.0
#: What each shot is read off with.
READINGS = ("tank_pressure_pa", "bullet_mass_kg")
#: Of a standard deviation: small enough for a derivative, large enough for its digits.
_STEP = 1e-3


class GunObservables(Stage):
    """Eq. 2.16 with gauge pressure and the campaign's own friction and efficiency, which stays as effects come in.

    The travel is that of each run where the record has it, else the gun's.

    `uncertain`: standard deviations of the gun's settings by their names in `GunBench`, and of "tank_pressure_pa" and
    "bullet_mass_kg", each the same in all runs. Raises `ValueError` for a record without a gun, and for a name or a
    value of `uncertain` that cannot be.
    """

    name = "gun"
    simulator = "gun:adiabatic"
    effect_kind = GunEffect
    sensor_hooks = ("true_pressure_pa", "measured_velocity_m_s")

    def __init__(self, record: CampaignRecord, uncertain: Mapping[str, float] | None = None) -> None:
        super().__init__(record)
        if record.gun is None:
            raise ValueError(f"campaign {record.name!r} has no gun: its settings stand in [bench.gun]")
        self.bench: GunBench = record.gun
        self.uncertain = dict(uncertain or {})
        self._velocity_m_s = record.run_values("velocity_m_s")
        self._shots = {
            **{name: record.run_values(name) for name in READINGS},
            "travel_m": np.array([run.travel_m or self.bench.travel_m for run in record.runs], dtype=np.float64),
            # The row of the configuration, which has the profile: a number, to be tiled and thinned as the others.
            "valve_profile": np.array([run.configuration for run in record.runs], dtype=np.float64),
        }
        self._profiles = [_profile(configuration) for configuration in record.configurations]
        self._medians = {name: self._median(values) for name, values in self._shots.items()}
        self._nuisances = self._derivatives()

    @property
    def observables(self) -> tuple[Observable, ...]:
        stated = np.exp(_logarithms(self.record.run_values("velocity_u_m_s")) - self.measured()[:, 0])
        good = stated[np.isfinite(stated)]
        floor = float(np.median(good)) if good.size else ASSUMED_FLOOR
        return (Observable("ln_velocity", "gun", "velocity", "1", TOLERANCE, floor),)

    @property
    def shows(self) -> tuple[str, ...]:
        return super().shows if np.isfinite(self.residuals()).any() else ()

    def measured(self) -> Floats:
        return _logarithms(self._velocity_m_s)[:, None]

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        return self._shown(effects, self._fired(effects, self._shots, upstream))

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:
        return cast(Sequence[float], self._fired(effects, self._shots, upstream).tolist())

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        def observed(effects: Sequence[Effect], count: int) -> Floats:
            shots = {name: np.tile(values, count) for name, values in self._medians.items()}
            return self._shown(effects, self._fired(effects, shots))

        return batched_changes([self.acting(effects) for effects in sets], observed)

    def _median(self, values: Floats) -> Floats:
        """(C,): medians over the runs of each configuration; NaN without any."""
        rows = self.record.configuration_of
        groups = [values[(rows == c) & np.isfinite(values)] for c in range(len(self.record.configurations))]
        return np.array([float(np.median(group)) if group.size else np.nan for group in groups])

    def _shown(self, effects: Sequence[Effect], velocity_m_s: Floats) -> Floats:
        """(n, 1): ln of what the velocity measurement shows of true velocities."""
        return _logarithms(sensor_chain(effects).measured_velocity_m_s(velocity_m_s))[:, None]

    def _fired(
        self,
        effects: Sequence[Effect],
        shots: Mapping[str, Floats],
        upstream: Upstream | None = None,
        bench: GunBench | None = None,
    ) -> Floats:
        """True velocities (n,); NaN for a shot that stays in the barrel, or of which pressure or mass is not known.

        `upstream` is the true pressure of each, where it is known, `bench` another than the stage's.
        """
        read_pa, mass_kg, travel_m = shots["tank_pressure_pa"], shots["bullet_mass_kg"], shots["travel_m"]
        given = sensor_chain(effects).true_pressure_pa(read_pa) if upstream is None else upstream
        pressure_pa = np.asarray(given, dtype=np.float64)
        velocity_m_s = np.full(pressure_pa.shape, np.nan)
        good = (pressure_pa >= 0) & np.isfinite(pressure_pa) & (mass_kg > 0) & np.isfinite(mass_kg) & (travel_m > 0)
        if (rows := np.flatnonzero(good)).size:
            gun = at_rows([effect for effect in effects if isinstance(effect, GunEffect)], rows)
            bench = bench or self.bench
            fired = gun_velocity(
                bench,
                pressure_pa[rows],
                mass_kg[rows],
                gun,
                _COARSER,
                travel_m=travel_m[rows],
                valve_profiles=self._stated_profiles(gun, shots["valve_profile"][rows]),
            )
            velocity_m_s[rows] = np.where(fired.left, fired.velocity_m_s, np.nan)
        return velocity_m_s

    def _stated_profiles(
        self, effects: Sequence[GunEffect], configurations: Floats
    ) -> list[ValveProfile | None] | None:
        """Of shots (n,) by the rows of their configurations: where a valve acts. The nominal law has none."""
        valve = next((effect for effect in effects if isinstance(effect, ValveFlow)), None)
        if valve is None or not any(self._profiles):
            return None
        acts = np.broadcast_to(np.asarray(valve.loss_coefficient) > 0, configurations.shape)
        return [self._profiles[int(row)] if on else None for row, on in zip(configurations, acts, strict=True)]

    def _derivatives(self) -> dict[str, Floats]:
        """(C, 1) by name: ln velocity's derivative times one standard deviation, at the medians of configurations.

        Central differences; one-sided where the other side is no gun, as above an efficiency of one. NaN where the
        nominal shot stays in the barrel.
        """
        names = (*(item.name for item in fields(GunBench)), *READINGS)
        derivatives = {}
        for name, sd in self.uncertain.items():
            if name not in names:
                raise ValueError(f"no uncertain setting {name!r} of the gun; there are: {', '.join(names)}")
            if not (np.isfinite(sd) and sd >= 0):
                raise ValueError(f"uncertain {name} = {sd!r}: expected a standard deviation, not negative")
            if sd > 0:
                sides = [(sign, self._beside(name, sign * _STEP * sd)) for sign in (1.0, -1.0, 0.0)]
                (a, high), (b, low), *_ = [(sign, values) for sign, values in sides if values is not None]
                derivatives[name] = np.asarray((high - low) / ((a - b) * _STEP))
        return derivatives

    def _beside(self, name: str, step: float) -> Floats | None:
        """ln velocity (C, 1) with one setting moved; None where that is no gun."""
        if name in self._medians:
            return self._shown((), self._fired((), {**self._medians, name: self._medians[name] + step}))
        try:
            bench = replace(self.bench, **{name: getattr(self.bench, name) + step})
        except ValueError:
            return None
        return self._shown((), self._fired((), self._medians, bench=bench))


def _logarithms(velocity_m_s: Floats) -> Floats:
    """NaN where there is no velocity."""
    return np.log(np.where(velocity_m_s > 0, velocity_m_s, np.nan))


def _profile(configuration: RunConfiguration) -> ValveProfile | None:
    text = configuration.factors.get("valve_profile")
    return None if text is None else ValveProfile.parse(str(text))
