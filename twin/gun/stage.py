"""The stage of the gun: what the operator sets, to the velocity of impact."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...array_types import Floats
from ...signals.valve_profile import ValveProfile
from ..contact_interface import Extrapolation
from ..sensors.chain import SensorChain
from ..setting import Setting
from .bench import GunBench
from .calibration import VelocityPosterior, VelocityShots
from .nominal import excess_velocity, refuse_faster_than_gas
from .prior import GunPrior, gun_prior
from .shot import GunEffect

# Settings that are asked at once: K members each.
_CHUNK = 2048
# Where a smaller share of the guns fires the bullet, none does.
_LEAST_LEAVING = 0.05
# ln: beyond the fastest measured shot, where that has more energy than the stated bench gives.
_BEYOND_FASTEST = 0.05
# A pressure or a mass that is as near to the range of the shots is in it: they are read to no
# better.
_SAME = 0.01


@dataclass(frozen=True)
class GunStage:
    """A gun with effects; `velocity_spread` is the standard deviation of log(measured over
    predicted velocity).

    With `unknown_effects` all other effects of the catalogue are drawn from their documented likely
    ranges (`gun.prior`), and `shots`, measured on this gun, say which of these guns it is
    (`gun.calibration`); the shots then say how they scatter, too. `source` says where the bench's
    numbers are from. Raises `ValueError` for a spread that is negative or not finite, for shots
    where no effects are unknown, and for effects with values for each shot.
    """

    bench: GunBench
    velocity_spread: float
    effects: tuple[GunEffect, ...] = ()
    source: str = ""
    unknown_effects: bool = False
    shots: VelocityShots | None = None

    def __post_init__(self) -> None:
        if not (0 <= self.velocity_spread < math.inf):
            raise ValueError(
                f"velocity_spread = {self.velocity_spread!r}: expected 0 or more, finite"
            )
        several = [
            effect.id
            for effect in self.effects
            if any(np.ndim(value) for value in vars(effect).values())
        ]
        if several and self.unknown_effects:
            raise ValueError(
                f"{several[0]} has a parameter with "
                f"several values: expected one value for all shots"
            )
        if self.shots is not None and not self.unknown_effects:
            raise ValueError(
                "shots are given for a gun all effects of which are known: expected unknown_effects"
            )

    @property
    def label(self) -> str:
        """What answers: "eq. 2.16 (campaign spring)", the shots that it has learned from, the
        effects' ids."""
        law = f"eq. 2.16 ({self.source})" if self.source else "eq. 2.16"
        drawn = ("unknown effects drawn",) if self.unknown_effects else ()
        learned = drawn if self.shots is None else (f"{len(self.shots)} measured shots",)
        return " + ".join((law, *learned, *(effect.id for effect in self.effects)))

    @property
    def normals(self) -> int:
        """How many standard normal numbers one random shot takes: which gun it is, and the scatter
        of the shot."""
        return 2 if self.unknown_effects else 1

    def velocities(self, settings: Sequence[Setting], sensors: SensorChain) -> Floats:
        """The central true velocities of impact (n,), m/s: medians of the guns whose bullet leaves
        the barrel; 0 where fewer than one in twenty does.

        Parameters:
            settings: n settings of the bench; one that gives the velocity of impact keeps it.
            sensors: The sensors' stated errors, of which the readings of the tank's pressure are
                freed.

        Raises:
            ValueError: Where eq. 2.16 gives more than the escape speed of the gas.
        """
        velocity = _given_velocities(settings)
        for rows, pressure, mass, profile in self._fired_settings(settings, sensors):
            if self.unknown_effects:
                velocity[rows] = _central(self._guns(pressure, mass, sensors, profile)[0])
            else:
                velocity[rows] = self.fired(pressure, mass, profile)
        return velocity

    def velocity_draws(
        self, settings: Sequence[Setting], sensors: SensorChain, z: Floats
    ) -> Floats:
        """Random true velocities (d, n), m/s: a draw is one gun for all settings, and 0 where its
        bullet stays in the barrel.

        Parameters:
            settings: n settings of the bench; one that gives the velocity of impact keeps it.
            sensors: The sensors' stated errors, of which the readings of the tank's pressure are
                freed.
            z: Standard normal numbers (d, normals) of d draws.

        Raises:
            ValueError: As `velocities`.
        """
        velocity = np.tile(_given_velocities(settings), (len(z), 1))
        for rows, pressure, mass, profile in self._fired_settings(settings, sensors):
            if self.unknown_effects:
                velocity[:, rows] = self._shot(pressure, mass, sensors, z, profile)
            else:
                velocity[:, rows] = self.fired(pressure, mass, profile) * np.exp(
                    self.velocity_spread * z[:, :1]
                )
        return velocity

    def leaving(self, settings: Sequence[Setting], sensors: SensorChain) -> Floats:
        """Probability (n,) that the bullet leaves the barrel; 1 where the velocity is given.

        Parameters:
            settings: n settings of the bench.
            sensors: The sensors' stated errors, of which the readings of the tank's pressure are
                freed.

        Raises:
            ValueError: As `velocities`.
        """
        probability = np.ones(len(settings))
        for rows, pressure, mass, profile in self._fired_settings(settings, sensors):
            if self.unknown_effects:
                probability[rows] = np.isfinite(
                    self._guns(pressure, mass, sensors, profile)[0]
                ).mean(axis=0)
            else:
                probability[rows] = self.fired(pressure, mass, profile) > 0
        return probability

    def updated(
        self,
        tank_pressure_pa: ArrayLike,
        bullet_mass_kg: ArrayLike,
        measured_m_s: ArrayLike,
        measured_u_m_s: ArrayLike | None = None,
    ) -> GunStage:
        """The stage after more measured shots, n of 1 or more.

        Parameters:
            tank_pressure_pa: Readings of the tank's pressure (n,), gauge.
            bullet_mass_kg: Masses of the bullets (n,).
            measured_m_s: Measured velocities (n,).
            measured_u_m_s: Standard uncertainties of the velocities (n,); by default None, which
                stands for 0.

        Raises:
            ValueError: As `VelocityShots`.
        """
        measured = np.atleast_1d(np.asarray(measured_m_s, dtype=np.float64))
        uncertainty = np.zeros(measured.size) if measured_u_m_s is None else measured_u_m_s
        given = (tank_pressure_pa, bullet_mass_kg, measured, uncertainty)
        new_shots = VelocityShots(
            *(np.atleast_1d(np.asarray(values, dtype=np.float64)) for values in given)
        )
        return replace(
            self,
            unknown_effects=True,
            shots=new_shots if self.shots is None else self.shots.beside(new_shots),
        )

    def extrapolation(self, settings: Sequence[Setting]) -> list[tuple[Extrapolation, ...]]:
        """For each setting, which of tank pressure and bullet mass lie beyond those of the shots
        that were learned from; empty within them, where the velocity is given, and where nothing
        was learned.

        Parameters:
            settings: n settings of the bench.
        """
        return [
            () if self.shots is None else _extrapolations(setting, self.shots)
            for setting in settings
        ]

    @property
    def sentence(self) -> str:
        """What the velocity rests on, in one plain line."""
        if not self.unknown_effects:
            return (
                f"The velocity is that of eq. 2.16 with the stated effects and a "
                f"spread of {self.velocity_spread:.1%}."
            )
        if self.shots is None:
            return (
                "The velocity rests on no measured shot: effects of the gun that are not stated "
                "are drawn from their likely ranges."
            )
        pressure, mass = self.shots.tank_pressure_pa / 1e5, self.shots.bullet_mass_kg
        fired = f"{_range(pressure, 'bar')} and {_range(mass, 'kg')}"
        return f"The velocity rests on {len(self.shots)} measured shots, {fired}."

    def fired(
        self, tank_pressure_pa: Floats, bullet_mass_kg: Floats, profile: ValveProfile | None = None
    ) -> Floats:
        """Velocities (n,) by the stated effects alone, m/s.

        Parameters:
            tank_pressure_pa: True pressures of the tank (n,), gauge.
            bullet_mass_kg: Masses of the bullets (n,).
            profile: The valve's position over time, of all shots; by default None, where none is
                stated.
        """
        from .shots import gun_velocity

        profiles = None if profile is None else [profile] * np.size(tank_pressure_pa)
        shots = gun_velocity(
            self.bench, tank_pressure_pa, bullet_mass_kg, self.effects, valve_profiles=profiles
        )
        return shots.velocity_m_s

    def _fired_settings(
        self, settings: Sequence[Setting], sensors: SensorChain
    ) -> Iterator[tuple[NDArray[np.intp], Floats, Floats, ValveProfile | None]]:
        """Those that the gun fires, some of one profile of the valve at once: rows, pressures (Pa,
        gauge) as the stated sensors have them true, masses (kg), and the profile."""
        of_profile: dict[ValveProfile | None, list[tuple[int, float, float]]] = {}
        for row, setting in enumerate(settings):
            if setting.tank_pressure_pa is not None:
                shot = (row, setting.tank_pressure_pa, setting.impactor_mass_kg)
                of_profile.setdefault(setting.valve_profile, []).append(shot)
        for profile, shots in of_profile.items():
            for first in range(0, len(shots), _CHUNK):
                rows, reading, mass = np.array(shots[first : first + _CHUNK], dtype=np.float64).T
                refuse_faster_than_gas(self.bench, reading, mass)
                yield rows.astype(np.intp), sensors.true_pressure_pa(reading), mass, profile

    def _guns(
        self,
        pressure_pa: Floats,
        mass_kg: Floats,
        sensors: SensorChain,
        profile: ValveProfile | None,
    ) -> tuple[Floats, Floats, Floats]:
        """(K, n) each: ln of velocities, minus infinity where the bullet stays; the scatter of one
        shot; the most."""
        guns = gun_prior(self.bench, self.effects, profile=profile)
        if self.shots is None:
            members = guns.velocities(pressure_pa, mass_kg, sensors)
            spread = self.velocity_spread * members.amplification
        else:
            posterior = _posterior(gun_prior(self.bench, self.effects), self.shots, sensors)
            members, spread = replace(posterior, guns=guns).velocities(
                pressure_pa, mass_kg, sensors
            )
        leaves = members.log > members.least
        most = members.most + self._excess()
        return np.where(leaves, np.minimum(members.log, most), -np.inf), spread, most

    def _excess(self) -> float:
        """By how much (ln) the fastest measured shot exceeds what the stated bench can give, and as
        much again as shots scatter: then its volumes are stated wrong, and the shots are believed.
        0 where none does."""
        if self.shots is None:
            return 0.0
        of_shots = (self.shots.tank_pressure_pa, self.shots.bullet_mass_kg, self.shots.measured_m_s)
        excess = float(excess_velocity(self.bench, *of_shots).max())
        return excess + _BEYOND_FASTEST if excess > 0 else 0.0

    def _shot(
        self,
        pressure_pa: Floats,
        mass_kg: Floats,
        sensors: SensorChain,
        z: Floats,
        profile: ValveProfile | None,
    ) -> Floats:
        """Velocities (d, n): the first normal is the rank of a gun among all, by how fast it is at
        these settings."""
        from scipy.special import ndtr

        mean, spread, most = self._guns(pressure_pa, mass_kg, sensors, profile)
        order = np.argsort(np.where(np.isfinite(mean), mean, -1e3).mean(axis=1), kind="stable")
        gun = order[np.minimum((ndtr(z[:, 0]) * order.size).astype(np.intp), order.size - 1)]
        return np.asarray(np.exp(np.minimum(mean[gun] + spread[gun] * z[:, 1:2], most[gun])))


