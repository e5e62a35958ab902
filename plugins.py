"""Packages of others that add a reader of recordings, an effect of the twin or a model.

A package announces what it adds as entry points of its metadata, in the groups below. Nothing of it
is imported before the family is asked for; then each is loaded once in a process, in the order of
their names and behind what is shipped.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Generic, TypeVar

GROUPS = READERS, EFFECTS, MODELS = "pyroshock.readers", "pyroshock.effects", "pyroshock.models"

Usable = TypeVar("Usable")

_log = logging.getLogger("pyroshock.plugins")


class PluginError(ValueError):
    """Two packages claim one name; the message names both and the cure."""


@dataclass(frozen=True, order=True)
class Plugin:
    """An entry point of an installed package; `target` is "module:object"."""

    group: str
    name: str
    package: str
    version: str
    target: str

    @property
    def words(self) -> str:
        """`effect 'gun.humidity' of humid-gun 1.0`."""
        return f"{self.kind} {self.name!r} of {self.package} {self.version}"

    @property
    def kind(self) -> str:
        """reader, effect or model."""
        return self.group.rpartition(".")[2].removesuffix("s")

    def load(self) -> Any:
        """The object itself; raises whatever the package's own code does."""
        from importlib.metadata import EntryPoint

        return EntryPoint(self.name, self.target, self.group).load()


@dataclass(frozen=True)
class Loaded(Generic[Usable]):
    """What other packages add to one family, by name; `failures` are sentences on those that cannot
    be used."""

    objects: Mapping[str, Usable]
    plugins: Mapping[str, Plugin]
    failures: Mapping[str, str]


@cache
def installed() -> tuple[Plugin, ...]:
    """All entry points of the three groups, by group and name; nothing of them is imported."""
    from importlib.metadata import entry_points

    points = entry_points()
    return tuple(
        sorted(
            Plugin(
                group,
                point.name,
                point.dist.name if point.dist else "an unnamed package",
                point.dist.version if point.dist else "",
                point.value,
            )
            for group in GROUPS
            for point in points.select(group=group)
        )
    )


def list_plugins(group: str) -> list[Plugin]:
    """Those of one group, by name."""
    return [plugin for plugin in installed() if plugin.group == group]


def load(
    group: str, accepted: Callable[[str, Any], Usable], shipped: Collection[str]
) -> Loaded[Usable]:
    """What the packages add to one family. `accepted` gives what is used of a name and an object,
    and raises `TypeError` or `ValueError` for one that does not keep the contract.

    One that cannot be imported or is not accepted is a line of the log and a failure, and the
    others are loaded. Raises `PluginError` for a name that is shipped or is claimed twice.
    """
    plugins = list_plugins(group)
    _refuse_taken_names(plugins, shipped)
    objects: dict[str, Usable] = {}
    failures: dict[str, str] = {}
    for plugin in plugins:
        try:
            objects[plugin.name] = accepted(plugin.name, plugin.load())
        except (Exception, SystemExit) as error:  # noqa: BLE001 - code of others raises anything
            cause = " ".join(f"{type(error).__name__}: {error}".split())
            failures[plugin.name] = f"the {plugin.words} ({plugin.target}) cannot be used: {cause}"
            _warn(failures[plugin.name])
    return Loaded(objects, {plugin.name: plugin for plugin in plugins}, failures)


def _refuse_taken_names(plugins: Collection[Plugin], shipped: Collection[str]) -> None:
    by_name: dict[str, Plugin] = {}
    for plugin in plugins:
        if plugin.name in shipped:
            raise taken(plugin, f"pyroshock has a {plugin.kind} of this name itself")
        if (other := by_name.setdefault(plugin.name, plugin)) is not plugin:
            raise taken(plugin, f"{other.package} {other.version} has one of this name")


def taken(plugin: Plugin, reason: str) -> PluginError:
    """The error on a name or a suffix that somebody has already."""
    return PluginError(
        f"the {plugin.words} has a name that is taken: {reason}; uninstall one of the packages "
        f"(pip uninstall {plugin.package}), or ask its author for another name"
    )


def _warn(sentence: str) -> None:
    """Once, and not by each worker again."""
    from multiprocessing import parent_process

    if parent_process() is None:
        _log.warning("pyroshock: %s", sentence)


def with_packages(version: str) -> str:
    """A version of pyroshock with the packages that add to it: `0.1.0 with humid-gun 1.0`."""
    packages = dict.fromkeys(f"{plugin.package} {plugin.version}" for plugin in installed())
    return f"{version} with {', '.join(sorted(packages))}" if packages else version
