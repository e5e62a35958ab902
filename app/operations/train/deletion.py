"""Datasets and models deleted, as long as nothing needs them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....dataset.catalog import get_snapshot_row
from ....dataset.deletion import delete_snapshot
from ...common.model_registry import models_extra, registry_of
from ...common.registered_models import forget_registered

if TYPE_CHECKING:
    from ....schema.session import Store
    from ....training.registry.records import Version

#: So many things are named in an error.
_NAMED = 8


class InUseError(ValueError):
    """Something needs what is to be deleted; the message says what, and what to do first."""


def versions_of_dataset(store: Store, url: str, name: str) -> list[Version]:
    """The versions that were trained on the dataset of this name or hash, each once.

    Raises `LookupError` for an unknown dataset.
    """
    content_hash = store.read(lambda session: get_snapshot_row(session, name).content_hash)
    with models_extra():
        versions = registry_of(url).versions()
    return [
        version
        for version in versions
        if version.is_served and version.dataset.hash == content_hash
    ]


def check_dataset_unused(store: Store, url: str, name: str) -> None:
    """Raises `LookupError` for an unknown dataset, and `InUseError` where models were trained on
    it.

    `url` is the store's address, beside which the models lie.
    """
    labels = [version.label for version in versions_of_dataset(store, url, name)]
    if labels:
        more = f" and {len(labels) - _NAMED} more" if len(labels) > _NAMED else ""
        raise InUseError(
            f"dataset {name!r} cannot be deleted: {', '.join(labels[:_NAMED])}{more} "
            f"{'was' if len(labels) == 1 else 'were'} trained on it; delete the models first: "
            f"pyroshock models delete {labels[0]}"
        )


def delete_dataset(store: Store, url: str, name: str) -> None:
    """Delete a dataset. Raises as `check_dataset_unused`."""
    check_dataset_unused(store, url, name)
    store.write(lambda session: delete_snapshot(session, name))


def unused_version(url: str, label: str) -> Version:
    """The version that "hybrid@3" names. Raises `LookupError` for an unknown one, `InUseError` for
    the one in use."""
    from ....training.registry.listing import chosen

    if "@" not in label:
        raise ValueError(f"{label!r} names no version; expected MODEL@VERSION, such as {label}@1")
    with models_extra():
        version = chosen(registry_of(url).versions(), label)
    if version.champion_of is not None:
        raise InUseError(
            f"{version.label} cannot be deleted: it is the model in use for the predictors "
            f"{version.champion_of!r}; promote another model first: pyroshock promote MODEL@VERSION"
        )
    return version


def delete_version(url: str, label: str) -> Version:
    """Delete a version of a model from the registry, and return what it was. Raises as
    `unused_version`."""
    registry = registry_of(url)
    with models_extra(), registry.promoting():
        version = unused_version(url, label)
        registry.delete(version)
    forget_registered(url, version.label)
    return version
