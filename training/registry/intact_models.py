"""Versions whose files are those written, told from those whose files are gone or changed."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from .records import Version
from .registry import Registry


def damages(registry: Registry, versions: Iterable[Version]) -> dict[str, str]:
    """Run of the training -> what is wrong, of those whose files are not whole."""
    damages = ((version.run_id, registry.damage(version)) for version in versions)
    return {run: wrong for run, wrong in damages if wrong is not None}


def intact_versions(
    registry: Registry, versions: Iterable[Version], tell: Callable[[str], None] = lambda _: None
) -> list[Version]:
    """Those whose files are whole; `tell` is told of each other one that it is left out, and
    why."""
    every = list(versions)
    wrong = damages(registry, every)
    for version in every:
        if version.run_id in wrong:
            tell(f"{version.label} is left out: {wrong[version.run_id]}")
    return [version for version in every if version.run_id not in wrong]
