"""A store with all that belongs to it, checked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...schema.integrity.checking import checks, iter_findings
from ...schema.integrity.findings import IntegrityFinding
from ...schema.listings import get_campaign_id
from ...schema.rows import Progress
from ...schema.session import Store
from ..models.training import models_extra, registry_of
from .datasets import damaged_datasets
from .models import damaged_models


@dataclass(frozen=True)
class Wanted:
    """What to look at: `fast` leaves out what every byte must be read for, `campaign` all that is not its own."""

    campaign: str | None = None
    fast: bool = False


def findings_of(store: Store, url: str, wanted: Wanted, progress: Progress | None = None) -> Iterator[IntegrityFinding]:
    """What is wrong with the store at `url`; nothing for a sound one. Raises `LookupError` for an unknown campaign."""
    with store.reading() as session:
        key = None if wanted.campaign is None else get_campaign_id(session, wanted.campaign)
        chosen = checks(fast=wanted.fast, of_a_campaign=key is not None)
        yield from iter_findings(session.connection(), chosen, key, progress)
        if wanted.fast or key is not None:
            return
        yield from damaged_datasets(session)
    with models_extra():
        yield from damaged_models(registry_of(url))
