"""Every table, imported once so that `Base.metadata` is complete."""

from __future__ import annotations

from . import (
    benches,
    campaigns,
    datasets,
    diagnoses,
    impacts,
    materials,
    plans,
    provenance,
    quality,
    recordings,
    shots,
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
    "materials",
    "metadata",
    "plans",
    "provenance",
    "quality",
    "recordings",
    "shots",
    "twins",
]
