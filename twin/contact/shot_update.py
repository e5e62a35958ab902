"""What measured shots say about latent numbers of the contact: a Gaussian posterior of the shots'
own and of new ones.

Every latent number (a parameter's standard normal, a discrepancy of time, restitution or shape) is
a Gaussian process over settings and velocities. Measurements y = (ln peak force, ln contact time,
ln impulse) depend on the latent numbers of their own shot alone; that dependence is replaced by a
line that is regressed over the posterior itself, again and again, with what it leaves as noise
(iterated posterior linearisation: Garcia-Fernandez, Svensson, Morelande and Sarkka, IEEE Trans.
Signal Process. 63 (2015) 5561). Amplitudes of the discrepancies are the most probable ones under
log-normal priors, widened by their uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..setting import Setting
from .uncertain_parameters import COLUMNS, column_correlation, shot_variance

DISCREPANCIES = ("time", "restitution", "shape")
VELOCITY = "velocity"  # the error of a measured velocity, a latent number of each learned shot

#: Standard deviations of the discrepancies from one configuration to the next, and from shot to
#: shot, before any was measured; and that of the logarithms of all of these.
SMOOTH = np.array([0.15, 0.8, 0.3])
SHOT = np.array([0.04, 0.2, 0.04])
_AMPLITUDE_SPREAD = np.array([0.5, 0.5, 0.5, 0.6, 0.6, 0.6])
#: Standard deviations of ln peak force, ln contact time and ln impulse as sensors show them.
MEASUREMENT = np.array([0.015, 0.03, 0.015])
#: Lengths in ln mass, ln velocity and ln radius over which a discrepancy changes.
_LENGTHS = np.array([1.0, 1.0, 0.8])
#: Shares of a discrepancy's variance: common to all, of the tip, of what is struck, of both
#: together.
_SHARES = (0.1, 0.25, 0.35, 0.3)
_SAMPLES, _ITERATIONS = 32, 9
#: Share of the way to the next line's posterior: whole steps go to and fro between two regimes.
_STEP = 0.5
#: Half the width of a normal 90 % band, the least and the greatest factor on a width.
_NORMAL_90, _NARROWEST, _WIDEST = 1.645, 0.3, 2.5
#: As many configurations as the prior of the widths of peaks, contact times and impulses weighs.
_DOUBT = (10.0, 7.0, 10.0)
#: By how much bands of the peak are widened at least when configurations are many: then little is
#: left but the error of the law and of its lines, which those that are left out share.
_SHARED_ERROR = 0.15

#: ln peak force, ln contact time, ln impulse (n * s, 3) of latent numbers (n * s, latents) and ln
#: velocities (n * s,).
Observables = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True, eq=False)
class ShotFeatures:
    """What a latent number depends on: settings and velocities (m/s, (n,))."""

    settings: Sequence[Setting]
    velocity_m_s: Floats

    @property
    def scaled(self) -> Floats:
        """(n, 3) in units of the lengths over which discrepancies change."""
        body = np.array([(s.impactor_mass_kg, s.tip_radius_m) for s in self.settings]).reshape(
            -1, 2
        )
        return np.asarray(
            np.log(np.column_stack([body[:, 0], self.velocity_m_s, body[:, 1]])) / _LENGTHS
        )

    @property
    def tip(self) -> NDArray[np.str_]:
        return np.array([s.tip.name for s in self.settings])

    @property
    def struck(self) -> NDArray[np.str_]:
        names = (
            (s.anvil.name if s.anvil else "", s.insulator, s.plate.name) for s in self.settings
        )
        return np.array(["|".join(name) for name in names])


def smooth_correlation(rows: ShotFeatures, columns: ShotFeatures) -> Floats:
    """Of a discrepancy (rows, columns): 1 at the same setting and velocity."""
    distance = rows.scaled[:, None] - columns.scaled
    near = np.exp(-0.5 * (distance**2).sum(axis=2))
    tip = rows.tip[:, None] == columns.tip
    struck = rows.struck[:, None] == columns.struck
    common, of_tip, of_struck, both = _SHARES
    return np.asarray(near * (common + of_tip * tip + of_struck * struck + both * (tip & struck)))


@dataclass(frozen=True, eq=False)
class LatentPosterior:
    """Gaussian of the latent numbers `names` at any setting and velocity. Without shots it is the
    prior."""

    names: tuple[str, ...]
    shots: ShotFeatures
    # (observed, latents): derivative of each observation for the latent numbers of its shot
    weights: Floats
    rows: NDArray[np.intp]  # (observed,): the shot of each observation
    mean_factor: Floats  # (observed,): inverse covariance times residuals
    precision: Floats  # (observed, observed): inverse covariance
    smooth: Floats  # (3,): standard deviations of the discrepancies
    shot: Floats
    widths: (
        Floats  # (latents,): factors on standard deviations, from configurations that were left out
    )
    narrowing: float  # share of what draws of ln contact time deviate by, at most 1

    @classmethod
    def prior(cls, names: tuple[str, ...]) -> LatentPosterior:
        nothing = ShotFeatures((), np.zeros(0))
        widening = np.exp(_AMPLITUDE_SPREAD**2)
        empty = np.zeros((0, len(names)))
        rows = np.zeros(0, dtype=np.intp)
        smooth, shot = SMOOTH * widening[:3], SHOT * widening[3:]
        return cls(
            names,
            nothing,
            empty,
            rows,
            np.zeros(0),
            np.zeros((0, 0)),
            smooth,
            shot,
            np.ones(len(names)),
            1.0,
        )

    def at(self, features: ShotFeatures) -> tuple[Floats, Floats]:
        """Mean (n, latents) and covariance (n, latents, latents) of each of n new shots."""
        count, latents = len(features.settings), len(self.names)
        cross = np.empty((count, len(self.rows), latents))
        variance = np.empty((count, latents))
        for column, name in enumerate(self.names):
            if len(self.rows):
                correlation = self._correlation(name, features)[:, self.rows]
                cross[:, :, column] = correlation * self.weights[:, column]
            variance[:, column] = self.prior_variance(name, features)
        mean = np.einsum("nol,o->nl", cross, self.mean_factor)
        gain = np.einsum("op,npl->nol", self.precision, cross)
        covariance = -np.einsum("nol,nok->nlk", cross, gain)
        covariance[:, np.arange(latents), np.arange(latents)] += variance
        return mean, covariance * np.outer(self.widths, self.widths)

    def _correlation(self, name: str, features: ShotFeatures) -> Floats:
        """Covariance (new, learned) of one latent number."""
        if name in COLUMNS:
            return column_correlation(name, features.settings, self.shots.settings)
        index = DISCREPANCIES.index(name)
        return np.asarray(self.smooth[index] ** 2 * smooth_correlation(features, self.shots))

    def prior_variance(self, name: str, features: ShotFeatures) -> Floats:
        """(n,) of one latent number, before any shot of this bench."""
        if name in COLUMNS:
            return np.ones(len(features.settings))
        index = DISCREPANCIES.index(name)
        return np.full(len(features.settings), self.smooth[index] ** 2 + self.shot[index] ** 2)


def updated_posterior(
    names: tuple[str, ...],
    shots: ShotFeatures,
    configuration: NDArray[np.intp],
    velocity_u: Floats,
    measured: Floats,
    observables: Observables,
) -> LatentPosterior:
    """Of n shots: `velocity_u` (n,) standard uncertainty of ln velocity, `measured` (n, 3)
    logarithms, NaN for none.

    Shots of one `configuration` (n,) are left out together where the widths are checked.
    """
    fit = _Fit(names, shots, velocity_u, measured, observables)
    for iteration in range(_ITERATIONS):
        fit.linearise()
        if iteration:
            fit.choose_amplitudes(2 if iteration < _ITERATIONS - 1 else 8)
        fit.condition(1.0 if iteration < 2 else _STEP)
    return fit.posterior(configuration)


class _Fit:
    """The state of the iteration: every shot's latent numbers with the error of its velocity as the
    last."""

    def __init__(
        self,
        names: tuple[str, ...],
        shots: ShotFeatures,
        velocity_u: Floats,
        measured: Floats,
        observables: Observables,
    ) -> None:
        self.names, self.shots, self.measured, self.observables = (
            names,
            shots,
            measured,
            observables,
        )
        self.velocity_u = velocity_u
        count = len(measured)
        self.rows, self.kinds = np.nonzero(np.isfinite(measured))
        identity, smooth = np.eye(count), smooth_correlation(shots, shots)
        self.parameters = {
            name: column_correlation(name, shots.settings, shots.settings)
            + shot_variance(name) * identity
            for name in names
            if name in COLUMNS
        }
        self.bases = [smooth] * 3 + [identity] * 3
        self.log_amplitudes = np.log(np.concatenate([SMOOTH, SHOT]))
        self.amplitude_sd = _AMPLITUDE_SPREAD.copy()
        self.latents = len(names) + 1
        self.mean = np.zeros((count, self.latents))
        self.covariance = np.zeros((count, self.latents, self.latents))
        for column in range(self.latents):
            self.covariance[:, column, column] = np.diag(self._kernel(column))
        rng = np.random.default_rng(0)
        self.normals = _whitened(rng.standard_normal((_SAMPLES, self.latents)))

    def _kernel(self, column: int) -> Floats:
        """Covariance (shots, shots) of one latent number."""
        if column == len(self.names):
            return np.diag(self.velocity_u**2)
        name = self.names[column]
        if name in self.parameters:
            return self.parameters[name]
        index = DISCREPANCIES.index(name)
        variance = np.exp(2 * self.log_amplitudes)
        return np.asarray(
            variance[index] * self.bases[index] + variance[index + 3] * self.bases[index + 3]
        )

    def linearise(self) -> None:
        """Lines y = b + A x of each shot, regressed over its posterior, and what they leave as
        noise."""
        count = len(self.measured)
        root = lower_roots(self.covariance)
        offsets = np.einsum("nlk,sk->nsl", root, self.normals)
        points = (self.mean[:, None] + offsets).reshape(count * _SAMPLES, -1)
        log_velocity = np.repeat(np.log(self.shots.velocity_m_s), _SAMPLES) - points[:, -1]
        values = self.observables(points[:, :-1], log_velocity).reshape(count, _SAMPLES, 3)
        centre = values.mean(axis=1)
        deviations = values - centre[:, None]
        slope = np.einsum("nso,sl->nol", deviations, self.normals) / _SAMPLES
        remainder = deviations - np.einsum("nol,sl->nso", slope, self.normals)
        noise = np.einsum("nso,nsp->nop", remainder, remainder) / max(
            _SAMPLES - self.latents - 1, 1
        )
        # A = slope / root, since x - mean = root z.
        derivative = np.linalg.solve(np.swapaxes(root, 1, 2), np.swapaxes(slope, 1, 2))
        derivative = np.swapaxes(derivative, 1, 2)
        intercept = centre - np.einsum("nol,nl->no", derivative, self.mean)
        self.weights = derivative[self.rows, self.kinds]
        self.residual = (self.measured - intercept)[self.rows, self.kinds]
        noise = noise + np.diag(MEASUREMENT**2)
        same = self.rows[:, None] == self.rows
        self.noise = np.where(
            same, noise[self.rows[:, None], self.kinds[:, None], self.kinds[None, :]], 0.0
        )
        self.fixed = self.noise.copy()
        for column in range(self.latents):
            if column == self.latents - 1 or self.names[column] in self.parameters:
                self.fixed += self._spread(column, self._kernel(column))
        first = self.latents - 4
        self.parts = [
            self._spread(first + index % 3, base) for index, base in enumerate(self.bases)
        ]

    def _spread(self, column: int, kernel: Floats) -> Floats:
        """What one latent number of a covariance (shots, shots) adds to that of the
        observations."""
        weight = self.weights[:, column]
        return np.asarray(weight[:, None] * kernel[np.ix_(self.rows, self.rows)] * weight)

    def choose_amplitudes(self, steps: int) -> None:
        """Most probable amplitudes of the discrepancies, and their uncertainty, by Newton's steps
        with the average information (Gilmour, Thompson and Cullis, Biometrics 51 (1995) 1440)."""
        prior = np.log(np.concatenate([SMOOTH, SHOT]))
        for _ in range(steps):
            inverse = _inverse(self._total())
            factor = inverse @ self.residual
            variance = 2 * np.exp(2 * self.log_amplitudes)
            pulls = np.array([part @ factor for part in self.parts])
            fit = pulls @ factor - np.array([np.vdot(inverse, part) for part in self.parts])
            information = 0.5 * (pulls @ inverse @ pulls.T) * np.outer(variance, variance)
            information += np.diag(_AMPLITUDE_SPREAD**-2)
            gradient = 0.5 * variance * fit - (self.log_amplitudes - prior) / _AMPLITUDE_SPREAD**2
            self.log_amplitudes = self.log_amplitudes + np.clip(
                np.linalg.solve(information, gradient), -0.5, 0.5
            )
            self.amplitude_sd = np.sqrt(np.diag(np.linalg.inv(information)))

    def _total(self) -> Floats:
        variance = np.exp(2 * self.log_amplitudes)
        return np.asarray(
            self.fixed + sum(v * part for v, part in zip(variance, self.parts, strict=True))
        )

    def condition(self, step: float) -> None:
        """The posterior of every shot's latent numbers."""
        self.precision = _inverse(self._total())
        self.factor = self.precision @ self.residual
        count = len(self.measured)
        cross = np.empty((count, len(self.rows), self.latents))
        prior = np.zeros((count, self.latents, self.latents))
        for column in range(self.latents):
            kernel = self._kernel(column)
            cross[:, :, column] = kernel[:, self.rows] * self.weights[:, column]
            prior[:, column, column] = np.diag(kernel)
        mean = np.einsum("nol,o->nl", cross, self.factor)
        covariance = prior - np.matmul(np.swapaxes(cross, 1, 2), np.matmul(self.precision, cross))
        self.mean = self.mean + step * (mean - self.mean)
        self.covariance = self.covariance + step * (covariance - self.covariance)

    def posterior(self, configuration: NDArray[np.intp]) -> LatentPosterior:
        amplitudes: Floats = np.exp(self.log_amplitudes)
        widened: Floats = amplitudes * np.exp(self.amplitude_sd**2)
        return LatentPosterior(
            self.names,
            self.shots,
            self.weights[:, :-1],
            self.rows,
            self.factor,
            self.precision,
            amplitudes[:3],
            widened[3:],
            *self._widths(configuration),
        )

    def _widths(self, configuration: NDArray[np.intp]) -> tuple[Floats, float]:
        """Factors on the latents' standard deviations (latents,), and on what contact times deviate
        by, with which 90 % bands hold 90 % of what was left out.

        Each configuration is predicted by all others (block of the inverse covariance: Rasmussen
        and Williams, Gaussian Processes, 2006, eq. 5.12), and the mean error of its shots is
        standardized. The factor is the 90 % quantile of these and one more (conformal prediction)
        over the normal one's, drawn towards 1 where configurations are few. Peaks set the factor of
        the parameters and of the stretch, contact times the shape's, impulses the restitution's:
        these are 1 or more, since those that are left out share errors of the law and of its lines.
        Parameters that are wide for the peak's sake make contact times too wide: these are narrowed
        alone.
        """
        body = configuration[self.rows]
        numbers = np.unique(body)
        errors = np.full((len(numbers), 3), np.nan)
        for row, number in enumerate(numbers):
            block = np.flatnonzero(body == number)
            covariance = np.linalg.inv(self.precision[np.ix_(block, block)])
            remainder = covariance @ self.factor[block]
            for kind in np.unique(self.kinds[block]):
                of_kind = self.kinds[block] == kind
                errors[row, kind] = remainder[of_kind].sum() / np.sqrt(
                    covariance[np.ix_(of_kind, of_kind)].sum()
                )
        wanted = np.ones(3)
        for kind in range(3):
            sizes = np.abs(errors[np.isfinite(errors[:, kind]), kind])
            if sizes.size > 1:
                last = min(math.ceil(0.9 * (sizes.size + 1)), sizes.size)
                quantile = float(np.sort(sizes)[last - 1]) / _NORMAL_90
                weight = sizes.size / (sizes.size + _DOUBT[kind])
                least = 1 + _SHARED_ERROR * weight if kind == 0 else 0.0
                wanted[kind] = np.clip(quantile**weight, least, _WIDEST)
        peak, time, impulse = np.maximum(wanted, 1.0)
        # Wider parameters widen contact times as they do peaks.
        narrowing = float(np.clip(wanted[1] / peak, _NARROWEST, 1.0))
        return np.array([*[peak] * (len(self.names) - 3), peak, impulse, time]), narrowing


