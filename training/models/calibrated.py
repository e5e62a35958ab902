"""Spreads that keep their promise: the 90 % band holds 90 % of what other configurations measure.

Where a model errs more than it says: its deviations over its spreads, averaged over impacts alike.

A model has one noise level, a bench has not: bare metal on metal scatters more than a tip on an insulator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import Inputs, PulseTable
from ..estimators.base import Arrays, FitReport, Standard, require_fitted
from ..gp.kernels import squared_distances
from ..tuning.folds import grouped_folds
from .base import ContactModel, ContactPrediction, get_array, impulse, own, prefixed, restored
from .serialization import describe

#: How far alike reaches, in deviations of the predictors; the last is a mean over all.
REACHES = (0.35, 0.7, 1.4, 2.8, np.inf)


class Difficulty:
    """Deviation over spread as a function of the predictors: the root of the mean of its squares (n,) over the rows x
    (n x d), weighted by exp(-distance^2 / (2 reach^2)) in standardised predictors.

    Far from all rows it is that of the nearest.
    """

    def __init__(self, x: Floats, squares: Floats, reach: float) -> None:
        self.x, self.squares, self.reach = x, squares, reach
        self._columns = Standard.of(x)

    def at(self, x: Floats) -> Floats:
        """Factors (m,) at x (m x d)."""
        distance = squared_distances(self._columns.apply(x), self._columns.apply(self.x))
        distance -= distance.min(axis=1, keepdims=True)
        weight = np.exp(distance / (-2.0 * self.reach**2))
        return np.asarray(np.sqrt((weight @ self.squares) / weight.sum(axis=1)))


def leave_one_out_spread(x: Floats, squares: Floats, folds: Sequence[NDArray[np.bool_]], reach: float) -> Floats:
    """Factors (n,) of each fold's rows from the others."""
    factors = np.empty_like(squares)
    for fold in folds:
        factors[fold] = Difficulty(x[~fold], squares[~fold], reach).at(x[fold])
    return factors


def most_likely(x: Floats, squares: Floats, folds: Sequence[NDArray[np.bool_]]) -> Difficulty:
    """That of the reach which makes the deviations left out most likely, were they normal."""

    def surprise(reach: float) -> float:
        factors = leave_one_out_spread(x, squares, folds, reach)
        return float((np.log(factors) + squares / (2 * factors**2)).sum())

    return Difficulty(x, squares, min(REACHES, key=surprise))


#: Of a band of mean plus and minus `WIDTH` spreads.
COVERAGE, WIDTH = 0.90, 1.645


class Calibrated(ContactModel):
    """The model fitted to all pulses, its spreads scaled by what it deviates from pulses it has not seen.

    Those are `folds`-fold cross-validation's, which leaves out whole configurations; the model is refitted each time,
    with what it tuned on all kept. Deviations over spreads, averaged over impacts alike (`Difficulty`), say where the
    spread is too narrow; a conformal quantile for force and one for contact time, pooled over folds and points, then
    makes the band hold 90 % (normalised conformal prediction: Papadopoulos, Vovk and Gammerman 2011, J. Artif. Intell.
    Res. 40; across folds: Vovk 2015). A model without spreads gets those of its deviations: of each point over the
    pulse's peak, of the contact time over itself. A third quantile, of the impulse's deviations, says how peak force
    and contact time go together.
    """

    kind = "calibrated"

    def __init__(self, model: ContactModel, folds: int = 5) -> None:
        self.model = model
        self.folds = folds

    model_: ContactModel | None = None
    #: What force and contact time spreads are multiplied by, after `difficulty_`, one for each: (2,).
    factors_: Floats
    #: Spreads for a model without: 20 points over the peak, and contact time over itself (21,).
    relative_: Floats
    difficulty_: tuple[Difficulty, ...]
    #: Spread of the impulse over what peak force and contact time would give it, were they to deviate apart from each
    #: other; None where older software calibrated.
    impulse_: float | None = None

    def settings(self) -> dict[str, Any]:
        return {"model": describe(self.model), "folds": self.folds}

    def fit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        model_rng, folds_rng = rng.spawn(2)
        self.model_ = own(self.model).fit(pulses, model_rng)
        folds = grouped_folds(pulses.configuration, self.folds, folds_rng)
        unseen = _left_out(self.model_, pulses, folds, folds_rng)
        force, time = pulses.force_n - unseen.force_n, pulses.contact_time_s - unseen.contact_time_s
        relative_time = _root_mean_square(time / unseen.contact_time_s)
        self.relative_ = np.append(_root_mean_square(force / _peak(unseen)), relative_time)
        force_spread, time_spread = self._spreads(unseen)
        force_over, time_over = _over(force, force_spread), _over(time, time_spread)
        squares = (force_over**2).mean(axis=1), time_over**2
        self.difficulty_ = tuple(most_likely(pulses.x, output_squares, folds) for output_squares in squares)
        alike = [leave_one_out_spread(pulses.x, scaling.squares, folds, scaling.reach) for scaling in self.difficulty_]
        self.factors_ = np.array([_factor(force_over / alike[0][:, None]), _factor(time_over / alike[1])])
        force_spread = self.factors_[0] * alike[0][:, None] * force_spread
        apart = np.hypot(*_relative(unseen, force_spread, self.factors_[1] * alike[1] * time_spread))
        measured, predicted = (impulse(pulse.force_n, pulse.contact_time_s) for pulse in (pulses, unseen))
        self.impulse_ = _factor(_over(np.log(measured / predicted), apart))
        return self

    def refit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        """Calibrated as this one: only the model learns."""
        new = type(self)(self.model, self.folds)
        new.model_ = self._learned().refit(pulses, rng)
        new.relative_, new.factors_, new.difficulty_ = self.relative_, self.factors_, self.difficulty_
        new.impulse_ = self.impulse_
        return new

    def predict(self, inputs: Inputs) -> ContactPrediction:
        prediction = self._learned().predict(inputs)
        force, time = self._spreads(prediction)
        factors = self.factors_ * np.column_stack([scaling.at(inputs.x) for scaling in self.difficulty_])
        force, time = factors[:, :1] * force, factors[:, 1] * time
        together = prediction.log_correlation
        if self.impulse_ is not None:
            together = _log_correlation(self.impulse_, *_relative(prediction, force, time))
        return replace(prediction, force_spread_n=force, contact_time_spread_s=time, log_correlation=together)

    def _spreads(self, prediction: ContactPrediction) -> tuple[Floats, Floats]:
        """Before the factors: the model's own, or those of its deviations."""
        force, time = prediction.force_spread_n, prediction.contact_time_spread_s
        return (
            self.relative_[:-1] * _peak(prediction) if force is None else force,
            self.relative_[-1] * prediction.contact_time_s if time is None else time,
        )

    def fit_report(self) -> FitReport:
        return self._learned().fit_report()

    def _learned(self) -> ContactModel:
        return require_fitted(self.model_, self.kind)

    def arrays(self) -> Arrays:
        return {
            **prefixed("model", self._learned().arrays()),
            "factors": self.factors_,
            "relative": self.relative_,
            "x": self.difficulty_[0].x,
            "squares": np.column_stack([scaling.squares for scaling in self.difficulty_]),
            "reach": np.array([scaling.reach for scaling in self.difficulty_]),
            **({} if self.impulse_ is None else {"impulse": np.array(self.impulse_)}),
        }

    def restore(self, arrays: Arrays) -> Self:
        self.factors_ = get_array(arrays, "factors", self.kind)
        self.relative_ = get_array(arrays, "relative", self.kind)
        x, squares, reach = (get_array(arrays, name, self.kind) for name in ("x", "squares", "reach"))
        self.difficulty_ = tuple(Difficulty(x, squares[:, i], float(reach[i])) for i in range(2))
        self.impulse_ = float(arrays["impulse"]) if "impulse" in arrays else None
        self.model_ = restored(self.model, "model", arrays)
        return self


