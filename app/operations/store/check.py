"""A store with all that belongs to it, checked: frozen datasets read back as they were frozen, and
registered models can be loaded from the files that were registered."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from sqlalchemy.orm import Session

from ....dataset.catalog import list_snapshots
from ....dataset.snapshot import SourceDeletedError, read_snapshot
from ....schema.integrity.checking import checks, iter_findings
from ....schema.integrity.findings import IntegrityFinding
from ....schema.listings import get_campaign_id
from ....schema.rows import Progress
from ....schema.session import Store
from ...common.model_registry import models_extra, registry_of

if TYPE_CHECKING:
    from ....training.registry.registry import Registry


ADVICE = (
    "build it under another name (pyroshock dataset build), or restore the store from its backup"
)


def damaged_datasets(session: Session) -> Iterator[IntegrityFinding]:
    """Datasets whose rows no longer give the hash that they were frozen with, and no tombstone says
    why."""
    for snapshot in list_snapshots(session):
        try:
            read_snapshot(session, snapshot["name"])
        except SourceDeletedError:
            continue  # `datasets_without_source` tells of it
        except (ValueError, LookupError) as error:
            yield IntegrityFinding("datasets", str(error), ADVICE, {"dataset": snapshot["name"]})


def datasets_without_source(session: Session) -> Iterator[str]:
    """Datasets that lost pulses because what they stood on was deleted: which, when and why. They
    are no damage."""
    for snapshot in list_snapshots(session):
        try:
            read_snapshot(session, snapshot["name"])
        except SourceDeletedError as error:
            yield str(error)
        except (ValueError, LookupError):
            continue


def damaged_models(registry: Registry) -> Iterator[IntegrityFinding]:
    """Versions whose model or held-out predictions are missing or damaged; a registry that nobody
    made has none."""
    from ....training.registry.intact_models import damages

    versions = {version.run_id: version for version in registry.versions()}
    for run, what in damages(registry, versions.values()).items():
        version = versions[run]
        again = (
            f"pyroshock train {version.dataset.name} --models {version.name} "
            f"--split {version.split}"
        )
        yield IntegrityFinding("models", what, f"train it anew: {again}", {"model": version.label})


def lost_models(session: Session, registry: Registry) -> Iterator[IntegrityFinding]:
    """Versions that the store lists and the registry does not have."""
    from ...common.registered_models import CURE, lost_versions

    for row in lost_versions(session, registry):
        what = (
            f"version {row.label} of dataset {row.dataset!r} is not in the "
            f"registry {registry.place.shown}"
        )
        yield IntegrityFinding("models", what, CURE, {"model": row.label})


def findings_of(
    store: Store,
    url: str,
    campaign: str | None = None,
    *,
    fast: bool = False,
    progress: Progress | None = None,
) -> Iterator[IntegrityFinding]:
    """What is wrong with the store at `url`; nothing for a sound one.

    `fast` leaves out what every byte must be read for, `campaign` all that is not its own. Raises
    `LookupError` for an unknown campaign.
    """
    with store.reading() as session:
        key = None if campaign is None else get_campaign_id(session, campaign)
        chosen = checks(fast=fast, of_a_campaign=key is not None)
        yield from iter_findings(session.connection(), chosen, key, progress)
        if fast or key is not None:
            return
        yield from damaged_datasets(session)
        registry = registry_of(url)
        with models_extra():
            yield from lost_models(session, registry)
    with models_extra():
        yield from damaged_models(registry)
