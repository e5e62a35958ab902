"""Frozen datasets read back as they were frozen."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy.orm import Session

from ...dataset.catalog import list_snapshots
from ...dataset.snapshot import SourceDeletedError, read_snapshot
from ...schema.integrity.findings import IntegrityFinding

ADVICE = "build it under another name (pyroshock dataset build), or restore the store from its backup"


def damaged_datasets(session: Session) -> Iterator[IntegrityFinding]:
    """Datasets whose rows no longer give the hash that they were frozen with, and no tombstone says why."""
    for snapshot in list_snapshots(session):
        try:
            read_snapshot(session, snapshot["name"])
        except SourceDeletedError:
            continue  # `datasets_without_source` tells of it
        except (ValueError, LookupError) as error:
            yield IntegrityFinding("datasets", str(error), ADVICE, {"dataset": snapshot["name"]})


def datasets_without_source(session: Session) -> Iterator[str]:
    """Datasets that lost pulses because what they stood on was deleted: which, when and why. They are no damage."""
    for snapshot in list_snapshots(session):
        try:
            read_snapshot(session, snapshot["name"])
        except SourceDeletedError as error:
            yield str(error)
        except (ValueError, LookupError):
            continue
