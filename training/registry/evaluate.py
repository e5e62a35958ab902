"""Models beside each other: their errors on held-out pulses that none of them was trained on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...dataset.table import PulseTable
from ..evaluation.comparison import Comparison, compare, comparison_groups
from ..evaluation.metrics import PulseErrors, pulse_errors
from ..models.base import ContactPrediction
from ..models.training_task import rng_of
from .records import HeldOutPredictions, Version
from .registry import Registry


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Errors by label ("hybrid@3") on the same `pulses`, row by row; `outside` counts those beyond
    a model's domain."""

    pulses: PulseTable
    errors: dict[str, PulseErrors]
    predictions: dict[str, ContactPrediction]
    outside: dict[str, int]


def evaluate_held_out(
    registry: Registry, versions: Sequence[Version], read: Callable[[str], PulseTable]
) -> Evaluation:
    """Errors of models on the held-out pulses that all of them have in common.

    What a model held out it was not trained on, so neither was any other on what they have in
    common.

    Parameters:
        registry: Where the versions are registered.
        versions: What is compared, as `Registry.versions` lists it.
        read: Gives the pulses of a dataset by its hash.

    Raises:
        ValueError: Where there are no pulses in common, and where no dataset has them all as they
            were.
    """
    held_out = {version.label: registry.held_out(version) for version in versions}
    common: set[str] = set.intersection(
        *(set(predicted.keys.tolist()) for predicted in held_out.values())
    )
    if not common:
        raise ValueError(
            f"{' and '.join(held_out)} have no held-out pulse in common: compare models of one "
            "dataset and split, or judge them on another campaign (promote --on)"
        )
    pulses = _pulses_of(versions, common, read)
    predictions = {label: _in_order(predicted, pulses.key) for label, predicted in held_out.items()}
    errors = {label: pulse_errors(pulses, prediction) for label, prediction in predictions.items()}
    return Evaluation(pulses, errors, predictions, dict.fromkeys(predictions, 0))


def evaluate_on_table(
    registry: Registry, versions: Sequence[Version], pulses: PulseTable
) -> Evaluation:
    """Errors of models on other pulses, of which those count that none of them was trained on.

    Parameters:
        registry: Where the versions are registered.
        versions: What is compared, as `Registry.versions` lists it.
        pulses: The measured pulses, such as those of another campaign.

    Raises:
        ValueError: Where all pulses were trained on.
    """
    trained_on = [registry.held_out(version).trained_on for version in versions]
    fresh = ~np.isin(pulses.key, np.concatenate(trained_on))
    if not fresh.any():
        raise ValueError(
            f"all {len(pulses)} pulses were trained on by {' or '.join(v.label for v in versions)}"
        )
    pulses = pulses.take(fresh)
    answers = {version.label: registry.load(version).predict(pulses.inputs) for version in versions}
    predictions = {label: answer.prediction for label, answer in answers.items()}
    outside = {label: sum(map(bool, answer.outside)) for label, answer in answers.items()}
    errors = {label: pulse_errors(pulses, prediction) for label, prediction in predictions.items()}
    return Evaluation(pulses, errors, predictions, outside)


def compared(judged: Evaluation, a: str, b: str, groups: bool = False) -> Comparison:
    """Two of the judged models beside each other. The draws depend on which models are compared, so
    that the same comparison gives the same numbers again.

    Parameters:
        judged: The errors of the models on common pulses.
        a: The label of the first model, such as "hybrid@3".
        b: The label of the second model.
        groups: Whether they are also compared by the groups of `comparison_groups`; by default only
            over all pulses.
    """
    pulses = judged.pulses
    rows_by_group = comparison_groups(pulses) if groups else {}
    rng = rng_of("compare", pulses.key[0], "-".join(sorted((a, b))), len(pulses))
    return compare(
        judged.errors[a], judged.errors[b], pulses.configuration, rows_by_group, rng, names=(a, b)
    )


def _pulses_of(
    versions: Sequence[Version], keys: set[str], read: Callable[[str], PulseTable]
) -> PulseTable:
    """The pulses of these keys, from the first dataset that has them all."""
    for dataset_hash in dict.fromkeys(version.dataset.hash for version in versions):
        table = read(dataset_hash)
        rows = np.flatnonzero(np.isin(table.key, list(keys)))
        if len(rows) == len(keys):
            return table.take(rows)
    raise ValueError(
        f"{len(keys)} held-out pulses are in no dataset of the store as they "
        f"were: restore the store"
    )


def _in_order(held_out: HeldOutPredictions, keys: NDArray[np.str_]) -> ContactPrediction:
    """The stored predictions, in the order of `keys`."""
    place = {key: row for row, key in enumerate(held_out.keys.tolist())}
    rows = np.array([place[key] for key in keys.tolist()])
    p = held_out.prediction
    return ContactPrediction(
        p.force_n[rows],
        p.contact_time_s[rows],
        None if p.force_spread_n is None else p.force_spread_n[rows],
        None if p.contact_time_spread_s is None else p.contact_time_spread_s[rows],
    )
