"""Models on configurations that they have not learned from: what decides which one the twin uses.

The configurations of a dataset are dealt into folds. Each fold's pulses are predicted by models
that learned from none of its configurations, and scored by the continuous ranked probability score
of what the twin predicts of a contact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import PulseTable, concatenate
from ...twin.contact_interface import ForcePulses
from ...twin.prediction import stratified_normals
from ..models.base import ContactModel, momentum
from ..models.prior_pulses import (
    prior_contact,
    prior_pulses,
    random_pulses,
    updated_contact,
    velocity_before,
)
from ..tuning.folds import grouped_folds
from .summary import ensemble_crps
from .unseen_scores import UnseenScores

FOLDS, DRAWS = 5, 64
#: So many pulses are scored, the same number of each configuration: more hardly change a mean over
#: configurations.
_MOST_PULSES = 400
#: A factor of a thousand: an error beyond it counts as this one, so that a single pulse without
#: force is no verdict.
_FARTHEST = float(np.log(1000.0))

#: Random pulses of all rows for each draw; the rows are of configurations that nothing was learned
#: from.
PulseDraws = Callable[[PulseTable, int, np.random.Generator], list[ForcePulses]]


def unseen_scores(
    pulses: PulseTable, predictions: Mapping[str, PulseDraws], rng: np.random.Generator
) -> UnseenScores:
    """Score predictions by name on the same pulses; each fold of configurations is predicted at
    once.

    Raises `ValueError` where the pulses are of a single configuration or a prediction is not
    finite, and what the predictions raise.
    """
    folds = grouped_folds(pulses.configuration, FOLDS, rng)
    chosen = _some_repetitions(pulses.configuration, rng)
    rows: list[NDArray[np.intp]] = []
    crps: dict[str, list[Floats]] = {name: [] for name in predictions}
    inside: dict[str, list[NDArray[np.bool_]]] = {name: [] for name in predictions}
    for fold in folds:
        part = np.flatnonzero(fold & chosen)
        rows.append(part)
        unseen = pulses.take(part)
        measured = np.log(
            np.stack([unseen.peak_force_n, unseen.contact_time_s, unseen.impulse_n_s], axis=1)
        )
        for name, draws in predictions.items():
            scores, holds = _scored(draws(unseen, DRAWS, rng), measured)
            crps[name].append(scores)
            inside[name].append(holds)
            if not np.isfinite(crps[name][-1]).all():
                raise ValueError(
                    f"{name} predicts no finite pulse of some configurations that it has not seen"
                )
    order = np.concatenate(rows)
    return UnseenScores(
        names=tuple(predictions),
        crps=tuple(np.concatenate(parts) for parts in crps.values()),
        inside=tuple(np.concatenate(parts) for parts in inside.values()),
        configuration=pulses.configuration[order],
        folds=len(folds),
    )


def unseen_draws(
    model: ContactModel, learned: PulseTable, velocity_kind: str | None = None
) -> PulseDraws:
    """Of a model that learned from `learned`, with velocities of this kind
    (`schema.velocity_kinds`): refitted without the configurations that it is asked for."""

    def draws(unseen: PulseTable, count: int, rng: np.random.Generator) -> list[ForcePulses]:
        fitted = without_configurations(model, learned, unseen.configuration.tolist(), rng)
        prediction = fitted.predict(unseen.inputs)
        z = np.stack([stratified_normals(count, 2, rng) for _ in range(len(unseen))], axis=1)
        before = (
            momentum(unseen)
            * velocity_before(unseen, velocity_kind)[0]
            / unseen.column("impact_velocity")
        )
        return [random_pulses(prediction, z[draw], before) for draw in range(count)]

    return draws


def without_configurations(
    model: ContactModel,
    learned: PulseTable,
    configurations: Sequence[str],
    rng: np.random.Generator,
) -> ContactModel:
    """The model as it is where it learned from none of these configurations; else one that is
    learned and tuned anew from its other pulses, with the bands that these calibrate. Raises
    `ValueError` where nothing is left to learn from."""
    left_out = np.isin(learned.configuration, list(configurations))
    if not left_out.any():
        return model
    if left_out.all():
        raise ValueError(
            "a model cannot be refitted without all configurations that it has learned from"
        )
    return model.relearn(learned.take(~left_out), rng)


def updated_law_draws(
    learned: PulseTable, plates: PulseTable, velocity_kind: str | None = None
) -> PulseDraws:
    """Of what answers without a model: the contact law updated by `learned`, but for the pulses of
    the configurations that it is asked for; velocities are of this kind. All judged pulses are
    `plates`: they tell what lies below anvils (`prior_pulses.settings_of`), beside those of
    `learned`."""
    bare = concatenate([plates, learned])

    def draws(unseen: PulseTable, count: int, rng: np.random.Generator) -> list[ForcePulses]:
        others = learned.take(~np.isin(learned.configuration, unseen.configuration))
        contact = updated_contact(others, velocity_kind, bare)
        return prior_pulses(contact, unseen, count, rng, velocity_kind, bare)

    return draws


def prior_draws(plates: PulseTable, velocity_kind: str | None = None) -> PulseDraws:
    """Of the contact before anything was learned; `plates` as in `updated_law_draws`."""
    return lambda unseen, count, rng: prior_pulses(
        prior_contact(unseen), unseen, count, rng, velocity_kind, plates
    )


def _scored(draws: Sequence[ForcePulses], measured: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """CRPS (n, 3) of random pulses in natural logarithms, and which measured values (n, 3) lie in
    their 90 % band."""
    values = [
        np.stack([pulses.peak_force_n, pulses.contact_time_s, pulses.impulse_n_s], axis=1)
        for pulses in draws
    ]
    logarithms = np.log(np.maximum(np.stack(values), np.finfo(np.float64).tiny))
    logarithms = np.clip(logarithms, measured - _FARTHEST, measured + _FARTHEST)
    crps = np.stack(
        [ensemble_crps(logarithms[..., i], measured[:, i]) for i in range(measured.shape[1])],
        axis=1,
    )
    low, high = np.quantile(
        logarithms, [0.05, 0.95], axis=0, method="hazen"
    )  # as a prediction states its bands
    return crps, np.asarray((low <= measured) & (measured <= high))


def _some_repetitions(
    configuration: NDArray[np.str_], rng: np.random.Generator
) -> NDArray[np.bool_]:
    """At most `_MOST_PULSES` pulses, as many of each configuration; all where there are no more."""
    _, group, sizes = np.unique(configuration, return_inverse=True, return_counts=True)
    most = max(1, _MOST_PULSES // len(sizes))
    order = rng.permutation(len(configuration))
    place = np.empty(len(configuration), dtype=np.intp)
    counts = np.zeros(len(sizes), dtype=np.intp)
    for row in order:
        place[row] = counts[group[row]]
        counts[group[row]] += 1
    return np.asarray(place < most)
