"""One campaign's rows are written: one transaction for each recording that is added, after what is
there was held against the folder."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import bindparam, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from ...schema.access.append_only import delete_set_aside
from ...schema.campaign_counts import count_added
from ...schema.campaigns import Campaign
from ...schema.configurations import configuration_ids
from ...schema.impacts import ChannelFigures, Impact, Pulse, Shot
from ...schema.recordings import SET_ASIDE, STORED, QualityFinding, RecordedChannel, Recording
from ...schema.removal.part import Part
from ...schema.row_keys import reserve_ahead
from ...schema.series import write_series
from ...schema.session import Store
from ...schema.tables import metadata
from ..errors import IngestError
from ..extraction.channel_figures import figure_rows
from ..extraction.recording import ExtractedRecording, UnreadableRecording
from ..extraction.row_matching import MatchedImpact
from ..extraction.settings import ExtractionSettings
from ..folder.campaign_tables import CampaignTables
from ..folder.runs_table import FILE
from .additions import Additions, add_facts
from .bench_changes import bench_additions, refuse_changed_channels, refuse_other_modes
from .bench_rows import campaign_row
from .duplicate_recordings import check_other_campaigns, check_same_samples
from .excluded_recordings import DiscardedRecordings, delete_unreadable, store_unreadable
from .report import IngestReport
from .row_changes import RowDifferences, refuse_changed_rows, row_additions, way_out
from .row_values import (
    channel_values,
    finding_values,
    impact_values,
    pulse_values,
    settings_id,
    shot_values,
)
from .stored_rows import RecordingState, StoredRow, stored_recordings, stored_rows

_OF_PATH = (
    select(Recording.id, Recording.status, Recording.sha256)
    .join(Campaign)
    .where(Campaign.name == bindparam("campaign"), Recording.path == bindparam("path"))
)


@dataclass(frozen=True)
class Added:
    """Rows that one transaction adds."""

    recordings: int = 0
    impacts: int = 0
    shots: int = 0


class CampaignWriter:
    """The rows of one campaign. Raises `IngestError` when the store holds other values under the
    same numbers.

    `again` are recordings to store though they were discarded; `replaced` is one that goes before
    anything is written.
    """

    def __init__(
        self,
        store: Store,
        tables: CampaignTables,
        settings: ExtractionSettings,
        *,
        again: Collection[str] = (),
        replaced: str | None = None,
    ) -> None:
        self._store = store
        self._file, self._modes, self._rows = tables.file, tables.modes, tables.rows
        self._settings = settings
        #: Key of the settings' row: as a transaction has it, and once one is committed, for good.
        self._new_settings_id: int = 0
        self._settings_id: int | None = None
        self._replaced = replaced
        self._report = IngestReport(self._file.name)
        self._bench_additions: list[str] = []
        self._recordings, self._stored_rows = store.read(self._stored)
        self._discarded = store.read(
            lambda session: DiscardedRecordings(session, self._file.name, again)
        )
        self._additions = store.read(self._row_additions)

    def has_recording(self, path: str, sha256: str) -> bool:
        """Whether this recording is stored, or was discarded. One that was set aside is not stored:
        what mends it may be a row or a channel.

        Raises `IngestError` for a stored recording whose file has changed since: raw data are not
        replaced silently.
        """
        stored = self._recordings.get(path)
        if stored is None:
            return self._discarded.withhold(path, sha256)
        if stored.status == SET_ASIDE:
            return False
        if stored.sha256 != sha256:
            raise IngestError(
                f"{path}: the file has changed since it was ingested (SHA-256 "
                f"{stored.sha256[:12]}… is stored, {sha256[:12]}… found); give the new recording a "
                f"name of its own, {way_out(self._file.name, path)}"
            )
        return True

    def add_facts(self) -> None:
        """Store the facts that the stored campaign lacks and its folder has, before anything else
        is added."""
        if not self._additions:
            return

        def add(session: Session) -> None:
            add_facts(self._store, session, self._file, self._modes, self._additions)

        self._store.write(add, idempotent=True)
        self._report.added_facts = self._additions.words(self._file.kind)

    def add_recording(self, done: ExtractedRecording) -> None:
        """Store one recording with its series, impacts, shots, pulses and findings, or nothing of
        it."""

        def add(session: Session) -> Added:
            return self.write(session, done) if self.make_room(session, done) else Added()

        self._added(self._write_rows(done.path, add))

    def add_rows_without_recording(self) -> None:
        """Rows that carry their values themselves: one transaction for all."""
        rows = [
            row
            for row in self._rows
            if not row.recording and (row.run, row.repetition) not in self._stored_rows
        ]
        if not rows:
            return

        def add(session: Session) -> Added:
            campaign = campaign_row(session, self._file, self._modes)
            # of another process too, that has been here since we looked
            stored = stored_rows(session, campaign)
            hits = [
                MatchedImpact(row, row.repetition, None)
                for row in rows
                if (row.run, row.repetition) not in stored
            ]
            added = self._add_hits(session, campaign, hits, None, None, {})[0]
            count_added(session.connection(), campaign.id, added.impacts, added.shots)
            return added

        self._added(self._write_rows(FILE, add))

    def set_aside(self, damaged: list[UnreadableRecording]) -> None:
        """Remember the recordings that could not be read: their rows say why, and nothing else of
        them is stored."""
        new = [
            d
            for d in damaged
            if self._recordings.get(d.path) != RecordingState(d.sha256, SET_ASIDE, d.reason)
        ]
        if new:
            self._store.write(lambda session: self._write_set_aside(session, new), idempotent=True)
        self._report.set_aside = [{"recording": d.path, "reason": d.reason} for d in damaged]

    def holds_anything(self) -> bool:
        """Whether the store has any impact or shot of this campaign."""
        return self._store.read(self._any_hit)

    def report(self) -> IngestReport:
        """Totals and findings of the campaign as it stands now."""
        self._store.read(self._report.sum_up)
        self._report.findings += [recording.finding() for recording in self._discarded.withheld]
        return self._report

    def _stored(
        self, session: Session
    ) -> tuple[dict[str, RecordingState], dict[tuple[int, int], StoredRow]]:
        """Recordings and rows of this campaign that are there. Raises `IngestError` for one with
        another bench."""
        campaign = session.scalars(
            select(Campaign).where(Campaign.name == self._file.name)
        ).one_or_none()
        if campaign is not None:
            self._bench_additions = bench_additions(session, campaign, self._file)
            refuse_changed_channels(session, campaign, self._file)
            refuse_other_modes(session, campaign, self._modes)
        recordings, rows = stored_recordings(session, campaign), stored_rows(session, campaign)
        if self._replaced is not None:
            recordings.pop(self._replaced, None)
            rows = {number: row for number, row in rows.items() if row.recording != self._replaced}
        return recordings, rows

    def _any_hit(self, session: Session) -> bool:
        campaign = session.scalar(select(Campaign.id).where(Campaign.name == self._file.name))
        return campaign is not None and any(
            session.scalar(select(table.id).where(table.campaign_id == campaign).limit(1))
            is not None
            for table in (Impact, Shot)
        )

    def _write_rows(self, what: str, add: Callable[[Session], Added]) -> Added:
        """Rows have numbers of their own, by which they are found when they are written again."""
        try:
            return self._store.write(add, idempotent=True)
        except IntegrityError as error:
            raise IngestError(f"{what}: refused by the store: {error.orig}") from error

    def _added(self, added: Added) -> None:
        self._settings_id = self._new_settings_id or None
        for name, count in asdict(added).items():
            self._report.added[name] += count

    def _write_set_aside(self, session: Session, damaged: Sequence[UnreadableRecording]) -> None:
        campaign = campaign_row(session, self._file, self._modes)
        for item in sorted(damaged, key=lambda item: item.path):
            delete_unreadable(session, campaign, item.path)
            store_unreadable(session, campaign, self._file, item)

    def _row_additions(self, session: Session) -> Additions:
        """Facts that the store lacks. Raises `IngestError` where a row says otherwise than the
        stored one."""
        differences = RowDifferences(self._file.kind)
        refuse_changed_rows(
            session, self._file, self._rows, self._stored_rows, self._recordings, differences
        )
        return Additions(
            tuple(self._bench_additions),
            row_additions(session, self._rows, self._stored_rows, differences),
        )

    def make_room(self, session: Session, done: ExtractedRecording) -> bool:
        """Whether a recording is to be written: another process may have stored this very one since
        we looked. One that was set aside and has been mended makes room for its better self."""
        connection = session.connection()
        recording_path = {"campaign": self._file.name, "path": done.path}
        stored_row = connection.execute(_OF_PATH, recording_path).one_or_none()
        if stored_row is not None and stored_row.status == SET_ASIDE:
            delete_set_aside(connection, stored_row.id)
        return stored_row is None or (stored_row.status, stored_row.sha256) != (STORED, done.sha256)

    def write(self, session: Session, done: ExtractedRecording) -> Added:
        """The rows of one recording within a transaction of the caller's, who has made
        room for it."""
        campaign = campaign_row(session, self._file, self._modes)
        self._reserve_keys(session, done)
        facts = {
            "campaign_id": campaign.id,
            "path": done.path,
            "sha256": done.sha256,
            "size_bytes": done.size_bytes,
            "format": done.format,
            "status": STORED,
        }
        (recording,) = self._store.add_rows(session, Recording, [facts])
        channels = self._add_channels(session, recording, done)
        added, impacts = self._add_hits(session, campaign, done.hits, recording, done, channels)
        connection, channel = session.connection(), done.main_channel
        duplicates = (
            check_same_samples(connection, campaign.id, recording, channel),
            check_other_campaigns(connection, campaign.id, done.sha256, channel),
        )
        findings = [
            finding_values(finding, recording, channels, impacts)
            for finding in (*done.findings, *duplicates, *done.row_findings)
            if finding is not None
        ]
        self._store.add_rows(session, QualityFinding, findings)
        part = Part(campaign.id, campaign.name, recording, done.path)
        self._discarded.settle(session, part, done.sha256, self._store.written_by(session))
        count_added(connection, campaign.id, added.impacts, added.shots)
        return replace(added, recordings=1)

    def _reserve_keys(self, session: Session, done: ExtractedRecording) -> None:
        """Of all rows of a recording, in one statement."""
        impacts = [hit for hit in done.hits if self._has_impact(hit, done)]
        counts = {
            Recording: 1,
            RecordedChannel: len(done.series),
            Impact: len(impacts),
            Pulse: sum(hit.pulse is not None for hit in impacts),
            ChannelFigures: sum(map(len, done.figures)) if len(done.figures) == len(impacts) else 0,
            Shot: len(done.hits) if self._file.kind == "gun" else 0,
        }
        tables = {metadata.tables[model.__tablename__]: count for model, count in counts.items()}
        reserve_ahead(session.connection(), tables)

    def _add_channels(
        self, session: Session, recording: int, done: ExtractedRecording
    ) -> dict[str, int]:
        """Channels with their series; their keys by name."""
        rows = [{"recording_id": recording, **channel_values(series)} for series in done.series]
        names = [series.channel.name for series in done.series]
        keys = dict(zip(names, self._store.add_rows(session, RecordedChannel, rows), strict=True))
        # a dry run has no frames
        frames = {keys[series.channel.name]: series.encoded.frames for series in done.series}
        write_series(session, frames, self._store.written_by(session))
        return keys

    def _add_hits(
        self,
        session: Session,
        campaign: Campaign,
        hits: Sequence[MatchedImpact],
        recording: int | None,
        done: ExtractedRecording | None,
        channels: dict[str, int],
    ) -> tuple[Added, dict[int, int]]:
        """Impacts and shots of hits, a table at a time; also the impact's key by the number of its
        pulse.

        `channels` of the recording: their keys by name.
        """
        configurations = configuration_ids(session, [hit.row.levels for hit in hits])
        stored_at = datetime.now(UTC)
        common = [
            {
                "campaign_id": campaign.id,
                "run": hit.row.run,
                "repetition": hit.repetition,
                "configuration_id": configuration,
                "recording_id": recording,
                "stored_at": stored_at,
            }
            for hit, configuration in zip(hits, configurations, strict=True)
        ]
        met = [
            (hit, own) for hit, own in zip(hits, common, strict=True) if self._has_impact(hit, done)
        ]
        keys = self._add_impacts(session, [{**own, **impact_values(hit, done)} for hit, own in met])
        impacts = {
            hit.pulse: keys[hit.row.run, hit.repetition] for hit, _ in met if hit.pulse is not None
        }
        if done and impacts:
            if self._settings_id is None:
                self._new_settings_id = settings_id(session, self._settings)
            settings = self._settings_id or self._new_settings_id
            pulses = [
                pulse_values(done.pulses[pulse], impact, settings)
                for pulse, impact in impacts.items()
            ]
            self._store.add_rows(session, Pulse, pulses)
        if done and len(done.figures) == len(hits) == len(met):
            order = [keys[hit.row.run, hit.repetition] for hit in hits]
            self._store.add_rows(
                session, ChannelFigures, figure_rows(done.figures, order, channels)
            )
        if self._file.kind != "gun":
            return Added(impacts=len(met)), impacts
        shots = [
            {
                **own,
                "impact_id": keys.get((hit.row.run, hit.repetition)),
                **shot_values(hit.row, done),
            }
            for hit, own in zip(hits, common, strict=True)
        ]
        self._store.add_rows(session, Shot, shots)
        return Added(impacts=len(met), shots=len(shots)), impacts

    def _add_impacts(
        self, session: Session, rows: Sequence[dict[str, Any]]
    ) -> dict[tuple[int, int], int]:
        """Impacts of one recording, or of none; their keys by run and repetition."""
        keys = self._store.add_rows(session, Impact, rows)
        return {(row["run"], row["repetition"]): key for row, key in zip(rows, keys, strict=True)}

    def _has_impact(self, hit: MatchedImpact, done: ExtractedRecording | None) -> bool:
        """Whether a hit is an impact; a shot that met no force channel is none."""
        if self._file.kind != "gun":
            return True
        return bool(done and done.has_force) or hit.row.impact_velocity_m_s is not None
