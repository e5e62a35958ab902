"""What measured shots add to a gun's law: a correction of its velocity, smooth in tank pressure and bullet mass.

Glossary: y = log(measured over predicted velocity), p gauge tank pressure, m bullet mass. y is a polynomial in
log p and log m of degree 0, 1 or 2: the thesis's efficiency (eq. 2.18) is degree 0. The degree is the one that predicts
best the shots of a setting (p, m) that it was not fitted to.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .bench import checked

Floats = NDArray[np.float64]

#: A degree needs this many settings more than it has terms: with fewer, leaving one out says little.
_SPARE = 2
#: With fewer settings than this nothing says how the law errs between them: at least Table 5.1's error is assumed.
_FEW, _ASSUMED = 3, 0.046


@dataclass(frozen=True, eq=False)
class VelocityCalibration:
    """A fitted correction. `terms` (t,) are its coefficients, `scatter` the repeatability of one shot (log, standard
    deviation), `misfit` that of a whole setting which was left out; `shots` and `settings` say of how many."""

    degree: int
    terms: Floats
    centre: Floats  # (2,) of log p and log m
    information: Floats  # t x t, of the settings' means
    scatter: float
    misfit: float
    shots: int
    settings: int

    @classmethod
    def of(cls, tank_pressure_pa: Floats, bullet_mass_kg: Floats, measured_m_s: Floats, predicted_m_s: Floats) -> Self:
        """From measured shots (n,). Raises `ValueError` for fewer than two shots, or values that are not positive."""
        p, m = checked("tank_pressure_pa", tank_pressure_pa), checked("bullet_mass_kg", bullet_mass_kg)
        y = np.log(checked("measured_m_s", measured_m_s) / checked("predicted_m_s", predicted_m_s))
        if y.size < 2:
            raise ValueError(f"{y.size} measured shots: expected at least two to tell a correction from scatter")
        at, means, counts, scatter = _by_setting(np.stack([np.log(p), np.log(m)], axis=1), y)
        centre = at.mean(axis=0)
        fits = [_fit(degree, at - centre, means) for degree in _allowed(at - centre)]
        degree, terms, information, misfit = min(fits, key=lambda fit: fit[3])
        # what scatters within a setting is in the misfit of its mean already
        between = float(np.sqrt(max(misfit**2 - scatter**2 / float(np.mean(counts)), 0.0)))
        between = max(between, _ASSUMED) if len(at) < _FEW else between
        return cls(degree, terms, centre, information, scatter, between, int(y.size), len(at))

    def factor(self, tank_pressure_pa: Floats, bullet_mass_kg: Floats) -> Floats:
        """By which the predicted velocity is multiplied, (n,); for pressure 0, where nothing moves, 1."""
        return np.asarray(
            np.where(tank_pressure_pa > 0, np.exp(self._rows(tank_pressure_pa, bullet_mass_kg) @ self.terms), 1.0)
        )

    def spread(self, tank_pressure_pa: Floats, bullet_mass_kg: Floats) -> Floats:
        """Standard deviation (n,) of the logarithm of one shot's velocity; it grows away from the measured settings."""
        rows = self._rows(tank_pressure_pa, bullet_mass_kg)
        leverage = np.einsum("nt,nt->n", rows, np.linalg.solve(self.information, rows.T).T)
        return np.asarray(np.sqrt(self.scatter**2 + self.misfit**2 * (1 + leverage)))

    def _rows(self, tank_pressure_pa: Floats, bullet_mass_kg: Floats) -> Floats:
        pressure = np.where(np.asarray(tank_pressure_pa) > 0, tank_pressure_pa, np.exp(self.centre[0]))
        at = np.stack(np.broadcast_arrays(np.log(pressure), np.log(bullet_mass_kg)), axis=1)
        return _powers(self.degree, at - self.centre)


def _allowed(at: Floats) -> list[int]:
    """Degrees for settings (c, 2)."""
    return [0, *(degree for degree in (1, 2) if _told(_powers(degree, at)))]


def _told(rows: Floats) -> bool:
    """Whether settings tell all terms, whichever of them is left out: not with one mass, nor with one of its own."""
    settings, terms = rows.shape
    if settings < terms + _SPARE or np.linalg.matrix_rank(rows) < terms:
        return False
    leverage = (np.linalg.qr(rows).Q ** 2).sum(axis=1)
    return bool(leverage.max() < 1 - 1e-9)


def _powers(degree: int, at: Floats) -> Floats:
    """Monomials up to a degree, (n, t)."""
    x, z = at.T
    return np.stack([x**i * z ** (total - i) for total in range(degree + 1) for i in range(total + 1)], axis=1)


def _by_setting(at: Floats, y: Floats) -> tuple[Floats, Floats, Floats, float]:
    """Distinct settings (c, 2), means and counts (c,), and the pooled scatter within them."""
    distinct, which = np.unique(at.round(9), axis=0, return_inverse=True)
    counts = np.bincount(which.ravel()).astype(np.float64)
    means = np.bincount(which.ravel(), weights=y) / counts
    freedom = y.size - len(distinct)
    within = float(np.sum((y - means[which.ravel()]) ** 2))
    return distinct, means, counts, float(np.sqrt(within / freedom)) if freedom else 0.0


def _fit(degree: int, at: Floats, y: Floats) -> tuple[int, Floats, Floats, float]:
    """Degree, terms, information, and the root mean square error at settings left out (closed form: e / (1 - h))."""
    rows = _powers(degree, at)
    information = rows.T @ rows
    terms = np.asarray(np.linalg.solve(information, rows.T @ y), dtype=np.float64)
    hat = np.einsum("ct,ct->c", rows, np.linalg.solve(information, rows.T).T)
    left_out = (y - rows @ terms) / np.maximum(1 - hat, 1e-9)  # of one setting alone, 0
    return degree, terms, information, float(np.sqrt(np.mean(left_out**2)))
