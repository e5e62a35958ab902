"""Spreads that keep their promise: the 90 % band holds 90 % of what other configurations measure.

Where a model errs more than it says: its deviations over its spreads, averaged over impacts alike.

A model has one noise level, a bench has not: bare metal on metal scatters more than a tip on an
insulator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import Inputs, PulseTable, Texts
from ..estimators.base import Arrays, FitReport, Standard, require_fitted
from ..gp.kernels import squared_distances
from ..tuning.folds import grouped_folds
from .base import (
    MARGIN,
    ContactModel,
    ContactPrediction,
    get_array,
    momentum,
    own,
    prefixed,
    restored,
)
from .prior_pulses import log_spreads, mean_pulses
from .serialization import describe

#: How far alike reaches, in deviations of the predictors; the last is a mean over all.
REACHES = (0.35, 0.7, 1.4, 2.8, np.inf)


class Difficulty:
    """Deviation over spread as a function of the predictors: the root of the mean of its squares
    (n,) over the rows x (n x d), weighted by exp(-distance^2 / (2 reach^2)) in standardised
    predictors.

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


def leave_one_out_spread(
    x: Floats, squares: Floats, folds: Sequence[NDArray[np.bool_]], reach: float
) -> Floats:
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
#: Deviation of a contact time whose begin and end are each located to one sample, in samples.
_OF_A_SAMPLE = 6**-0.5
#: A spread is at least this share of the value: below lies the round-off of a prediction.
_ROUND_OFF = 1e-9


@dataclass(frozen=True, eq=False)
class UnseenDeviations:
    """Of n pulses that a model was asked for without their configurations: `ratio` (n x 3) are the
    deviations of ln peak force, ln contact time and ln impulse over the spreads stated for them;
    `configuration` (n,)."""

    configuration: Texts
    ratio: Floats

    def factors(self) -> Floats:
        """What the spreads (3,) are multiplied by, so that the 90 % bands hold on configurations
        like these."""
        columns = [
            grouped_quantile(column, self.configuration, COVERAGE) for column in self.ratio.T
        ]
        return np.array(columns) / WIDTH

    def of(self, configurations: Texts) -> UnseenDeviations:
        """Those of some configurations; all where none of them is among these."""
        rows = np.isin(self.configuration, configurations)
        return UnseenDeviations(self.configuration[rows], self.ratio[rows]) if rows.any() else self


def grouped_quantile(scores: Floats, groups: Texts, level: float) -> float:
    """The score that a pulse of a further group does not exceed with probability `level`; scores
    (n,), groups (n,).

    Every group weighs the same, shared by its scores (pooled distributions: Dunn, Wasserman and
    Ramdas, J. Am. Stat. Assoc. 118 (2023) 2491). The weight at infinity that makes the coverage of
    split conformal bands exact (Lee, Barber and Willett, arXiv 2306.06342) is left out:
    cross-validated scores are those of models that learned from fewer groups, and too large
    already.
    """
    _, member, sizes = np.unique(groups, return_inverse=True, return_counts=True)
    order = np.argsort(scores)
    reached = np.cumsum(1.0 / (len(sizes) * sizes[member[order]])) >= level * (1 - 1e-12)
    return float(scores[order][np.argmax(reached)])