def _left_out(
    model: ContactModel, pulses: PulseTable, folds: Sequence[NDArray[np.bool_]], rng: np.random.Generator
) -> ContactPrediction:
    """Each fold's pulses as the others alone predict them, in the order of the pulses."""
    parts = [
        model.refit(pulses.take(~fold), fold_rng).predict(pulses.take(fold).inputs)
        for fold, fold_rng in zip(folds, rng.spawn(len(folds)), strict=True)
    ]
    back = np.argsort(np.concatenate([np.flatnonzero(fold) for fold in folds]))
    return ContactPrediction(
        force_n=np.concatenate([part.force_n for part in parts])[back],
        contact_time_s=np.concatenate([part.contact_time_s for part in parts])[back],
        force_spread_n=_joined([part.force_spread_n for part in parts], back),
        contact_time_spread_s=_joined([part.contact_time_spread_s for part in parts], back),
    )


def _relative(prediction: ContactPrediction, force_spread: Floats, time_spread: Floats) -> tuple[Floats, Floats]:
    """Relative spreads (n,) of peak force and contact time."""
    rows, peak = np.arange(len(force_spread)), prediction.force_n.argmax(axis=1)
    return force_spread[rows, peak] / prediction.force_n[rows, peak], time_spread / prediction.contact_time_s


def _log_correlation(impulse: float, force: Floats, time: Floats) -> Floats:
    """That (n,) with which the log impulse deviates by `impulse` times what force and time would give apart: of
    a^2 + b^2 + 2 r a b, a and b the relative spreads (n,)."""
    both, apart = 2 * force * time, force**2 + time**2
    # Where one of them hardly spreads, the quotient is beyond any bound, and only its sign counts.
    ratio = np.divide(apart, both, out=np.full_like(apart, np.inf), where=both > 1e-12 * apart)
    return np.asarray(np.clip((impulse**2 - 1) * ratio, -1.0, 1.0))


def _joined(parts: list[Floats | None], order: NDArray[np.intp]) -> Floats | None:
    existing = [part for part in parts if part is not None]
    return np.concatenate(existing)[order] if len(existing) == len(parts) else None


def _peak(prediction: ContactPrediction) -> Floats:
    """n x 1."""
    return np.asarray(prediction.force_n.max(axis=1, keepdims=True))


def _root_mean_square(deviation: Floats) -> Floats:
    return np.asarray(np.sqrt((deviation * deviation).mean(axis=0)))


def _over(deviation: Floats, spread: Floats) -> Floats:
    """A model may be sure of a value, with no spread: then a billionth of the largest spread, not of none."""
    return np.asarray(np.abs(deviation) / np.maximum(spread, 1e-9 * spread.max()))


def _factor(deviation: Floats) -> float:
    """The least by which the band holds `COVERAGE` of the deviations, and one more."""
    over = np.sort(deviation.ravel() / WIDTH)
    return float(over[min(int(np.ceil(COVERAGE * (len(over) + 1))), len(over)) - 1])
