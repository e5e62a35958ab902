"""What measured shots say of a gun: guns that it may be, moved to where the shots are, and what is
left of them.

Glossary: y = ln of measured velocity, x = ln of a member's velocity (`prior`), K members; p tank
pressure, m bullet mass; s a setting (p, m); delta what the effects leave of the gap, smooth in ln p
and ln m; S the settings of the shots. y = x(s) + a(s) (delta(s) + scatter of one shot), a being the
members' amplification: both are of the work, and where friction and leaks take nearly all of it a
little is a lot of velocity.

1. delta is a Gaussian process, its size and the scatter of a shot are on a grid with priors; each
   pair's evidence is that of Gaussian x with the members' mean and covariance (Kennedy and O'Hagan,
   J. R. Stat. Soc. B 63 (2001) 425).
2. Members are drawn again by their likelihood to a power, as large as leaves a quarter of them in
   play (tempering: Del Moral, Doucet and Jasra, J. R. Stat. Soc. B 68 (2006) 411).
3. What is left of the likelihood moves them, linearly in the members' covariance between settings
   (ensemble smoother: van Leeuwen and Evensen, Mon. Weather Rev. 124 (1996) 2898).
4. delta of a member is that of its own residuals.

With no shots nothing is moved; one shot is enough; where no shots are near, the members and delta
spread again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..sensors.chain import SensorChain
from .bench import checked
from .prior import GunPrior, MemberVelocities

# Standard deviations of delta and of the scatter of one shot, each with a log-normal prior: median,
# width.
_GAPS, _GAP_PRIOR = np.geomspace(0.01, 0.32, 6), (0.06, 0.8)
_SCATTERS, _SCATTER_PRIOR = np.geomspace(0.004, 0.12, 8), (0.02, 0.8)
# Delta changes over a factor of this in pressure or mass.
_SMOOTH = 3.0
# Shots whose pressures and masses are as near (ln) count as of one setting.
_SAME = 0.01
# Members whose ln v is as near to a measured one shoot alike.
_ALIKE = 0.15
# Of the members, that stay in play when they are drawn again.
_IN_PLAY = 0.25
_Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class VelocityShots:
    """Measured shots (n,): readings of the tank's pressure (gauge), bullets, velocities and their
    standard uncertainty.

    Raises `ValueError` for values that are not positive (uncertainties: negative), for no shot, and
    for other shapes.
    """

    tank_pressure_pa: Floats
    bullet_mass_kg: Floats
    measured_m_s: Floats
    measured_u_m_s: Floats

    def __post_init__(self) -> None:
        for name in ("tank_pressure_pa", "bullet_mass_kg", "measured_m_s", "measured_u_m_s"):
            values = checked(name, getattr(self, name), zero_allowed=name == "measured_u_m_s")
            if values.ndim != 1 or values.size != len(self) or not values.size:
                raise ValueError(
                    f"{name} has shape {values.shape}: "
                    f"expected ({len(self) or 'n'},), one for each shot"
                )
            object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return int(np.size(self.measured_m_s))

    def beside(self, other: Self) -> Self:
        """These shots and others.

        Parameters:
            other: The shots that are put after these.
        """
        return type(self)(
            *(np.concatenate([getattr(self, name), getattr(other, name)]) for name in vars(self))
        )


@dataclass(frozen=True, eq=False)
class _Settings:
    """c settings: true pressures by the stated sensors, masses, means of y, shots, variance by what
    is stated of the measurement, amplification; and within settings the sum of squares of y over it
    and its degrees of freedom.

    What is stated of a velocity is an error that shots of a setting have in common: their bullet's
    length (eq. 5.2).
    """

    pressure_pa: Floats
    mass_kg: Floats
    y: Floats
    shots: Floats
    stated: Floats
    amplified: Floats
    within: float
    freedom: int

    @classmethod
    def of(cls, shots: VelocityShots, guns: GunPrior, sensors: SensorChain) -> tuple[Self, Floats]:
        """And x of the members (K, c) there."""
        pressure = np.maximum(sensors.true_pressure_pa(shots.tank_pressure_pa), 1.0)
        y = np.log(sensors.true_velocity_m_s(shots.measured_m_s))
        at = np.stack([np.log(pressure), np.log(shots.bullet_mass_kg)], axis=1)
        which = np.unique((at / _SAME).round(), axis=0, return_inverse=True)[1].ravel()
        counts = np.bincount(which).astype(np.float64)

        def mean(values: Floats) -> Floats:
            return np.asarray(np.bincount(which, weights=values) / counts)

        means = mean(y)
        stated = mean((shots.measured_u_m_s / shots.measured_m_s) ** 2)
        pressure, mass = np.exp(mean(at[:, 0])), np.exp(mean(at[:, 1]))
        members = guns.velocities(pressure, mass, sensors)
        alike = np.exp(-(((members.log - means) / _ALIKE) ** 2) / 2) + 1e-9
        amplified = np.asarray((alike * members.amplification).sum(axis=0) / alike.sum(axis=0))
        within = float(np.sum(((y - means[which]) / amplified[which]) ** 2))
        freedom = int(y.size - counts.size)
        return cls(pressure, mass, means, counts, stated, amplified, within, freedom), members.log


@dataclass(frozen=True, eq=False)
class VelocityPosterior:
    """K guns that agree with measured shots. `velocities` says how fast they are, and how well that
    is known."""

    guns: GunPrior
    rows: _Rows  # (K,) of the prior's members, some more than once
    settings: _Settings
    _moves: Floats  # (K, K): by which a member moves for the members' anomalies at a setting
    _gaps: Floats  # (c, K): weights of the kernel at the shots' settings
    _inverses: list[
        tuple[_Rows, float, float, Floats]
    ]  # members of a pair of sizes, the pair, inverse of the noise

    @classmethod
    def of(cls, guns: GunPrior, shots: VelocityShots, sensors: SensorChain) -> Self:
        """The guns that agree with the shots.

        Parameters:
            guns: K guns that the bench may be, before any shot.
            shots: Measured shots of the bench.
            sensors: The sensors' stated errors, of which the shots' readings are freed.
        """
        (settings, x), rng = _Settings.of(shots, guns, sensors), np.random.default_rng(0)
        kernel, count = _kernel(settings, settings.pressure_pa, settings.mass_kg), len(guns)
        pairs, weights = _pairs(settings, x, kernel)
        middle = np.sqrt(weights @ pairs**2).tolist()
        power, rows = _drawn_again(settings, x, _noise(settings, kernel, *middle), rng)
        x = x[rows]
        anomalies = x - x.mean(axis=0)
        share = anomalies.T @ anomalies / (count - 1)
        of_pair = _systematic(weights, count, rng)[rng.permutation(count)]
        moves, gaps = np.zeros((count, count)), np.zeros((settings.y.size, count))
        inverses: list[tuple[_Rows, float, float, Floats]] = []
        for number in np.unique(of_pair):
            members: _Rows = np.flatnonzero(of_pair == number)
            gap, scatter = pairs[number].tolist()
            noise = _noise(settings, kernel, gap, scatter)
            misfit = settings.y - x[members]
            if power < 1:
                noise_left = noise / (1 - power)
                luck = rng.standard_normal(misfit.shape) @ np.linalg.cholesky(noise_left).T
                weight = np.linalg.solve(share + noise_left, (misfit + luck).T) / (count - 1)
                moves[:, members] = anomalies @ weight
                misfit = misfit - (anomalies @ weight).T @ anomalies
            inverse: Floats = np.asarray(np.linalg.inv(noise), dtype=np.float64)
            inverse *= settings.amplified[:, None] * settings.amplified
            gaps[:, members] = gap**2 * inverse @ (misfit / settings.amplified).T
            inverses.append((members, gap, scatter, inverse))
        return cls(guns, rows, settings, moves, gaps, inverses)

    def velocities(
        self, pressure_pa: Floats, mass_kg: Floats, sensors: SensorChain
    ) -> tuple[MemberVelocities, Floats]:
        """How fast the guns are at n settings, moved to where the shots are.

        Parameters:
            pressure_pa: True gauge pressures of the tank (n,).
            mass_kg: Masses of the bullets (n,).
            sensors: The sensors' stated errors.

        Returns:
            As `GunPrior.velocities`, and standard deviations (K, n) of the logarithm of one shot.
        """
        members = self.guns.velocities(pressure_pa, mass_kg, sensors).take(self.rows)
        x = members.log
        kernel = _kernel(self.settings, pressure_pa, mass_kg)
        gaps = members.amplification * (kernel @ self._gaps).T
        moved = np.asarray(x + self._moves.T @ (x - x.mean(axis=0)) + gaps)
        alone = _alone(self.settings, pressure_pa, mass_kg)
        variance = np.empty_like(x)
        for rows, gap, scatter, inverse in self._inverses:
            explained_variance = gap**2 * np.sum(kernel @ inverse * kernel, axis=1)
            variance[rows] = gap**2 * np.maximum(alone - explained_variance, 0.0) + scatter**2
        # Far below the shots the gaps are a large factor, and of a bullet that stays no factor
        # makes one that leaves.
        log = np.where(x > members.least, moved, np.minimum(moved, x))
        return replace(members, log=log), np.asarray(members.amplification * np.sqrt(variance))


def _shot_coordinates(settings: _Settings, pressure_pa: Floats, mass_kg: Floats) -> Floats:
    """(n, 2), about the shots' centre."""
    centre = np.log(settings.pressure_pa).mean(), np.log(settings.mass_kg).mean()
    at = np.log(np.maximum(pressure_pa, 1.0)) - centre[0], np.log(mass_kg) - centre[1]
    return np.asarray(np.stack(np.broadcast_arrays(*at), axis=1) / np.log(_SMOOTH))


