"""Frozen datasets read back as they were frozen."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy.orm import Session

from ...dataset.catalog import list_snapshots
from ...dataset.snapshot import read_snapshot
from ...schema.care.findings import Finding

ADVICE = "build it under another name (pyroshock dataset build), or restore the store from its backup"


def damaged_datasets(session: Session) -> Iterator[Finding]:
    """Datasets whose rows no longer give the hash that they were frozen with."""
    for each in list_snapshots(session):
        try:
            read_snapshot(session, each["name"])
        except (ValueError, LookupError) as error:
            yield Finding("datasets", str(error), ADVICE, {"dataset": each["name"]})
