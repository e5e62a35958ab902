"""Guns that a bench may be, before its shots are measured: effects at random, within their
documented likely ranges.

A member is a gun whose effects, where nobody has stated them, act with their prior odds and have
parameters from their likely ranges: evenly by logarithm where a range begins above 0, else evenly.
Transducer and velocity measurement have errors as on their data sheets. The members are a Latin
hypercube (McKay, Beckman and Conover, Technometrics 21 (1979) 239). Each obeys the balances of
`shots.gun_velocity`, so that none makes energy.

Velocities are tabulated as shares e of the most work that the gas can do, over tank pressure and
bullet mass, and interpolated; nodes of the table are fired when they are first needed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...signals.valve_profile import ValveProfile
from ..effects import Parameter, catalogue
from ..prediction import stratified_normals
from ..sensors.chain import SensorChain
from .bench import GunBench
from .nominal import barrel_work_j, escape_speed_m_s
from .shot import ROOM_K, GunEffect
from .shots import gun_velocity

#: Members of a prior.
MEMBERS = 256
# The table: 1 kPa to 170 MPa in steps of 1.4, 1 g to 1 t in steps of 2.
_PRESSURES: Floats = np.asarray(1e3 * 1.4 ** np.arange(37))
_MASSES: Floats = np.asarray(1e-3 * 2.0 ** np.arange(21))
# Steps of the integration may err by so many times more; a bullet that creeps needs the finer ones.
_COARSER = (100.0, 1.0)
# A bullet that has less than this share of the work that the gas can do stays in the barrel.
_STAYS = 1e-4
_MOST_AMPLIFIED = 6.0
# A range that begins above 0 and is at least so wide is even by its logarithm.
_WIDE = 1.5
# An efficiency that is stated was read at one of these pressures (Pa) and masses (kg), nobody says
# at which.
_MOST_GAIN = 1.5  # by which a gun may be faster than its effects say for it
_EFFICIENCY_AT = ((0.5e5, 0.2), (0.5e5, 1.0), (4e5, 0.2), (4e5, 1.0))


@dataclass(frozen=True, eq=False)
class MemberVelocities:
    """Of K guns at n settings, all (K, n), velocities by their logarithm: `least`, below which a
    bullet counts as one that stays in the barrel, and `most`, what gas of the room's temperature
    can give (`barrel_work_j`) against the atmosphere where there is one, below its escape speed.

    `amplification`, 2 d ln v / d ln p, is 1 where nothing is lost, and large where losses take
    nearly all the work, so that a little more or less of them is a lot of velocity.
    """

    log: Floats
    least: Floats
    most: Floats
    amplification: Floats

    def take(self, rows: NDArray[np.intp]) -> Self:
        """Some of the guns.

        Parameters:
            rows: Their row numbers, which may repeat.
        """
        return type(self)(
            self.log[rows], self.least[rows], self.most[rows], self.amplification[rows]
        )


@dataclass(frozen=True, eq=False)
class GunPrior:
    """K guns: `effects`, whose parameters are numbers or (K,), and errors of sensors, that of the
    velocity as its log.

    `scale` (K,) is the logarithm of a factor on velocities, by which a gun has the efficiency that
    its bench states. A `profile` of the valve takes the place of the opening times that are drawn.
    """

    bench: GunBench
    effects: tuple[GunEffect, ...]
    pressure_offset_pa: Floats
    log_pressure_gain: Floats
    log_velocity_gain: Floats
    scale: Floats
    profile: ValveProfile | None  # of the valve of every shot; None where none is stated
    _shares: Floats = field(repr=False)  # (pressures, masses, K); NaN where it was not fired

    def __len__(self) -> int:
        return len(self.scale)

    @property
    def opposing_pressure_pa(self) -> Floats:
        """Of the atmosphere ahead of the bullet, (K,); 0 for a barrel that is pumped out."""
        ahead = next((effect for effect in self.effects if effect.id == "gun.back_pressure"), None)
        return np.zeros(len(self)) + (0.0 if ahead is None else ahead.atmosphere_pa)  # type: ignore[attr-defined]

    def velocities(
        self, pressure_pa: Floats, bullet_mass_kg: Floats, sensors: SensorChain
    ) -> MemberVelocities:
        """How fast each of the K guns is at n settings.

        Parameters:
            pressure_pa: Gauge pressures of the tank (n,), freed of the sensors' stated errors.
            bullet_mass_kg: Masses of the bullets (n,).
            sensors: The sensors' stated errors; those that it states are not drawn for the guns.
        """
        stated = {effect.id for effect in sensors.effects}
        offset, pressure_gain, velocity_gain = (
            0.0 if f"sensor.{name}" in stated else error[:, None]
            for name, error in (
                ("pressure_offset", self.pressure_offset_pa),
                ("pressure_gain", self.log_pressure_gain),
                ("velocity_gain", self.log_velocity_gain),
            )
        )
        shape = np.zeros((len(self), 1))
        tank = np.asarray(np.maximum((pressure_pa - offset) * np.exp(-pressure_gain), 0.0) + shape)
        share, slope = self._interpolated(tank, bullet_mass_kg)
        lossless, ahead = barrel_work_j(self.bench, tank, 0.0), self.opposing_pressure_pa[:, None]
        most = barrel_work_j(self.bench, tank, ahead) if ahead.any() else lossless
        # An empty tank has a work so small that no sum brings it back.
        works = np.stack([lossless * np.maximum(share, _STAYS), lossless * 4 * _STAYS, most])
        works = np.maximum(works, np.array([1e-18, 4e-18, 1e-18])[:, None, None])
        log, least, highest = np.log(2 * works / bullet_mass_kg) / 2
        escape = np.log(escape_speed_m_s(self.bench.heat_capacity_ratio, ROOM_K))
        return MemberVelocities(
            log=log + self.scale[:, None] + velocity_gain,
            least=least,
            most=np.minimum(highest, escape),
            amplification=np.clip(1 + slope / np.maximum(share, _STAYS), 1.0, _MOST_AMPLIFIED),
        )

    def take(self, rows: NDArray[np.intp]) -> Self:
        """Some of the guns.

        Parameters:
            rows: Their row numbers, which may repeat.
        """
        return replace(
            self,
            effects=tuple(effect.take(rows) for effect in self.effects),
            pressure_offset_pa=self.pressure_offset_pa[rows],
            log_pressure_gain=self.log_pressure_gain[rows],
            log_velocity_gain=self.log_velocity_gain[rows],
            scale=self.scale[rows],
            _shares=self._shares[:, :, rows],
        )

    def _interpolated(self, tank_pa: Floats, bullet_mass_kg: Floats) -> tuple[Floats, Floats]:
        """Shares (K, n), linear in ln p and ln m between nodes, and their slopes by ln p; at the
        table's ends the last node's."""
        p, at_p = _node_below(tank_pa, _PRESSURES)
        m, at_m = _node_below(np.asarray(bullet_mass_kg), _MASSES)
        self._fire(p, np.broadcast_to(m, p.shape))
        masses, members = self._shares.shape[1:]
        node = (p * masses + m) * members + np.arange(members)[:, None]
        flat = self._shares.reshape(-1)
        low, high = (
            (1 - at_m) * flat[i] + at_m * flat[i + members] for i in (node, node + masses * members)
        )
        slopes = (high - low) / np.log(_PRESSURES[1] / _PRESSURES[0])
        return np.asarray((1 - at_p) * low + at_p * high), np.asarray(slopes)

    def _fire(self, p: NDArray[np.intp], m: NDArray[np.intp]) -> None:
        """The nodes that are needed and not there."""
        needed = np.zeros(self._shares.shape[:2], dtype=bool)
        for i in (p, p + 1):
            for j in (m, m + 1):
                needed[i, j] = True
        # One by one, so that a node is the same whichever others are needed with it.
        for node in np.argwhere(needed & np.isnan(self._shares[:, :, 0])):
            pressure, mass = float(_PRESSURES[node[0]]), float(_MASSES[node[1]])
            self._shares[node[0], node[1]] = _fired_shares(self, pressure, mass)


def _node_below(values: Floats, nodes: Floats) -> tuple[NDArray[np.intp], Floats]:
    """The node below and the share of the way to the next, by logarithms."""
    at = np.log(np.maximum(values, nodes[0]) / nodes[0]) / np.log(nodes[1] / nodes[0])
    below = np.minimum(at.astype(np.intp), nodes.size - 2)
    return below, np.minimum(at - below, 1.0)


def _fired_shares(guns: GunPrior, pressure_pa: float, mass_kg: float) -> Floats:
    """(K,) at one node."""
    ideal, mass = replace(guns.bench, efficiency=1.0), np.full(len(guns), mass_kg)
    profiles = None if guns.profile is None else [guns.profile] * len(guns)
    try:
        shots = gun_velocity(
            ideal, pressure_pa, mass, guns.effects, _COARSER[0], valve_profiles=profiles
        )
    except RuntimeError:
        shots = gun_velocity(
            ideal, pressure_pa, mass, guns.effects, _COARSER[1], valve_profiles=profiles
        )
    return np.asarray(
        mass * shots.velocity_m_s**2 / 2 / barrel_work_j(guns.bench, pressure_pa, 0.0)
    )


@lru_cache(maxsize=8)
def gun_prior(
    bench: GunBench,
    stated: tuple[GunEffect, ...],
    members: int = MEMBERS,
    seed: int = 0,
    profile: ValveProfile | None = None,
) -> GunPrior:
    """The guns that a bench with stated effects may be, always the same, also with another profile
    of the valve.

    Parameters:
        bench: The gun as it is stated.
        stated: Effects whose parameters are known; all others of the catalogue are drawn.
        members: K, the number of guns; 256 by default.
        seed: Seed of the random numbers; 0 by default.
        profile: The valve's position over time, in every shot; by default None, where none is
            stated.
    """
    if profile is not None:
        guns = gun_prior(bench, stated, members, seed)
        return replace(guns, profile=profile, _shares=np.full(guns._shares.shape, np.nan))
    stated_ids = {effect.id for effect in stated}
    drawn = [
        kind
        for kind in catalogue().values()
        if issubclass(kind, GunEffect) and kind.id not in stated_ids
    ]
    columns = sum(2 + len(kind.parameters()) for kind in drawn) + 3
    z = iter(stratified_normals(members, columns, np.random.default_rng(seed)).T)
    effects = (*stated, *(_drawn_effect(kind, z) for kind in drawn))
    offset, pressure_gain, velocity_gain = (
        _typical(identity) * next(z)
        for identity in ("pressure_offset", "pressure_gain", "velocity_gain")
    )
    shares = np.full((_PRESSURES.size, _MASSES.size, members), np.nan)
    unscaled = GunPrior(
        bench, effects, offset, pressure_gain, velocity_gain, np.zeros(members), None, shares
    )
    return (
        unscaled
        if bench.efficiency == 1
        else _with_efficiency(unscaled, stated, np.random.default_rng(seed))
    )


def _drawn_effect(kind: type[GunEffect], z: Any) -> GunEffect:
    """With its prior odds it acts, by one of its laws (`regimes`), each as likely as any other."""
    from scipy.special import ndtr

    acts = ndtr(next(z)) < kind.prior_odds / (1 + kind.prior_odds)
    laws = kind.regimes or (
        tuple(item.name for item in kind.parameters() if item.likely is not None),
    )
    law = np.minimum((ndtr(next(z)) * len(laws)).astype(int), len(laws) - 1)
    values = {}
    for item in kind.parameters():
        of_law = np.array([item.name in names for names in laws])[law]
        values[item.name] = np.where(acts & of_law, _likely(item, ndtr(next(z))), item.off)
    return kind(**values)


def _likely(item: Parameter, u: Floats) -> Floats:
    """Values of a parameter's likely range by their rank u in (0, 1)."""
    if item.likely is None:
        return np.full(u.shape, item.default)
    low, high = item.likely
    if low > 0 and high / low > _WIDE:
        return np.asarray(low * (high / low) ** u)
    return np.asarray(low + (high - low) * u)