def _whitened(normals: Floats) -> Floats:
    """Samples (s, k) of mean 0 and covariance 1 exactly."""
    centred = normals - normals.mean(axis=0)
    root = np.linalg.cholesky(centred.T @ centred / len(centred))
    return np.asarray(np.linalg.solve(root, centred.T).T)


def _inverse(covariance: Floats) -> Floats:
    """Of a positive definite matrix."""
    from scipy.linalg.lapack import dpotrf, dpotri

    lower, _ = dpotrf(covariance, lower=1)
    inverse, _ = dpotri(lower, lower=1)
    return np.asarray(inverse + np.tril(inverse, -1).T)


def lower_roots(covariance: Floats) -> Floats:
    """Lower triangular roots of covariances (n, k, k), of which some may be singular."""
    scale = np.einsum("nkk->nk", covariance)
    floor = np.maximum(1e-9 * scale, 1e-12)
    try:
        return np.linalg.cholesky(covariance + floor[:, :, None] * np.eye(covariance.shape[1]))
    except np.linalg.LinAlgError:  # by rounding, where shots say far more than the prior
        values, vectors = np.linalg.eigh(covariance)
        factors = vectors * np.sqrt(np.maximum(values, 1e-12))[:, None, :]
        upper = np.linalg.qr(np.swapaxes(factors, 1, 2)).R
        return np.asarray(
            np.swapaxes(upper, 1, 2) * np.sign(np.einsum("nkk->nk", upper))[:, None, :]
        )