def _kernel(settings: _Settings, pressure_pa: Floats, mass_kg: Floats) -> Floats:
    """Covariance (n, c) of delta of unit size: a constant, slopes and curvature that grow outside,
    and what changes on the way."""
    a = _shot_coordinates(settings, pressure_pa, mass_kg)
    b = _shot_coordinates(settings, settings.pressure_pa, settings.mass_kg)
    product = a @ b.T
    apart = ((a[:, None] - b[None]) ** 2).sum(axis=2)
    return np.asarray(0.5 + product / 4 + product**2 / 16 + np.exp(-apart / 2) / 2)


def _alone(settings: _Settings, pressure_pa: Floats, mass_kg: Floats) -> Floats:
    """Variance (n,) of the same."""
    square = (_shot_coordinates(settings, pressure_pa, mass_kg) ** 2).sum(axis=1)
    return np.asarray(1 + square / 4 + square**2 / 16)


def _noise(settings: _Settings, kernel: Floats, gap: float, scatter: float) -> Floats:
    """Covariance (c, c) of the means of y about a member's x."""
    of_work = gap**2 * kernel + np.diag(scatter**2 / settings.shots)
    return np.asarray(
        of_work * settings.amplified[:, None] * settings.amplified
        + np.diag(settings.stated + 1e-10)
    )