def _typical(name: str) -> float:
    """Standard deviation of a sensor's error, by data sheets."""
    (item,) = (
        error for error in catalogue()[f"sensor.{name}"].parameters() if error.typical is not None
    )
    assert item.typical is not None
    return item.typical


def _with_efficiency(
    guns: GunPrior, stated: tuple[GunEffect, ...], rng: np.random.Generator
) -> GunPrior:
    """Guns that have the efficiency that their bench states: measured over predicted velocity, at a
    setting that who stated it did not say, so that a gun has it at a setting of its own. Guns that
    lose much more there are not the bench; others take their place."""
    at_pa, at_kg = np.array(_EFFICIENCY_AT).T
    predicted = gun_velocity(guns.bench, at_pa, at_kg, stated).velocity_m_s
    with np.errstate(divide="ignore"):
        scales = np.log(predicted) - guns.velocities(at_pa, at_kg, SensorChain()).log
    fits = np.isfinite(scales) & (scales < np.log(_MOST_GAIN))
    like = np.flatnonzero(fits.any(axis=1))
    if not like.size:
        return guns
    members = np.where(fits.any(axis=1), np.arange(len(guns)), rng.choice(like, len(guns)))
    at = np.where(fits[members], rng.random(fits.shape), -1.0).argmax(axis=1)
    return replace(guns.take(members), scale=scales[members, at])
