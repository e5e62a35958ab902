"""The repeatability floor of a split, as the registry keeps it beside the models."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from ..dataset.splits import split_of
from ..dataset.table import PulseTable
from .floor import Scope, repeatability_floor
from .metrics.summary import Estimate, summary
from .tasks import rng_of

SCOPES: tuple[Scope, ...] = ("configuration", "treatment")


def floor_text(table: PulseTable, dataset_hash: str, split_text: str, seed: int) -> str:
    """JSON: by scope ("configuration", "treatment") the floor's metrics and a note on how it was found.

    A scope without repetitions has its reason as note, and no metrics.
    """
    split = split_of(table, split_text, seed)
    training, held_out = table.take(split.train), table.take(split.test)
    floors_by_scope: dict[str, Any] = {}
    for scope in SCOPES:
        try:
            floor = repeatability_floor(training, held_out, scope)
        except ValueError as error:
            floors_by_scope[scope] = {"metrics": {}, "note": str(error)}
            continue
        rng = rng_of("bootstrap", dataset_hash, split_text, seed)
        estimates = summary(floor.errors, held_out.configuration[floor.rows], rng)
        floors_by_scope[scope] = {
            "metrics": {name: asdict(estimate) for name, estimate in estimates.items()},
            "note": floor.note,
        }
    return json.dumps(floors_by_scope)


def floor_metrics(text: str, scope: str) -> Mapping[str, Estimate]:
    """The metrics of one scope from `floor_text`."""
    return {name: Estimate(**estimate) for name, estimate in json.loads(text)[scope]["metrics"].items()}
