"""Versions whose files are those written, told from those whose files are gone or changed."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from .records import Version
from .registry import Registry


def damages(registry: Registry, versions: Iterable[Version]) -> dict[str, str]:
    """Label ("hybrid@3") -> what is wrong, of those whose files are not whole."""
    damages = ((version.label, registry.damage(version)) for version in versions)
    return {label: wrong for label, wrong in damages if wrong is not None}


def intact_versions(
    registry: Registry, versions: Iterable[Version], tell: Callable[[str], None] = lambda _: None
) -> list[Version]:
    """Those whose files are whole; `tell` is told of each other one that it is left out, and why."""
    every = list(versions)
    wrong = damages(registry, every)
    for label, what in wrong.items():
        tell(f"{label} is left out: {what}")
    return [version for version in every if version.label not in wrong]
