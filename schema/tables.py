"""Every table, imported once so that `Base.metadata` is complete."""

from __future__ import annotations

from . import (
    benches,
    campaigns,
    datasets,
    diagnoses,
    impacts,
    jobs,
    materials,
    plans,
    provenance,
    quality,
    recordings,
    shots,
    tombstones,
    twins,
)
from .base import Base

metadata = Base.metadata

__all__ = [
    "benches",
    "campaigns",
    "datasets",
    "diagnoses",
    "impacts",
    "jobs",
    "materials",
    "metadata",
    "plans",
    "provenance",
    "quality",
    "recordings",
    "shots",
    "tombstones",
    "twins",
]
