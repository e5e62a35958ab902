"""What measured shots teach: where the bench's spectra lie from the forward model's, as a Gaussian
process.

residual(s, f) = measured - predicted level in dB of shot s at line f, mean 0, covariance the sum
over `TERMS` of sd^2 * (correlation of settings) x (correlation of lines): what all settings share,
what one place of a plate shares, what depends on the setting, and what one shot has for itself.
Conditioning is exact (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, eq.
2.23-2.24), by Cholesky in float64; a kriging of code output as in Kennedy and O'Hagan, J. R. Stat.
Soc. B 63 (2001) 425. Correlations of lines commute, so that their eigenvectors take f lines to f
patterns that are independent of each other: n shots cost f matrices of n x n in place of one of (n
f) x (n f).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...array_types import Floats
from ..setting import Setting
from .kernels import (
    Coordinates,
    EachShot,
    Everywhere,
    OfLines,
    OfSettings,
    SamePlace,
    SettingKernel,
    level,
    smooth,
    white,
)

#: Added to the diagonal, as a share of its mean: the smallest that keeps 105 shots x 41 lines
#: factorable.
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
        return np.asarray(
            np.kron(self.sd_db**2 * self.of_settings(first, second), self.of_lines(octaves)),
            np.float64,
        )


#: Before any shot: 3 dB over all settings, 2 dB more from setting to setting, 1 dB from shot to
#: shot.
TERMS: tuple[Term, ...] = (
    Term("level of all", 2.0, Everywhere(), level),
    Term("colour of all", 1.5, Everywhere(), smooth),
    Term("line of all", 0.5, Everywhere(), white),
    Term("colour of the place", 1.2, SamePlace, smooth),
    Term("line of the place", 1.0, SamePlace, white),
    Term("level of the setting", 1.4, SettingKernel(), level),
    Term("colour of the setting", 1.4, SettingKernel(), smooth),
    Term("level of the shot", 0.7, EachShot(), level),
    Term("line of the shot", 0.7, EachShot(), white),
)
_OF_ALL_LEVEL, _OF_ALL_COLOUR = "level of all", "colour of all"


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """The process at lines `frequency_hz` (f,), before any shot. `scale` (f,) multiplies the
    deviations; None: 1."""

    frequency_hz: Floats
    terms: tuple[Term, ...] = TERMS
    scale: Floats | None = None

    @cached_property
    def octaves(self) -> Floats:
        return np.asarray(np.log2(self.frequency_hz))

    @cached_property
    def scales(self) -> Floats:
        """(f,)."""
        return np.ones(self.frequency_hz.size) if self.scale is None else self.scale

    @cached_property
    def patterns(self) -> Floats:
        """Eigenvectors of all correlations of lines, (f, f): lines by patterns."""
        _, vectors = np.linalg.eigh(
            smooth(self.octaves) + 2 * self.frequency_hz.size * level(self.octaves)
        )
        return np.asarray(vectors)

    @cached_property
    def variances(self) -> Floats:
        """Of each term in each pattern (t, f), dB2: squares of deviations times eigenvalues."""
        of_lines = {term.of_lines: term.of_lines(self.octaves) for term in self.terms}
        spectra = {
            key: np.einsum("ik,ij,jk->k", self.patterns, m, self.patterns)
            for key, m in of_lines.items()
        }
        return np.array(
            [term.sd_db**2 * np.maximum(spectra[term.of_lines], 0.0) for term in self.terms]
        )

    def with_spread(self, draws_db: Floats) -> Discrepancy:
        """The prior with the forward model's own spread, from draws (count, n, f) in dB at settings
        of interest.

        Spread of a draw's mean level adds to the level that all settings share, what remains of the
        lines to the shared colour: so the first shot reduces it, and it counts once. Terms that
        were fitted to measured shots have it in them already: they take none.
        """
        apart = draws_db - draws_db.mean(axis=0)
        mean = apart.mean(axis=-1, keepdims=True)
        extra = {
            _OF_ALL_LEVEL: float(np.mean(mean**2)),
            _OF_ALL_COLOUR: float(np.mean((apart - mean) ** 2)),
        }
        terms = tuple(
            replace(t, sd_db=float(np.sqrt(t.sd_db**2 + extra.get(t.name, 0.0))))
            for t in self.terms
        )
        return replace(self, terms=terms)

    def of_shots_alone(self) -> Discrepancy:
        """Without what shots share: of a model that has learned that by itself."""
        own = (
            t if isinstance(t.of_settings, EachShot) else replace(t, sd_db=0.0) for t in self.terms
        )
        return replace(self, terms=tuple(own))

    def shot_covariance_db2(self) -> Floats:
        """(f, f) of what one shot has for itself: what remains when all that shots share is
        learned."""
        parts = (
            t.sd_db**2 * t.of_lines(self.octaves)
            for t in self.terms
            if isinstance(t.of_settings, EachShot)
        )
        shared = sum(parts, np.zeros((self.frequency_hz.size, self.frequency_hz.size)))
        return np.asarray(self.scales[:, None] * shared * self.scales)

    def after(self, settings: Sequence[Setting], residual_db: Floats) -> ShotCorrection:
        """Conditioned on measured - predicted levels (n, f) of n shots at their settings; none is
        fine."""
        return ShotCorrection.of(
            self, Coordinates.of(settings) if len(settings) else None, residual_db
        )

    def in_patterns(self, residual_db: Floats) -> Floats:
        """Residuals (n, f) of lines as those of patterns."""
        return np.asarray((residual_db / self.scales) @ self.patterns)


@dataclass(frozen=True, eq=False)
class ShotCorrection:
    """A discrepancy after shots: what to add to a prediction, and how sure of it.

    `weights` (n, f) and `precision` (f, n, n), inverse covariances of the shots, go by patterns.
    """

    prior: Discrepancy
    shots: Coordinates | None
    weights: Floats = field(default_factory=lambda: np.empty((0, 0)))
    precision: Floats = field(default_factory=lambda: np.empty((0, 0, 0)))

    @classmethod
    def of(
        cls, prior: Discrepancy, shots: Coordinates | None, residual_db: Floats
    ) -> ShotCorrection:
        if shots is None:
            return cls(prior, None)
        expected = (len(shots), prior.frequency_hz.size)
        if residual_db.shape != expected or not np.all(np.isfinite(residual_db)):
            raise ValueError(
                f"residual_db has shape {residual_db.shape}: expected {expected}, all finite"
            )
        alike = np.array([term.of_settings(shots, shots) for term in prior.terms])
        joint = np.tensordot(prior.variances.T, alike, axes=1)
        precision, _ = inverted(with_jitter(joint, prior.variances))
        weights = np.einsum("fnm,mf->nf", precision, prior.in_patterns(residual_db))
        return cls(prior, shots, weights, precision)

    def mean_db(self, settings: Sequence[Setting]) -> Floats:
        """(m, f): what to add to predictions at m settings."""
        prior = self.prior
        if self.shots is None:
            return np.zeros((len(settings), prior.frequency_hz.size))
        at = Coordinates.of(settings)
        parts = (
            (term.of_settings(at, self.shots) @ self.weights) * variance
            for term, variance in zip(prior.terms, prior.variances, strict=True)
        )
        return np.asarray(sum(parts) @ prior.patterns.T * prior.scales)

    def variances(self, settings: Sequence[Setting]) -> Floats:
        """Of each pattern of a further shot at m settings, (m, f), its own scatter included."""
        own = np.tile(self.prior.variances.sum(axis=0), (len(settings), 1))
        if self.shots is None:
            return own
        at = Coordinates.of(settings)
        alike = np.array([term.of_settings(at, self.shots) for term in self.prior.terms])
        shared = np.einsum("tmn,tf->fmn", alike, self.prior.variances)
        explained = np.einsum("fmn,fmn->mf", shared @ self.precision, shared)
        return np.asarray(np.maximum(own - explained, 0.0))

    def left_out(self) -> tuple[Floats, Floats]:
        """Errors and their stated deviations (n, f), dB, where every shot is predicted from all
        others.

        In closed form: of the diagonal of a precision, the inverse is the variance of the error,
        and times the weight the error itself (Rasmussen and Williams, eq. 5.12).
        """
        variances = 1 / np.einsum("fnn->nf", self.precision)
        errors = (self.weights * variances) @ self.prior.patterns.T * self.prior.scales
        return errors, np.sqrt(variances @ (self.prior.patterns**2).T) * self.prior.scales

    def covariance_db2(self, setting: Setting) -> Floats:
        """(f, f) of a further shot at a setting, its own scatter included."""
        root = (
            self.prior.scales[:, None] * self.prior.patterns * np.sqrt(self.variances([setting])[0])
        )
        return np.asarray(root @ root.T)

    def draws_db(self, settings: Sequence[Setting], normals: Floats) -> Floats:
        """What further shots at m settings may have apart from the mean, (d, m, f), from normal
        numbers (d, f)."""
        root = np.sqrt(self.variances(settings))
        return np.asarray((normals[:, None] * root) @ self.prior.patterns.T * self.prior.scales)


def with_jitter(covariances: Floats, variances: Floats) -> Floats:
    """Covariances (f, n, n) of terms with `variances` (t, f), what keeps them factorable added in
    place."""
    rows = np.arange(covariances.shape[-1])
    covariances[:, rows, rows] += JITTER * float(variances.sum(axis=0).mean())
    return covariances


def inverted(covariances: Floats) -> tuple[Floats, float]:
    """Inverses of (f, n, n), and the sum of the logarithms of their determinants."""
    from scipy.linalg import cholesky
    from scipy.linalg.lapack import dpotri

    out, logarithms = np.empty_like(covariances), 0.0
    for number, matrix in enumerate(covariances):
        factor = cholesky(matrix, lower=True, check_finite=False)
        logarithms += 2 * float(np.sum(np.log(np.diag(factor))))
        half, _ = dpotri(factor, lower=1)
        out[number] = np.tril(half) + np.tril(half, -1).T
    return out, logarithms


def covariance(prior: Discrepancy, shots: Coordinates) -> Floats:
    """Of all residuals of n shots, (n f, n f), shots outside and lines inside."""
    out = np.zeros((len(shots) * prior.octaves.size,) * 2)
    for term in prior.terms:
        out += term.covariance(shots, shots, prior.octaves)
    scales = np.tile(prior.scales, len(shots))
    return np.asarray(out * scales * scales[:, None])
