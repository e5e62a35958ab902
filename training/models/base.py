"""What every contact model promises: inputs in, a pulse with its spread out.

What every learned model asks of the inputs it is given.

Small sums over pulses of equidistant points.

Models made of parts: copies that learn, and their arrays under names with a prefix.

Spreads of several coupled outputs through a function of them, to first order.
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from ...array_types import Floats
from ...dataset.table import POINTS, Inputs, Predictor, PulseTable, Texts
from ..estimators.base import Arrays, Estimator, FitReport


@dataclass(frozen=True, eq=False)
class ContactPrediction:
    """Pulses of n impacts: force (n x 20) at equidistant points of the contact, ends included, and
    contact time (n,).

    The spreads are standard deviations of a new measurement (not of its mean); None where a law of
    physics gives none. The 90 % band is the mean plus and minus 1.645 spreads. `log_correlation`
    (n,) is that of the logarithms of peak force and contact time; None for a model that does not
    know it. `log_spread` (n x 2) are standard deviations of the logarithms of peak force and
    contact time of a random pulse, calibrated by configuration; None where they follow from the
    spreads. No random pulse has an impulse above `impulse_allowance` times two momenta of the
    impactor.
    """

    force_n: Floats
    contact_time_s: Floats
    force_spread_n: Floats | None
    contact_time_spread_s: Floats | None
    log_correlation: Floats | None = None
    log_spread: Floats | None = None
    impulse_allowance: float = 1.0


class ContactModel(ABC):
    """Force and contact time of impacts. The constructor keeps settings; what `fit` learns ends in
    `_`."""

    #: Under which it is written and found again, unique in `models`.
    kind: ClassVar[str]
    #: A sentence for a person who chooses among models, of a model of another package.
    description: ClassVar[str] = ""

    @abstractmethod
    def fit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        """Learn from measured pulses. The same pulses, settings and seed give the same model.

        Parameters:
            pulses: Measured pulses with their inputs.
            rng: The generator of what is random in the training.

        Returns:
            The model itself.
        """

    @abstractmethod
    def predict(self, inputs: Inputs) -> ContactPrediction:
        """Pulses of impacts.

        Parameters:
            inputs: The impacts, with the predictors that the model learned from.

        Raises:
            NotFittedError: Before `fit`.
            ValueError: For other predictors than learned.
        """

    def refit(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        """A new model, learned from other pulses with what this one tuned kept; cheap where it can
        be.

        Parameters:
            pulses: Measured pulses with their inputs.
            rng: The generator of what is random in the training.
        """
        return type(self)(**self.settings()).fit(pulses, rng)

    def relearn(self, pulses: PulseTable, rng: np.random.Generator) -> Self:
        """A new model, learned and tuned from other pulses: it knows nothing of those left out, but
        for what only a long search finds (`Estimator.relearn`).

        Parameters:
            pulses: Measured pulses with their inputs.
            rng: The generator of what is random in the training.
        """
        return self.refit(pulses, rng)

    def fit_report(self) -> FitReport:
        """What `fit` searched and found, of all parts ("force.kernel", "time.noise")."""
        return FitReport()

    @abstractmethod
    def settings(self) -> dict[str, Any]:
        """The constructor's arguments as JSON holds them; an inner part is {"kind": ...,
        "settings": ...}."""

    @abstractmethod
    def arrays(self) -> Arrays:
        """Everything learned, by name ("force.alpha"). Raises `NotFittedError` before `fit`."""

    @abstractmethod
    def restore(self, arrays: Arrays) -> Self:
        """Take over a learned state.

        Parameters:
            arrays: The state, as `arrays()` of a fitted model gives it.

        Returns:
            The model itself.
        """


def spelled(predictors: tuple[Predictor, ...]) -> Texts:
    """Names, units and levels as text (d,), to be stored beside what was learned from them.

    Parameters:
        predictors: What a model learns from, in its order.
    """
    return np.array(
        [f"{p.name} [{p.unit}] {'|'.join(p.levels)}".strip() for p in predictors], dtype=np.str_
    )


def check_same_predictors(inputs: Inputs, learned: Texts) -> None:
    """Refuse inputs that a model cannot be asked with.

    Parameters:
        inputs: The impacts that the model is asked about.
        learned: The predictors (d,) that it learned from, as `spelled` gives them.

    Raises:
        ValueError: For other predictors than learned, which it names, and for values that are not
            finite.
    """
    given = spelled(inputs.predictors)
    if not np.array_equal(given, learned):
        other = sorted(set(given.tolist()) ^ set(learned.tolist())) or ["their order"]
        raise ValueError(f"the model learned from other predictors; different: {', '.join(other)}")
    check_finite(inputs)


def check_finite(inputs: Inputs) -> None:
    """Refuse values of predictors that are not finite.

    Parameters:
        inputs: The impacts that a model is asked about.

    Raises:
        ValueError: For such a value, with the predictor's name, the value and the row.
    """
    rows, columns = np.nonzero(~np.isfinite(inputs.x))
    if len(rows):
        name = inputs.predictors[columns[0]].name
        value = inputs.x[rows[0], columns[0]]
        raise ValueError(
            f"predictor {name!r} is {value} in row {rows[0]}: every predictor "
            f"must be a finite number"
        )


def momentum(inputs: Inputs) -> Floats:
    """The impactor's mass times its velocity (n,), kg m/s.

    Parameters:
        inputs: The impacts. The mass is the predictor `bullet_mass` where there is one, else that
            of the bench.

    Raises:
        ValueError: Where mass or velocity is unknown or not positive.
    """
    names = [predictor.name for predictor in inputs.predictors]
    mass = inputs.column("bullet_mass") if "bullet_mass" in names else inputs.impactor_mass_kg
    if not np.all(mass > 0):
        row = int(np.flatnonzero(~(mass > 0))[0])
        raise ValueError(
            f"the impactor's mass is {mass[row]} kg in row {row}: give it in "
            f"campaign.toml, [bench.hammer] mass_kg"
        )
    velocity = inputs.column("impact_velocity")
    if not np.all(velocity > 0):
        row = int(np.flatnonzero(~(velocity > 0))[0])
        raise ValueError(
            f"predictor 'impact_velocity' is {velocity[row]} m/s in row "
            f"{row}: an impact needs more than 0"
        )
    return np.asarray(mass * velocity)


#: Integral over the contact's phase from 0 to 1 by trapezoids, as weights of the points (20,).
WEIGHTS: Floats = np.full(POINTS, 1.0 / (POINTS - 1))
WEIGHTS[[0, -1]] /= 2


#: A momentum bound lies this far above the greatest impulse measured.
MARGIN = 1.05


def impulse(force_n: Floats, contact_time_s: Floats) -> Floats:
    """The impulses (n,) of pulses, N s.

    Parameters:
        force_n: Forces (n, 20) at equidistant points of the contact, both ends included.
        contact_time_s: The duration (n,) of each contact.
    """
    return np.asarray(force_n @ WEIGHTS * contact_time_s)


def positive_times(time: Floats, shortest: float) -> Floats:
    """Contact times that are positive. A regression may say zero or less; a contact lasts at least
    a tenth of the shortest one learned.

    Parameters:
        time: Contact times of a regression in s, of any shape.
        shortest: The shortest contact time in s of the pulses that it learned from.
    """
    return np.maximum(time, 0.1 * shortest)


def positive_pulses(force_n: Floats, faintest: float) -> Floats:
    """Pulses that push at least a little. A pulse whose mean force is below a thousandth of the
    faintest one learned is cut off at zero, and raised to that thousandth at its inner points. All
    others stay as the regression gave them.

    Parameters:
        force_n: Forces (n, 20) of a regression at equidistant points of the contact.
        faintest: The smallest mean force in N of the pulses that it learned from
            (`faintest_mean_force`).
    """
    least = 1e-3 * faintest
    raised = np.maximum(force_n, 0.0)
    raised[:, 1:-1] = np.maximum(raised[:, 1:-1], least)
    return np.where((force_n @ WEIGHTS < least)[:, None], raised, force_n)


def faintest_mean_force(pulses: PulseTable) -> float:
    """The smallest mean force of measured pulses, N.

    Parameters:
        pulses: Measured pulses.

    Raises:
        ValueError: For a measured pulse whose mean force is not positive.
    """
    mean = pulses.force_n @ WEIGHTS
    if not np.all(mean > 0):
        row = int(np.flatnonzero(~(mean > 0))[0])
        raise ValueError(
            f"pulse {pulses.key[row]} has a mean force of {mean[row]:g} N: it "
            f"cannot be learned from"
        )
    return float(mean.min())


_P = TypeVar("_P", Estimator, ContactModel)


def own(part: _P) -> _P:
    """A copy to learn with, so that what the constructor was given stays as it was given.

    Parameters:
        part: An estimator or model that was given to the constructor of another.
    """
    return copy.deepcopy(part)


def prefixed(prefix: str, arrays: Arrays) -> Arrays:
    """Arrays of a part of a model, by names that begin with the part's: the inverse of `restored`.

    Parameters:
        prefix: The name of the part, such as "force".
        arrays: What the part has learned.
    """
    return {f"{prefix}.{name}": array for name, array in arrays.items()}


def restored(part: _P, prefix: str, arrays: Arrays) -> _P:
    """A copy of a part of a model that has learned what stands under the part's name.

    Parameters:
        part: The part as the constructor was given it.
        prefix: The name of the part, such as "force".
        arrays: What the whole model has learned, with the names of `prefixed`.
    """
    begin = f"{prefix}."
    own_arrays = {
        name.removeprefix(begin): array for name, array in arrays.items() if name.startswith(begin)
    }
    return own(part).restore(own_arrays)


def get_array(arrays: Arrays, name: str, kind: str) -> Any:
    """An array of a model that is restored.

    Parameters:
        arrays: What the model has learned, by name.
        name: The name of the array.
        kind: What the model is called in the message.

    Raises:
        ValueError: Where the array is missing.
    """
    if name not in arrays:
        raise ValueError(
            f"a model of kind {kind!r} is restored from arrays with {name!r}, which is missing"
        )
    return arrays[name]


def residual_correlation(residual: Floats) -> Floats:
    """The correlation (m, m) between the deviations of outputs: regressions give each output's
    spread alone, yet the deviations of one pulse go together. Outputs that never deviate are
    correlated with none.

    Parameters:
        residual: The deviations (n, m) of each measurement from what was predicted of it.
    """
    centred = residual - residual.mean(axis=0)
    width = np.sqrt((centred * centred).mean(axis=0))
    scaled = centred / np.where(width > 0, width, np.inf)
    correlation = np.asarray(scaled.T @ scaled / len(residual))
    np.fill_diagonal(correlation, 1.0)
    return correlation


def propagate_spread(jacobian: Floats, spread: Floats, correlation: Floats) -> Floats:
    """Standard deviations (n, p) of p functions of m outputs.

    Parameters:
        jacobian: The derivatives (n, p, m) of the functions by the outputs.
        spread: The standard deviations (n, m) of the outputs.
        correlation: The coefficients (m, m) between the outputs, as `residual_correlation` gives
            them.
    """
    parts = jacobian * spread[:, None, :]
    variance = np.einsum("npm,npm->np", parts @ correlation, parts)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def correlation_with(jacobian: Floats, spread: Floats, correlation: Floats, output: int) -> Floats:
    """The correlation (n,) of a function of m outputs with one of them; 0 where either has no
    spread.

    Parameters:
        jacobian: The derivatives (n, m) of the function by the outputs.
        spread: The standard deviations (n, m) of the outputs.
        correlation: The coefficients (m, m) between the outputs, as `residual_correlation` gives
            them.
        output: The position of the one output, from 0.
    """
    parts = jacobian * spread
    variance = np.einsum("nm,nm->n", parts @ correlation, parts)
    together = parts @ correlation[:, output]
    width = np.sqrt(np.maximum(variance, 0.0))
    scaled = (width > 0) & (spread[:, output] > 0)
    return np.asarray(
        np.clip(np.divide(together, width, out=np.zeros_like(width), where=scaled), -1.0, 1.0)
    )
