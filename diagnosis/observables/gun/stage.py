"""The gun: from the tank's pressure and the projectile's mass, as read, to the velocity that the bench shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import ClassVar, cast

import numpy as np

from ....twin.effects import Effect, catalogue
from ....twin.gun.bench import GunBench
from ....twin.gun.effect import GunEffect
from ....twin.gun.shots import gun_velocity
from ...record import CampaignRecord
from ..base import Floats, Observable, Stage, Upstream, changes_reading, sensor_chain
from ..batching import at_rows, by_kinds, stacked

#: 1 % of velocity counts as agreement; the scatter where no run states its uncertainty.
TOLERANCE, ASSUMED_FLOOR = 0.01, 0.01
#: Velocities that are compared within a hundredth need no more than five digits.
_COARSER = 30.0
#: What each shot is read off with.
READINGS = ("tank_pressure_pa", "bullet_mass_kg")
#: Of a standard deviation: small enough for a derivative, large enough for its digits.
_STEP = 1e-3


class GunStage(Stage):
    """Eq. 2.16 with gauge pressure and the campaign's own friction and efficiency, which stays as effects come in.

    The travel is that of each run where the record has it, else the gun's.

    `uncertain`: standard deviations of the gun's settings by their names in `GunBench`, and of "tank_pressure_pa" and
    "bullet_mass_kg", each the same in all runs. Raises `ValueError` for a record without a gun, and for a name or a
    value of `uncertain` that cannot be.
    """

    name: ClassVar[str] = "gun"

    def __init__(self, record: CampaignRecord, uncertain: Mapping[str, float] | None = None) -> None:
        super().__init__(record)
        if record.gun is None:
            raise ValueError(f"campaign {record.name!r} has no gun: its settings stand in [bench.gun]")
        self.bench: GunBench = record.gun
        self.uncertain = dict(uncertain or {})
        self.pressure_pa = _numbers([run.tank_pressure_pa for run in record.runs])
        self.mass_kg = _numbers([run.bullet_mass_kg for run in record.runs])
        self.velocity_m_s = _numbers([run.velocity_m_s for run in record.runs])
        self.travel_m = _numbers([run.travel_m or self.bench.travel_m for run in record.runs])
        self._medians = tuple(map(self._median, (self.pressure_pa, self.mass_kg, self.travel_m)))
        self._nuisances = self._derivatives()

    @property
    def simulator(self) -> str:
        return "gun:adiabatic"

    @property
    def observables(self) -> tuple[Observable, ...]:
        stated = np.exp(_logarithms(_numbers([run.velocity_u_m_s for run in self.record.runs])) - self.measured()[:, 0])
        good = stated[np.isfinite(stated)]
        floor = float(np.median(good)) if good.size else ASSUMED_FLOOR
        return (Observable("ln_velocity", "gun", "velocity", "1", TOLERANCE, floor),)

    @property
    def shows(self) -> tuple[str, ...]:
        if not np.isfinite(self.residuals()).any():
            return ()
        return tuple(identity for identity, kind in catalogue().items() if acts_on_gun(kind))

    def measured(self) -> Floats:
        return _logarithms(self.velocity_m_s)[:, None]

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        pressure = self._true_pressure(effects, self.pressure_pa, upstream)
        return self._shown(effects, pressure, self.mass_kg, self.travel_m)[:, None]

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:
        pressure = self._true_pressure(effects, self.pressure_pa, upstream)
        velocity = self._fired(effects, pressure, self.mass_kg, self.travel_m)
        return cast(Sequence[float], velocity.tolist())

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        c = len(self.record.configurations)
        changes = np.zeros((len(sets), c))
        nominal = self._shown((), *self._medians)
        acting = [[effect for effect in effects if acts_on_gun(type(effect))] for effects in sets]
        for rows in by_kinds(acting):
            effects = stacked([acting[row] for row in rows], c)
            pressure, mass, travel = (np.tile(values, len(rows)) for values in self._medians)
            shown = self._shown(effects, self._true_pressure(effects, pressure), mass, travel)
            changes[rows] = shown.reshape(len(rows), c) - nominal
        return changes[:, :, None]

    def _median(self, values: Floats) -> Floats:
        """(C,): medians over the runs of each configuration; NaN without any."""
        rows = self.record.configuration_of
        groups = [values[(rows == c) & np.isfinite(values)] for c in range(len(self.record.configurations))]
        return np.array([float(np.median(group)) if group.size else np.nan for group in groups])

    def _true_pressure(self, effects: Sequence[Effect], reading_pa: Floats, upstream: Upstream | None = None) -> Floats:
        """`upstream` is the true pressure of each run, where it is known."""
        if upstream is not None:
            return np.asarray(upstream, dtype=np.float64)
        return sensor_chain(effects).true_pressure_pa(reading_pa)

    def _shown(self, effects: Sequence[Effect], pressure_pa: Floats, mass_kg: Floats, travel_m: Floats) -> Floats:
        """ln of what the velocity measurement shows."""
        velocity = self._fired(effects, pressure_pa, mass_kg, travel_m)
        return _logarithms(sensor_chain(effects).measured_velocity_m_s(velocity))

    def _fired(self, effects: Sequence[Effect], pressure_pa: Floats, mass_kg: Floats, travel_m: Floats) -> Floats:
        """True velocities; NaN for a shot that stays in the barrel, or of which pressure or mass is not known."""
        gun = tuple(effect for effect in effects if isinstance(effect, GunEffect))
        velocity = np.full(pressure_pa.shape, np.nan)
        rows = np.flatnonzero((pressure_pa >= 0) & np.isfinite(pressure_pa) & (mass_kg > 0) & np.isfinite(mass_kg))
        if rows.size:
            gun = at_rows(gun, rows) if rows.size < pressure_pa.size else gun
            shots = gun_velocity(self.bench, pressure_pa[rows], mass_kg[rows], gun, _COARSER, travel_m=travel_m[rows])
            velocity[rows] = np.where(shots.left, shots.velocity_m_s, np.nan)
        return velocity

    def _derivatives(self) -> dict[str, Floats]:
        """(C, 1) by name: ln velocity's derivative times one standard deviation, at the medians of configurations.

        Central differences; one-sided where the other side is no gun, as above an efficiency of one. NaN where the
        nominal shot stays in the barrel.
        """
        known = (*(item.name for item in fields(GunBench)), *READINGS)
        derivatives = {}
        for name, sd in self.uncertain.items():
            if name not in known:
                raise ValueError(f"no uncertain setting {name!r} of the gun; there are: {', '.join(known)}")
            if not (np.isfinite(sd) and sd >= 0):
                raise ValueError(f"uncertain {name} = {sd!r}: expected a standard deviation, not negative")
            if sd > 0:
                sides = [(sign, self._logarithm_beside(name, sign * _STEP * sd)) for sign in (1.0, -1.0, 0.0)]
                (a, high), (b, low), *_ = [(sign, values) for sign, values in sides if values is not None]
                derivatives[name] = np.asarray((high - low) / ((a - b) * _STEP))[:, None]
        return derivatives

    def _logarithm_beside(self, name: str, step: float) -> Floats | None:
        """ln velocity (C,) with one setting moved; None where that is no gun."""
        (pressure, mass, travel), bench = self._medians, self.bench
        if name == "tank_pressure_pa":
            pressure = pressure + step
        elif name == "bullet_mass_kg":
            mass = mass + step
        else:
            travel = travel + step if name == "travel_m" else travel
            try:
                bench = replace(bench, **{name: getattr(bench, name) + step})
            except ValueError:
                return None
        velocity = np.full(pressure.shape, np.nan)
        good = (pressure >= 0) & (mass > 0) & (travel > 0)
        velocity[good] = gun_velocity(bench, pressure[good], mass[good], travel_m=travel[good]).velocity_m_s
        return _logarithms(velocity)


def acts_on_gun(kind: type[Effect]) -> bool:
    """Whether an effect changes the muzzle velocity that a bench shows for a pressure that it shows."""
    return issubclass(kind, GunEffect) or changes_reading(kind, "true_pressure_pa", "measured_velocity_m_s")


def _numbers(values: Sequence[float | None]) -> Floats:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _logarithms(velocity_m_s: Floats) -> Floats:
    """NaN where there is no velocity."""
    return np.log(np.where(velocity_m_s > 0, velocity_m_s, np.nan))
