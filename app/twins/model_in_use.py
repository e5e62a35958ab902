"""The registered model in use for a kind of bench, and what a store knows of a model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...schema.impacts import DatasetSnapshot
    from ...training.registry.records import Version
    from ...training.registry.registry import Registry


def model_in_use(session: Session | None, registry: Registry, bench_kind: str) -> Version | None:
    """Of the champions of all predictor sets for campaigns of this kind ("gun", "hammer"...), the one promoted last."""
    champions = [version for version in registry.versions() if version.champion_of is not None]
    for_kind = [version for version in champions if bench_kind_of(session, version) == bench_kind]
    return max(for_kind, key=lambda version: version.promoted_at, default=None)


def bench_kind_of(session: Session | None, version: Version) -> str | None:
    """The kind of campaigns that a model's predictor set is for; None where neither model nor store tells."""
    from ...dataset.predictors import SHIPPED

    if version.dataset.bench_kind is not None:
        return version.dataset.bench_kind
    if version.dataset.predictor_set in SHIPPED:
        return version.dataset.predictor_set  # a shipped set has the name of its kind
    kind = _definition(session, version).get("kind")
    return None if kind is None else str(kind)


def velocity_kind_of(session: Session | None, version: Version) -> str:
    """The kind of velocity that a model takes; of an older model, that of most impacts of its dataset.

    Where the store has the dataset no more, before contact, as a prediction's is.
    """
    from ...dataset.velocities import kind_of_snapshot
    from ...schema.impacts import BEFORE_CONTACT

    if version.dataset.velocity_kind is not None:
        return version.dataset.velocity_kind
    row = _snapshot(session, version)
    kind = None if session is None or row is None else kind_of_snapshot(session, row.content_hash, row.definition)
    return kind or BEFORE_CONTACT


def training_campaigns(session: Session | None, version: Version) -> tuple[str, ...]:
    """The campaigns whose pulses a model has learned from; none where the store has the dataset no more."""
    return tuple(_definition(session, version).get("campaigns", ()))


def _definition(session: Session | None, version: Version) -> dict[str, Any]:
    row = _snapshot(session, version)
    return {} if row is None else row.definition


def _snapshot(session: Session | None, version: Version) -> DatasetSnapshot | None:
    from sqlalchemy import select

    from ...schema.impacts import DatasetSnapshot

    if session is None:
        return None
    query = select(DatasetSnapshot).where(DatasetSnapshot.content_hash == version.dataset.hash)
    return session.scalars(query).one_or_none()
