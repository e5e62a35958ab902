"""Damaged series read again from their campaign folder: only where the file is the one that was
recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from ...schema.access.append_only import delete_damaged_chunks
from ...schema.campaigns import Campaign
from ...schema.integrity.checks.series import ChannelRow, damages, iter_channels
from ...schema.integrity.findings import Scope
from ...schema.recordings import RecordedChannel, Recording, SeriesChunk
from ...schema.series import EncodedSeries, encode_series, layout_of, write_series
from ...schema.session import Store
from ..errors import IngestError
from ..extraction.channels import read_recording
from ..folder.campaign_file import CampaignFile, read_campaign_file
from ..readers import RecordingError
from ..readers.recording_files import RecordingFiles
from .bench_changes import refuse_other_campaign


@dataclass
class RepairReport:
    """Series that are whole again, and those that stay as they are with the reason; "recording:
    channel"."""

    campaign: str
    mended: list[str] = field(default_factory=list)
    left: dict[str, str] = field(default_factory=dict)


def repair_series(store: Store, folder: Path) -> RepairReport:
    """Write the damaged series of a campaign anew from its files, one transaction a recording.

    Nothing else changes: the samples must be those whose SHA-256 the store holds.

    Parameters:
        store: The open store that holds the campaign.
        folder: The campaign folder.

    Raises:
        IngestError: For a folder that is no campaign of the store.
    """
    file = read_campaign_file(folder)
    report = RepairReport(file.name)
    for path, rows in groupby(_damaged(store, file), key=lambda row: str(row.recording)):
        _mend(store, file, path, list(rows), report)
    return report


def _damaged(store: Store, file: CampaignFile) -> list[ChannelRow]:
    with store.reading() as session:
        campaign = session.scalars(select(Campaign).where(Campaign.name == file.name)).one_or_none()
        if campaign is None:
            raise IngestError(
                f"no campaign {file.name!r} in the store to repair; pyroshock "
                f"ingest {file.folder} adds it"
            )
        refuse_other_campaign(session, campaign, file)
        connection = session.connection()
        return [
            row
            for row in iter_channels(connection, Scope(campaign.id))
            if any(damages(connection, row))
        ]


def _mend(
    store: Store, file: CampaignFile, path: str, rows: Sequence[ChannelRow], report: RepairReport
) -> None:
    try:
        encoded_rows = _encoded(store, file, path, rows)
    except RecordingError as error:
        report.left |= {f"{path}: {row.channel}": str(error) for row in rows}
        return
    with store.writing() as session:
        for row in rows:
            encoded = encoded_rows[row.channel]
            if encoded.sha256 == row.sha256:
                _rewrite(session, row, encoded, store.written_by(session))
                report.mended.append(f"{path}: {row.channel}")
            else:
                report.left[f"{path}: {row.channel}"] = (
                    "the file has other samples than those that were recorded"
                )


def _encoded(
    store: Store, file: CampaignFile, path: str, rows: Sequence[ChannelRow]
) -> dict[str, EncodedSeries]:
    """The series of the recording's file by channel. Raises `RecordingError` where it is not the
    file it was."""
    with store.reading() as session:
        query = select(Recording.sha256).join(
            RecordedChannel, RecordedChannel.recording_id == Recording.id
        )
        recorded = session.scalar(query.where(RecordedChannel.id == rows[0].id))
    files = RecordingFiles(file.folder, path, file.reading)
    if files.sha256() != recorded:
        raise RecordingError(f"{path}: the file has changed since it was ingested")
    wanted = {row.channel for row in rows}
    sensors = {name: sensor for name, sensor in file.sensors.items() if name in wanted}
    if missing := wanted - sensors.keys():
        raise RecordingError(
            f"{path}: campaign.toml has no channel {', '.join(sorted(missing))} any more"
        )
    channels, _ = read_recording(files, sensors)
    return {channel.name: encode_series(channel.recorded) for channel in channels}


def _rewrite(
    session: Session, channel: ChannelRow, encoded: EncodedSeries, written_by: int
) -> None:
    """Write the chunks that are missing or not as they were written; all of them where the series
    is then not whole.

    The second needs an administrator on PostgreSQL: it changes what was recorded of the series.
    """
    key = channel.id
    row = session.get_one(RecordedChannel, key)
    if layout_of(row) == encoded.layout and row.samples == encoded.samples:
        delete_damaged_chunks(session.connection(), key)
        whole = set(
            session.scalars(select(SeriesChunk.number).where(SeriesChunk.channel_id == key))
        )
        write_series(session, {key: encoded.frames}, written_by, without=whole)
        if not any(damages(session.connection(), channel)):
            return
    session.execute(delete(SeriesChunk).where(SeriesChunk.channel_id == key))
    row.chunk_samples, row.step = encoded.layout.chunk_samples, encoded.layout.step
    row.dtype, row.samples = encoded.layout.dtype, encoded.samples
    write_series(session, {key: encoded.frames}, written_by)
