"""Snapshots: a selection of pulses under a name, identified by the hash of its content, frozen.

From a pulse of a dataset back to the raw file that it was cut from.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import func, insert, select
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign
from ..schema.configurations import known_configurations
from ..schema.frozen_facts import FACTS, hit_key, read_frozen_facts
from ..schema.impacts import DatasetSnapshot, ExtractionSettingsRow, Impact, Pulse, SnapshotPulse
from ..schema.recordings import Recording
from ..schema.removal.returning import mark_restored
from ..schema.session import Store
from .build_table import content_hash, member_of, table_of
from .catalog import get_snapshot_row, list_snapshots, source_deleted
from .predictors import PredictorSet, from_json
from .rows import Row, levels_of, rows_of_snapshot
from .selection import FORMAT, DatasetDraft, select_pulses
from .table import PulseTable
from .velocities import converted

_LONGEST_NAME = 200


class SnapshotError(ValueError):
    """A snapshot cannot be made under this name, or does not read back as it was frozen."""


class SourceDeletedError(SnapshotError):
    """A snapshot has lost pulses because what it stood on was deleted, as a tombstone tells."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A frozen dataset. `definition` is plain data: campaigns, predictors, rules, materials, what
    was left out."""

    name: str
    hash: str
    definition: dict[str, Any]
    table: PulseTable

    @property
    def predictors(self) -> PredictorSet:
        return from_json(self.definition["predictors"])


@dataclass(frozen=True, eq=False)
class Built:
    """What `build_snapshot` gives: `added` is False where the store had the content, under whatever
    name."""

    snapshot: Snapshot
    added: bool


def build_snapshot(
    store: Store,
    name: str,
    campaigns: Sequence[str],
    predictors: PredictorSet | None = None,
    quality: str = "reject",
    extraction: str | None = None,
    velocity: str | None = None,
    impacts: Collection[int] | None = None,
) -> Built:
    """Freeze the usable pulses of campaigns.

    The same content again is the snapshot that exists, whatever its name.

    Parameters:
        store: The store of the campaigns, in which the snapshot is kept.
        name: The name of the snapshot, one line of at most 200 characters.
        campaigns: The names of the campaigns, at least one.
        predictors: What models are to learn from; by default the shipped set of the campaigns'
            kind.
        quality: The rule that leaves impacts out by their quality findings: "reject", which is the
            default, "warning" (warnings as well) or "none".
        extraction: The fingerprint of the extraction whose pulses are taken, or the start of it; by
            default the pulses in use.
        velocity: The kind that velocities are converted to, one of `velocities.CHOICES`; by default
            they are not converted, and must be of one kind.
        impacts: The keys of the impacts that the pulses are limited to; by default all.

    Raises:
        SnapshotError: Where the name is taken by other content, or is no name.
        LookupError: For an unknown campaign or extraction.
        ValueError: For campaigns that do not fit the predictors or have no usable pulse, for
            velocities of several kinds, and for an unknown rule.
    """
    _check_name(name)
    with store.reading() as session:
        draft = select_pulses(
            session, campaigns, predictors, quality, extraction, velocity, impacts
        )
    digest = content_hash(draft.predictors, draft.table)

    def freeze(session: Session) -> _Known | None:
        # Another process may be building it too: the loser of the race is run again, and finds it.
        existing = _find_snapshot(session, name, digest)
        if existing is None:
            _add(store, session, name, digest, draft)
        else:
            _fill_up(store, session, existing, digest, draft)
        return existing

    existing = store.write(freeze, idempotent=True)
    if existing is None:
        return Built(Snapshot(name, digest, draft.definition, draft.table), added=True)
    return Built(Snapshot(existing.name, digest, existing.definition, draft.table), added=False)


def _check_name(name: str) -> None:
    if not name or name != name.strip() or not name.isprintable() or len(name) > _LONGEST_NAME:
        raise SnapshotError(
            f"dataset name is {name!r}; expected one line of at most {_LONGEST_NAME} characters"
        )


@dataclass(frozen=True)
class _Known:
    key: int
    name: str
    definition: dict[str, Any]


def _find_snapshot(session: Session, name: str, digest: str) -> _Known | None:
    """The snapshot of this content. Raises `SnapshotError` where there is none and the name is
    taken."""
    same = session.scalars(
        select(DatasetSnapshot).where(DatasetSnapshot.content_hash == digest)
    ).one_or_none()
    if same is not None:
        return _Known(same.id, same.name, same.definition)
    taken = session.scalar(select(DatasetSnapshot.content_hash).where(DatasetSnapshot.name == name))
    if taken is not None:
        raise SnapshotError(
            f"dataset {name!r} is frozen with other content (hash {taken[:12]}, not "
            f"{digest[:12]}); build this one under another name"
        )
    return None


def _add(store: Store, session: Session, name: str, digest: str, draft: DatasetDraft) -> None:
    now = datetime.now(UTC)
    row = DatasetSnapshot(
        name=name, content_hash=digest, frozen_at=now, definition=draft.definition
    )
    session.add(row)
    session.flush()
    _add_pulses(store, session, row.id, draft.table.pulse_id.tolist())


def _fill_up(
    store: Store, session: Session, settled: _Known, digest: str, draft: DatasetDraft
) -> None:
    """Give a snapshot back the pulses that it lost by a deletion, when the same content was
    ingested again."""
    own = set(
        session.scalars(
            select(SnapshotPulse.pulse_id).where(SnapshotPulse.snapshot_id == settled.key)
        )
    )
    lost = [key for key in draft.table.pulse_id.tolist() if key not in own]
    if lost and len(own) + len(lost) == len(draft.table.pulse_id):
        _add_pulses(store, session, settled.key, lost)
        mark_restored(session, digest)


def _add_pulses(store: Store, session: Session, snapshot: int, pulses: Sequence[int]) -> None:
    common = {"snapshot_id": snapshot, "written_by_id": store.written_by(session)}
    session.execute(insert(SnapshotPulse), [{"pulse_id": key, **common} for key in pulses])


def read_snapshot(source: Store | Session, name: str) -> Snapshot:
    """A snapshot of the store.

    Parameters:
        source: The store, or a session of it.
        name: The name of the snapshot or its hash, or the start of the hash, eight digits at least.

    Raises:
        LookupError: For an unknown snapshot, with those there are.
        SnapshotError: Where the store's rows no longer give its hash; `SourceDeletedError` where
            pulses went with what was deleted.
    """
    with _session(source) as session:
        row = get_snapshot_row(session, name)
        try:
            return _frozen(session, row)
        except SnapshotError as error:
            deleted = source_deleted(session, row)
            if deleted is None:
                raise
            raise SourceDeletedError(deleted) from error


def _frozen(session: Session, row: DatasetSnapshot) -> Snapshot:
    definition = _understood(row)
    predictors = from_json(definition["predictors"])
    rows = _with_kept_facts(session, row.name, rows_of_snapshot(session, row.id), definition)
    levels = levels_of(session, (row["configuration_id"] for row in rows))
    stated = definition.get("velocity") or {}
    if stated.get("converted"):
        rows = converted(rows, levels, definition["materials"], stated["kind"]).rows
    frozen = Snapshot(
        row.name,
        row.content_hash,
        definition,
        _table(row.name, rows, levels, definition, predictors),
    )
    digest = content_hash(predictors, frozen.table)
    if digest != frozen.hash:
        raise SnapshotError(
            f"dataset {frozen.name!r}: the store's rows give {digest[:12]}, it was frozen as "
            f"{frozen.hash[:12]}: pulses or campaigns were changed since; restore the store, or "
            "build a dataset under another name"
        )
    return frozen


def _with_kept_facts(
    session: Session, name: str, rows: Sequence[Row], definition: Mapping[str, Any]
) -> Sequence[Any]:
    """The rows with the facts that the dataset was frozen with, where facts were added to a
    campaign since."""
    if FACTS not in definition:
        return rows
    kept = {row["campaign"]: read_frozen_facts(definition, row["campaign"]) for row in rows}
    fingerprints = {fingerprint for _, of_hits in kept.values() for fingerprint in of_hits.values()}
    keys = known_configurations(session, sorted(fingerprints))
    if fingerprints - keys.keys():
        raise SnapshotError(
            f"dataset {name!r}: a configuration that it was frozen with is gone: restore the store"
        )
    as_frozen = []
    for row in rows:
        bench, of_hits = kept[row["campaign"]]
        own = of_hits.get(hit_key(row["run"], row["repetition"]))
        as_frozen.append(
            {**row, **bench, **({} if own is None else {"configuration_id": keys[own]})}
        )
    return as_frozen


def _session(source: Store | Session) -> AbstractContextManager[Session]:
    return source.reading() if isinstance(source, Store) else nullcontext(source)


def _understood(row: DatasetSnapshot) -> dict[str, Any]:
    if row.definition.get("format") != FORMAT:
        raise SnapshotError(
            f"dataset {row.name!r} has format {row.definition.get('format')!r}, this software "
            f"reads {FORMAT}: update pyroshock, or build it under another name"
        )
    return row.definition


def _table(
    name: str, rows: Any, levels: Any, definition: dict[str, Any], predictors: PredictorSet
) -> PulseTable:
    try:
        members = [
            member_of(row, levels[row["configuration_id"]], predictors, definition["materials"])
            for row in rows
        ]
    except ValueError as error:
        raise SnapshotError(
            f"dataset {name!r}: a pulse no longer enters it ({error}): rows of the store were "
            "changed since; restore the store, or build a dataset under another name"
        ) from error
    if not members:
        raise SnapshotError(f"dataset {name!r} has lost its pulses: restore the store")
    return table_of(members, predictors)


__all__ = [
    "Built",
    "Snapshot",
    "SnapshotError",
    "build_snapshot",
    "list_snapshots",
    "read_snapshot",
]


_SHORTEST_KEY = 4


@dataclass(frozen=True)
class Trace:
    """Where a pulse came from. `start_s` and `end_s` bound the contact on the recording's clock."""

    key: str
    campaign: str
    run: int
    repetition: int
    recording: str
    recording_sha256: str
    extraction: str
    extraction_version: int
    extraction_settings: dict[str, Any]
    start_s: float
    end_s: float
    pulse_id: int
    impact_id: int


