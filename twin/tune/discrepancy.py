"""What measured shots teach: where the bench's spectra lie from the forward model's, as a Gaussian process.

residual(s, f) = measured - predicted level in dB of shot s at line f, mean 0, covariance the sum over `TERMS` of
sd^2 * (correlation of settings) x (correlation of lines): what all settings share, what one place of a plate shares,
what depends on the setting, and what one shot has for itself. Conditioning is exact (Rasmussen and Williams, Gaussian
Processes for Machine Learning, 2006, eq. 2.23-2.24), by Cholesky in float64; a kriging of code output as in Kennedy and
O'Hagan, J. R. Stat. Soc. B 63 (2001) 425.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..setting import Setting
from .kernels import Alike, Coordinates, EachShot, Everywhere, OfLines, OfSettings, SamePlace, level, smooth, white

Floats = NDArray[np.float64]

#: Added to the diagonal, as a share of its mean: the smallest that keeps 105 shots x 41 lines factorable.
JITTER = 1e-9


@dataclass(frozen=True)
class Term:
    """One part of a discrepancy and its standard deviation, dB."""

    name: str
    sd_db: float
    of_settings: OfSettings
    of_lines: OfLines

    def covariance(self, first: Coordinates, second: Coordinates, octaves: Floats) -> Floats:
        """(n f, m f), shots outside and lines inside."""
        return np.asarray(np.kron(self.sd_db**2 * self.of_settings(first, second), self.of_lines(octaves)), np.float64)


#: Before any shot: 3 dB over all settings, 2 dB more from setting to setting, 1 dB from shot to shot.
TERMS: tuple[Term, ...] = (
    Term("level of all", 2.0, Everywhere(), level),
    Term("colour of all", 1.5, Everywhere(), smooth),
    Term("line of all", 0.5, Everywhere(), white),
    Term("colour of the place", 1.2, SamePlace(), smooth),
    Term("line of the place", 1.0, SamePlace(), white),
    Term("level of the setting", 1.4, Alike(), level),
    Term("colour of the setting", 1.4, Alike(), smooth),
    Term("level of the shot", 0.7, EachShot(), level),
    Term("line of the shot", 0.7, EachShot(), white),
)
_OF_ALL_LEVEL, _OF_ALL_COLOUR = "level of all", "colour of all"


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """The process at lines `frequency_hz` (f,), before any shot."""

    frequency_hz: Floats
    terms: tuple[Term, ...] = TERMS

    @property
    def octaves(self) -> Floats:
        return np.asarray(np.log2(self.frequency_hz))

    def with_spread(self, draws_db: Floats) -> Discrepancy:
        """The prior with the forward model's own spread, from draws (count, n, f) in dB at settings of interest.

        Spread of a draw's mean level adds to the level that all settings share, what remains of the lines to the
        shared colour: so the first shot reduces it, and it counts once. Terms that were fitted to measured shots have
        it in them already: they take none.
        """
        apart = draws_db - draws_db.mean(axis=0)
        mean = apart.mean(axis=-1, keepdims=True)
        extra = {_OF_ALL_LEVEL: float(np.mean(mean**2)), _OF_ALL_COLOUR: float(np.mean((apart - mean) ** 2))}
        terms = tuple(replace(t, sd_db=float(np.sqrt(t.sd_db**2 + extra.get(t.name, 0.0)))) for t in self.terms)
        return replace(self, terms=terms)

    def shot_covariance_db2(self) -> Floats:
        """(f, f) of what one shot has for itself: what remains when all that shots share is learned."""
        parts = (t.sd_db**2 * t.of_lines(self.octaves) for t in self.terms if isinstance(t.of_settings, EachShot))
        return np.asarray(sum(parts, np.zeros((self.frequency_hz.size, self.frequency_hz.size))))

    def after(self, settings: Sequence[Setting], residual_db: Floats) -> Learned:
        """Conditioned on measured - predicted levels (n, f) of n shots at their settings; none is fine."""
        return Learned.of(self, Coordinates.of(settings) if len(settings) else None, residual_db)


@dataclass(frozen=True, eq=False)
class Learned:
    """A discrepancy after shots: what to add to a prediction, and how sure of it."""

    prior: Discrepancy
    shots: Coordinates | None
    weights: Floats = field(default_factory=lambda: np.empty(0))
    factor: Floats = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(cls, prior: Discrepancy, shots: Coordinates | None, residual_db: Floats) -> Learned:
        if shots is None:
            return cls(prior, None)
        expected = (len(shots), prior.frequency_hz.size)
        if residual_db.shape != expected or not np.all(np.isfinite(residual_db)):
            raise ValueError(f"residual_db has shape {residual_db.shape}: expected {expected}, all finite")
        from scipy.linalg import cho_solve, cholesky

        factor = cholesky(covariance(prior, shots), lower=True, overwrite_a=True, check_finite=False)
        weights = cho_solve((factor, True), residual_db.ravel(), check_finite=False).reshape(expected)
        return cls(prior, shots, weights, factor)

    def mean_db(self, settings: Sequence[Setting]) -> Floats:
        """(m, f): what to add to predictions at m settings."""
        if self.shots is None:
            return np.zeros((len(settings), self.prior.frequency_hz.size))
        at, octaves = Coordinates.of(settings), self.prior.octaves
        parts = (
            t.sd_db**2 * (t.of_settings(at, self.shots) @ self.weights) @ t.of_lines(octaves) for t in self.prior.terms
        )
        return np.asarray(sum(parts))

    def covariance_db2(self, setting: Setting) -> Floats:
        """(f, f) of a further shot at a setting, its own scatter included."""
        at, octaves = Coordinates.of([setting]), self.prior.octaves
        own = _summed(self.prior.terms, at, at, octaves)
        if self.shots is None:
            return np.asarray(own)
        from scipy.linalg import solve_triangular

        shared = _summed(self.prior.terms, self.shots, at, octaves)
        known = solve_triangular(self.factor, shared, lower=True, check_finite=False)
        return np.asarray(own - known.T @ known)


def covariance(prior: Discrepancy, shots: Coordinates) -> Floats:
    """Of all residuals of n shots, (n f, n f), with the jitter."""
    out = _summed(prior.terms, shots, shots, prior.octaves)
    out[np.diag_indices_from(out)] += JITTER * np.mean(np.diag(out))
    return out


def _summed(terms: Sequence[Term], first: Coordinates, second: Coordinates, octaves: Floats) -> Floats:
    """(n f, m f), one term at a time: 105 shots x 41 lines are 150 MB each."""
    out = np.zeros((len(first) * octaves.size, len(second) * octaves.size))
    for term in terms:
        out += term.covariance(first, second, octaves)
    return out