class Calibrated(ContactModel):
    """The model fitted to all pulses, its spreads scaled by what it deviates from pulses it has not
    seen.

    Those are `folds`-fold cross-validation's, which leaves out whole configurations. The model is
    learned and tuned anew each time (`relearn`): one that was tuned on all pulses errs less on
    those left out. Deviations over spreads, averaged over impacts alike (`Difficulty`), say where
    the spread is too narrow; a conformal quantile for the points of the force and one for contact
    time, pooled over folds, then makes the band hold 90 % (normalised conformal prediction:
    Papadopoulos, Vovk and Gammerman 2011, J. Artif. Intell. Res. 40; across folds: Vovk 2015, and
    CV+ of Barber et al. 2021, Ann. Stat. 49). A model without spreads gets those of its deviations:
    of each point over the pulse's peak, of the contact time over itself.

    Random pulses have spreads of their own, for the peak, the contact time and the impulse: a
    quantile of each over configurations (`grouped_quantile`). A model that is refitted without some
    configurations leaves their deviations out of these, so that its bands were calibrated on other
    configurations than it is judged by. No contact time has a spread below that of a sample.
    """

    kind = "calibrated"

    def __init__(self, model: ContactModel, folds: int = 5) -> None:
        self.model = model
        self.folds = folds

    model_: ContactModel | None = None
    #: What force and contact time spreads are multiplied by, after `difficulty_`, one for each:
    #: (2,).
    factors_: Floats
    #: Spreads for a model without: 20 points over the peak, and contact time over itself (21,).
    relative_: Floats
    difficulty_: tuple[Difficulty, ...]
    #: None where older software calibrated: then random pulses have the spreads of the points.
    unseen_: UnseenDeviations | None = None
    #: Spread of the impulse over what peak force and contact time would give it, as older software
    #: calibrated it.
    impulse_: float | None = None
    #: The greatest learned impulse over two momenta of the impactor, and some more; at least 1.
    impulse_allowance_: float = 1.0
    #: The least spread of a contact time, s.
    least_time_spread_: float = 0.0

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
        self.least_time_spread_, self.impulse_allowance_ = (
            _least_time_spread(pulses),
            _impulse_allowance(pulses),
        )
        force_spread, time_spread = self._spreads(unseen)
        force_over, time_over = _over(force, force_spread), _over(time, time_spread)
        squares = (force_over**2).mean(axis=1), time_over**2
        self.difficulty_ = tuple(
            most_likely(pulses.x, output_squares, folds) for output_squares in squares
        )
        alike = [
            leave_one_out_spread(pulses.x, scaling.squares, folds, scaling.reach)
            for scaling in self.difficulty_
        ]
        self.factors_ = np.array(
            [_factor(force_over / alike[0][:, None]), _factor(time_over / alike[1])]
        )
        stated = self._scaled(unseen, np.column_stack(alike))
        self.unseen_ = UnseenDeviations(pulses.configuration, _ratios(stated, pulses))
        return self

    def refit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return self._calibrated_for(pulses, self._learned().refit(pulses, rng))

    def relearn(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        return self._calibrated_for(pulses, self._learned().relearn(pulses, rng))

    def _calibrated_for(self, pulses: PulseTable, model: ContactModel) -> Self:
        """Another model with these bands, but for the configurations that are not among the
        pulses."""
        new = type(self)(self.model, self.folds)
        new.model_ = model
        new.relative_, new.factors_, new.difficulty_ = (
            self.relative_,
            self.factors_,
            self.difficulty_,
        )
        new.impulse_, new.least_time_spread_ = self.impulse_, self.least_time_spread_
        new.impulse_allowance_ = self.impulse_allowance_
        if self.unseen_ is not None:
            new.unseen_ = self.unseen_.of(pulses.configuration)
            rows = np.isin(self.unseen_.configuration, new.unseen_.configuration)
            new.difficulty_ = tuple(
                Difficulty(d.x[rows], d.squares[rows], d.reach) for d in self.difficulty_
            )
        return new

    def predict(self, inputs: Inputs) -> ContactPrediction:
        scaled = self._scaled(
            self._learned().predict(inputs),
            np.column_stack([scaling.at(inputs.x) for scaling in self.difficulty_]),
        )
        if self.unseen_ is not None:
            least = self._least_time_spread(scaled) / scaled.contact_time_s
            return _with_log_spreads(scaled, self.unseen_.factors(), least)
        if self.impulse_ is None:
            return scaled
        peak, time = log_spreads(scaled).T
        return replace(
            scaled,
            log_correlation=_log_correlation(self.impulse_ * np.hypot(peak, time), peak, time),
        )

    def _scaled(self, prediction: ContactPrediction, difficulty: Floats) -> ContactPrediction:
        """With the spreads of points and contact times times the factors and a difficulty (n x
        2)."""
        force, time = self._spreads(prediction)
        factors = self.factors_ * difficulty
        time = np.maximum(factors[:, 1] * time, self._least_time_spread(prediction))
        return replace(
            prediction,
            force_spread_n=factors[:, :1] * force,
            contact_time_spread_s=time,
            impulse_allowance=self.impulse_allowance_,
        )

    def _least_time_spread(self, prediction: ContactPrediction) -> Floats:
        return np.asarray(
            np.maximum(self.least_time_spread_, _ROUND_OFF * prediction.contact_time_s)
        )

    def _spreads(self, prediction: ContactPrediction) -> tuple[Floats, Floats]:
        """Before the factors: the model's own, or those of its deviations."""
        force, time = prediction.force_spread_n, prediction.contact_time_spread_s
        time = self.relative_[-1] * prediction.contact_time_s if time is None else time
        return (
            self.relative_[:-1] * _peak(prediction) if force is None else force,
            np.maximum(time, self._least_time_spread(prediction)),
        )

    def fit_report(self) -> FitReport:
        return self._learned().fit_report()

    def _learned(self) -> ContactModel:
        return require_fitted(self.model_, self.kind)

    def arrays(self) -> Arrays:
        unseen = self.unseen_
        return {
            **prefixed("model", self._learned().arrays()),
            "factors": self.factors_,
            "relative": self.relative_,
            "x": self.difficulty_[0].x,
            "squares": np.column_stack([scaling.squares for scaling in self.difficulty_]),
            "reach": np.array([scaling.reach for scaling in self.difficulty_]),
            "least_time_spread": np.array(self.least_time_spread_),
            "impulse_allowance": np.array(self.impulse_allowance_),
            **({} if self.impulse_ is None else {"impulse": np.array(self.impulse_)}),
            **(
                {}
                if unseen is None
                else {"configuration": unseen.configuration, "unseen_ratio": unseen.ratio}
            ),
        }

    def restore(self, arrays: Arrays) -> Self:
        self.factors_ = get_array(arrays, "factors", self.kind)
        self.relative_ = get_array(arrays, "relative", self.kind)
        x, squares, reach = (
            get_array(arrays, name, self.kind) for name in ("x", "squares", "reach")
        )
        self.difficulty_ = tuple(Difficulty(x, squares[:, i], float(reach[i])) for i in range(2))
        self.impulse_ = float(arrays["impulse"]) if "impulse" in arrays else None
        if "unseen_ratio" in arrays:
            self.unseen_ = UnseenDeviations(
                get_array(arrays, "configuration", self.kind), arrays["unseen_ratio"]
            )
        self.least_time_spread_ = float(arrays.get("least_time_spread", 0.0))
        self.impulse_allowance_ = float(arrays.get("impulse_allowance", 1.0))
        self.model_ = restored(self.model, "model", arrays)
        return self


def _left_out(
    model: ContactModel,
    pulses: PulseTable,
    folds: Sequence[NDArray[np.bool_]],
    rng: np.random.Generator,
) -> ContactPrediction:
    """Each fold's pulses as the others alone predict them, in the order of the pulses."""
    parts = [
        model.relearn(pulses.take(~fold), fold_rng).predict(pulses.take(fold).inputs)
        for fold, fold_rng in zip(folds, rng.spawn(len(folds)), strict=True)
    ]
    back = np.argsort(np.concatenate([np.flatnonzero(fold) for fold in folds]))
    return ContactPrediction(
        force_n=np.concatenate([part.force_n for part in parts])[back],
        contact_time_s=np.concatenate([part.contact_time_s for part in parts])[back],
        force_spread_n=_joined([part.force_spread_n for part in parts], back),
        contact_time_spread_s=_joined([part.contact_time_spread_s for part in parts], back),
    )


def _ratios(unseen: ContactPrediction, pulses: PulseTable) -> Floats:
    """(n x 3) of `UnseenDeviations`: the impulse's over what peak and contact time give it apart
    from each other."""
    mean = mean_pulses(unseen)
    predicted = np.column_stack([mean.peak_force_n, mean.contact_time_s, mean.impulse_n_s])
    measured = np.column_stack([pulses.peak_force_n, pulses.contact_time_s, pulses.impulse_n_s])
    spread = log_spreads(unseen)
    spread = np.column_stack([spread, np.hypot(*spread.T)])
    return np.asarray(np.abs(np.log(measured / predicted)) / np.maximum(spread, _ROUND_OFF))


def _with_log_spreads(
    prediction: ContactPrediction, factors: Floats, least_time: Floats
) -> ContactPrediction:
    """With the spreads of ln peak and ln contact time, and the correlation that gives the impulse
    its own, all times `factors` (3,), that of the time at least `least_time` (n,). Where no
    correlation makes the impulse spread so far, peak and time spread further."""
    spread = np.maximum(log_spreads(prediction), _ROUND_OFF)
    of_impulse = factors[2] * np.hypot(*spread.T)
    spread = np.column_stack(
        [factors[0] * spread[:, 0], np.maximum(factors[1] * spread[:, 1], least_time)]
    )
    spread = spread * np.maximum(of_impulse / spread.sum(axis=1), 1.0)[:, None]
    return replace(
        prediction, log_spread=spread, log_correlation=_log_correlation(of_impulse, *spread.T)
    )


def _log_correlation(impulse: Floats, force: Floats, time: Floats) -> Floats:
    """That (n,) with which the log impulse has a spread (n,): of a^2 + b^2 + 2 r a b, a and b the
    spreads (n,) of the logarithms of peak force and contact time."""
    both, apart = 2 * force * time, force**2 + time**2
    # Where one of them hardly spreads, the quotient is beyond any bound, and only its sign counts.
    scaled = both > 1e-12 * apart
    ratio = np.divide(impulse**2 - apart, both, out=np.sign(impulse**2 - apart), where=scaled)
    return np.asarray(np.clip(ratio, -1.0, 1.0))


def _joined(parts: list[Floats | None], order: NDArray[np.intp]) -> Floats | None:
    existing = [part for part in parts if part is not None]
    return np.concatenate(existing)[order] if len(existing) == len(parts) else None


def _peak(prediction: ContactPrediction) -> Floats:
    """n x 1."""
    return np.asarray(prediction.force_n.max(axis=1, keepdims=True))


def _least_time_spread(pulses: PulseTable) -> float:
    """s; 0 where no sampling period is known. The longest period counts: the model may be asked for
    any record."""
    if pulses.sample_s is None or not np.isfinite(pulses.sample_s).any():
        return 0.0
    return float(np.nanmax(pulses.sample_s)) * _OF_A_SAMPLE


def _impulse_allowance(pulses: PulseTable) -> float:
    """1 where no learned impulse exceeds two momenta: a hand that pushes and a velocity that is
    read too low give more, and a band that ended there would not hold them. 1 where the mass is not
    known."""
    try:
        largest = float(np.max(pulses.impulse_n_s / (2 * momentum(pulses))))
    except (ValueError, LookupError):
        return 1.0
    return max(1.0, MARGIN * largest)


def _root_mean_square(deviation: Floats) -> Floats:
    return np.asarray(np.sqrt((deviation * deviation).mean(axis=0)))


def _over(deviation: Floats, spread: Floats) -> Floats:
    """A model may be sure of a value, with no spread: then a billionth of the largest spread, not
    of none. A deviation counts as a millionth of the spread at least: values that are all the same
    are met exactly, and have a logarithm."""
    return np.asarray(np.maximum(np.abs(deviation) / np.maximum(spread, 1e-9 * spread.max()), 1e-6))


def _factor(deviation: Floats) -> float:
    """The least by which the band holds `COVERAGE` of the deviations, and one more."""
    over = np.sort(deviation.ravel() / WIDTH)
    return float(over[min(int(np.ceil(COVERAGE * (len(over) + 1))), len(over)) - 1])