def trace(session: Session, snapshot: Snapshot, key: str) -> Trace:
    """The origin of a pulse.

    Parameters:
        session: A session of the store.
        snapshot: The frozen dataset of the pulse.
        key: The key of the pulse, or the start of it, four digits at least.

    Raises:
        LookupError: Where no pulse or several have the key.
    """
    matches = [
        row
        for row, text in enumerate(snapshot.table.key)
        if len(key) >= _SHORTEST_KEY and text.startswith(key)
    ]
    if len(matches) != 1:
        raise LookupError(
            f"{len(matches) or 'no'} pulses of dataset {snapshot.name!r} have the key {key!r}; "
            f"expected the start of one, such as {str(snapshot.table.key[0])[:12]}; "
            f"pyroshock dataset export {snapshot.name} --out FILE.csv lists them"
        )
    row = matches[0]
    query = (
        select(Campaign, Impact, Pulse, ExtractionSettingsRow, Recording)
        .select_from(Pulse)
        .join(Impact, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .join(ExtractionSettingsRow, Pulse.settings_id == ExtractionSettingsRow.id)
        .join(Recording, Impact.recording_id == Recording.id)
        .where(Pulse.id == int(snapshot.table.pulse_id[row]))
    )
    campaign, impact, pulse, settings, recording = session.execute(query).one()
    return Trace(
        key=str(snapshot.table.key[row]),
        campaign=campaign.name,
        run=impact.run,
        repetition=impact.repetition,
        recording=recording.path,
        recording_sha256=recording.sha256,
        extraction=settings.fingerprint,
        extraction_version=settings.code_version,
        extraction_settings=settings.settings,
        start_s=pulse.start_s,
        end_s=pulse.start_s + pulse.contact_time_s,
        pulse_id=pulse.id,
        impact_id=impact.id,
    )


def raw_files(session: Session, snapshot: Snapshot) -> list[dict[str, Any]]:
    """Every recording that pulses of a dataset were cut from: campaign, path, SHA-256, how many
    pulses.

    Parameters:
        session: A session of the store.
        snapshot: The frozen dataset.
    """
    query = (
        select(Campaign.name, Recording.path, Recording.sha256, func.count())
        .select_from(SnapshotPulse)
        .join(DatasetSnapshot, SnapshotPulse.snapshot_id == DatasetSnapshot.id)
        .join(Pulse, SnapshotPulse.pulse_id == Pulse.id)
        .join(Impact, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .join(Recording, Impact.recording_id == Recording.id)
        .where(DatasetSnapshot.content_hash == snapshot.hash)
        .group_by(Campaign.name, Recording.path, Recording.sha256)
    )
    keys = ("campaign", "recording", "sha256", "pulses")
    return [dict(zip(keys, row, strict=True)) for row in sorted(session.execute(query).all())]
