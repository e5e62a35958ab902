"""The store's list of registered versions: brought up to date after a training, held against the
registry, and used to register surviving files again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from ...schema.registered_models import RegisteredVersion
from ...schema.session import Store, StoreError, Writer, open_store
from ...training.registry.tags import PREFIX

if TYPE_CHECKING:
    from ...training.registry.registry import Registry

CURE = (
    "restore the registry (pyroshock db restore), name it in MLFLOW_TRACKING_URI, or register the "
    "surviving files again: pyroshock models recover"
)


def note_registered(store: Store, registry: Registry) -> int:
    """Add the versions of the registry that the store does not list; how many. Safe to repeat."""
    records = sorted(registry.recorded(), key=lambda record: (record["name"], record["version"]))

    def add(session: Session) -> int:
        query = select(RegisteredVersion.label, RegisteredVersion.sha256)
        existing = {tuple(row) for row in session.execute(query)}
        rows = [_row(record, registry.place.shown) for record in records]
        new = [row for row in rows if (row.label, row.sha256) not in existing]
        session.add_all(new)
        return len(new)

    return store.write(add, idempotent=True) if records else 0


def _row(record: dict[str, Any], registry: str) -> RegisteredVersion:
    tags = record["tags"]
    return RegisteredVersion(
        label=f"{record['name']}@{record['version']}",
        name=record["name"],
        version=record["version"],
        dataset=tags[PREFIX + "dataset"],
        dataset_hash=tags[PREFIX + "dataset_hash"],
        sha256=tags[PREFIX + "sha256"],
        registry_address=registry,
        registered_at=record["registered_at"],
        record={key: record[key] for key in ("run_id", "model_id", "tags")},
    )


def lost_versions(session: Session, registry: Registry) -> list[RegisteredVersion]:
    """Versions that the store lists and the registry does not have, the first registered first."""
    rows = session.scalars(select(RegisteredVersion).order_by(RegisteredVersion.id)).all()
    if not rows:
        return []
    present = {record["tags"][PREFIX + "sha256"] for record in registry.recorded()}
    return [row for row in rows if row.sha256 not in present]


def lost_words(rows: Sequence[RegisteredVersion], registry: Registry) -> str:
    """One line of what is lost and its cure; empty for none."""
    if not rows:
        return ""
    labels = ", ".join(row.label for row in rows[:5]) + (
        f" and {len(rows) - 5} more" if len(rows) > 5 else ""
    )
    return (
        f"the registry {registry.place.shown} has lost {labels}, which this store "
        f"registered; {CURE}"
    )


def lost_at(url: str, registry: Registry) -> str:
    """`lost_words` of the store at an address; empty where there is no store that can be read."""
    try:
        with open_store(url, Writer("models", "")) as store, store.reading() as session:
            return lost_words(lost_versions(session, registry), registry)
    except StoreError:
        return ""


def forget_registered(url: str, label: str) -> None:
    """A version that was deleted in its registry is not lost."""
    try:
        with open_store(url, Writer("models delete", "")) as store:
            gone = delete(RegisteredVersion).where(RegisteredVersion.label == label)
            store.write(lambda session: session.execute(gone), idempotent=True)
    except StoreError:
        return


def recover_lost(store: Store, registry: Registry) -> Iterator[tuple[str, str]]:
    """Register the surviving files of each lost version again: its label, and the new one or why
    not."""
    from ...training.registry.recovery import RecoveryError, recover

    with store.reading() as session:
        wanted = [
            (row.label, row.name, row.version, row.record)
            for row in lost_versions(session, registry)
        ]
    for label, name, version, record in sorted(wanted, key=lambda item: (item[1], item[2])):
        try:
            yield label, f"registered again as {recover(registry, name, version, record)}"
        except RecoveryError as error:
            yield label, f"not registered again: {error}"
    note_registered(store, registry)
