"""The registry of models as the window asks it: what is there, what is chosen, what is promoted."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from ...schema.session import Store
from ..common.model_registry import models_extra, pulses_on, reader_of, registry_of

if TYPE_CHECKING:
    from ...training.registry.records import Decision, Version
    from ...training.registry.registry import Registry

#: Versions beside each other on one page.
MOST_COMPARED = 8


def registry_at(db: str) -> Registry | None:
    """The registry of a store; None where nothing was trained yet, without a look at MLflow."""
    registry = registry_of(db)
    return None if registry.connection.nothing_there else registry


def needed(db: str) -> Registry:
    """Raises `LookupError` where nothing was trained yet."""
    registry = registry_at(db)
    if registry is None:
        raise LookupError("no model is registered; train some: pyroshock train DATASET")
    return registry


def chosen_versions(registry: Registry, labels: list[str]) -> list[Version]:
    """Versions by their labels. Raises `LookupError` for unknown ones, `ValueError` for too many."""
    from ...training.registry.listing import chosen

    if len(labels) > MOST_COMPARED:
        raise ValueError(f"{len(labels)} versions to compare; expected at most {MOST_COMPARED}")
    every = registry.versions()
    return [chosen(every, label) for label in dict.fromkeys(labels)]


def promote(
    store: Store, db: str, model: str, version: int, *, other: str | None, forced: bool, reason: str
) -> Decision:
    """Promote or refuse, and keep why. Raises as `training.promotion.promote`."""
    from ...training.registry.listing import chosen
    from ...training.registry.promotion import promote as decide

    with models_extra():
        registry = needed(db)
        candidate = chosen(registry.versions(), f"{model}@{version}")
        on = (other, pulses_on(store, other, candidate)) if other else None
        return decide(registry, model, version, reader_of(store), other=on, forced=forced, reason=reason)


def decision_json(decision: Decision) -> dict[str, Any]:
    """As `promote --json`, its time as text."""
    return {**asdict(decision), "when": decision.when.isoformat(timespec="seconds")}