def _pairs(settings: _Settings, x: Floats, kernel: Floats) -> tuple[Floats, Floats]:
    """Sizes of delta and scatter (g, 2), and their posterior probabilities (g,)."""
    pairs = np.stack(np.meshgrid(_GAPS, _SCATTERS, indexing="ij"), axis=-1).reshape(-1, 2)
    share, misfit = np.cov(x.T).reshape(settings.y.size, -1), settings.y - x.mean(axis=0)
    evidence = np.empty(len(pairs))
    for i, (gap, scatter) in enumerate(pairs):
        prior = sum(
            -((np.log(value / middle) / width) ** 2) / 2
            for value, (middle, width) in ((gap, _GAP_PRIOR), (scatter, _SCATTER_PRIOR))
        )
        repeated = -settings.freedom * np.log(scatter) - settings.within / scatter**2 / 2
        evidence[i] = (
            prior
            + repeated
            + _log_density(misfit[None], share + _noise(settings, kernel, gap, scatter))[0]
        )
    weights = np.exp(evidence - evidence.max())
    return pairs, weights / weights.sum()


def _log_density(misfit: Floats, covariance: Floats) -> Floats:
    """Of Gaussian numbers (k, c), but for a constant."""
    root = np.linalg.cholesky(covariance)
    return np.asarray(
        -(np.linalg.solve(root, misfit.T) ** 2).sum(axis=0) / 2 - np.log(np.diag(root)).sum()
    )


def _drawn_again(
    settings: _Settings, x: Floats, noise: Floats, rng: np.random.Generator
) -> tuple[float, _Rows]:
    """The power of the likelihood by which members are drawn again, and the rows drawn (K,)."""
    density = _log_density(settings.y - x, noise)
    density -= density.max()

    def weights(power: float) -> Floats:
        raw = np.exp(power * density)
        return np.asarray(raw / raw.sum())

    low, high = 0.0, 1.0
    if 1 / np.sum(weights(high) ** 2) < _IN_PLAY * len(x):
        for _ in range(40):
            middle = (low + high) / 2
            few = 1 / np.sum(weights(middle) ** 2) < _IN_PLAY * len(x)
            low, high = (low, middle) if few else (middle, high)
        return low, _systematic(weights(low), len(x), rng)
    return 1.0, _systematic(weights(1.0), len(x), rng)


def _systematic(weights: Floats, count: int, rng: np.random.Generator) -> _Rows:
    """Rows (count,) drawn with weights, each as often as its weight says, or once more."""
    at = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), at), len(weights) - 1)