def _range(values: Floats, unit: str) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.3g} {unit}" if low == high else f"{low:.3g} to {high:.3g} {unit}"


@lru_cache(maxsize=16)
def _posterior(prior: GunPrior, shots: VelocityShots, sensors: SensorChain) -> VelocityPosterior:
    return VelocityPosterior.of(prior, shots, sensors)


def _central(log_velocity: Floats) -> Floats:
    """Medians (n,) of the velocities that are finite, of logarithms (K, n); 0 where there are
    few."""
    leaving_guns = np.isfinite(log_velocity).sum(axis=0)
    # Those that stay are the slowest: the median of the others lies above them by half of these.
    ordered, last = np.sort(log_velocity, axis=0), len(log_velocity) - 1
    middle = last - (leaving_guns - 1) / 2
    ends = (
        np.clip(end.astype(np.intp), 0, last)[None] for end in (np.floor(middle), np.ceil(middle))
    )
    velocity = np.exp(np.stack([np.take_along_axis(ordered, end, axis=0)[0] for end in ends])).mean(
        axis=0
    )
    return np.asarray(np.where(leaving_guns < _LEAST_LEAVING * len(log_velocity), 0.0, velocity))


def _given_velocities(settings: Sequence[Setting]) -> Floats:
    return np.array([setting.impact_velocity_m_s or 0.0 for setting in settings], dtype=np.float64)


def _extrapolations(setting: Setting, shots: VelocityShots) -> tuple[Extrapolation, ...]:
    if setting.tank_pressure_pa is None:
        return ()
    compared = (
        ("tank_pressure_pa", setting.tank_pressure_pa, shots.tank_pressure_pa),
        ("bullet_mass_kg", setting.impactor_mass_kg, shots.bullet_mass_kg),
    )
    ranges = (
        (name, requested_value, float(measured_values.min()), float(measured_values.max()))
        for name, requested_value, measured_values in compared
    )
    return tuple(
        Extrapolation(*row)
        for row in ranges
        if not row[2] * (1 - _SAME) <= row[1] <= row[3] * (1 + _SAME)
    )
