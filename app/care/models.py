"""Registered models can be loaded: their files are there, and are those that were registered."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...schema.integrity.findings import IntegrityFinding

if TYPE_CHECKING:
    from ...training.registry.registry import Registry


def damaged_models(registry: Registry) -> Iterator[IntegrityFinding]:
    """Versions whose model or held-out predictions are missing or damaged; a registry that nobody made has none."""
    from ...training.registry.intact_models import damages

    versions = {version.label: version for version in registry.versions()}
    for label, what in damages(registry, versions.values()).items():
        version = versions[label]
        again = f"pyroshock train {version.dataset.name} --models {version.name} --split {version.split}"
        yield IntegrityFinding("models", what, f"train it anew: {again}", {"model": label})
