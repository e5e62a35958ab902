"""Channels read back from the store, whole or by slice, as they were when they came from the
file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.recordings import CALIBRATION, RecordedChannel, Recording
from ...schema.series import SeriesError, layout_of, read_slice, resolve
from ...signals.calibration import Calibration
from ...signals.channel import Channel, Sensor


def list_channels(session: Session, recording_id: int) -> list[RecordedChannel]:
    """Rows of a recording's channels, by name; no sample is read.

    Parameters:
        session: A session of the store.
        recording_id: The key of the recording.
    """
    query = select(RecordedChannel).where(RecordedChannel.recording_id == recording_id)
    return list(session.scalars(query.order_by(RecordedChannel.name)))


def read_samples(session: Session, row: RecordedChannel, first: int, stop: int) -> NDArray[Any]:
    """Samples of a stored channel as recorded.

    Parameters:
        session: A session of the store.
        row: The row of the channel.
        first: The first sample: 0 <= first <= stop <= samples.
        stop: The sample before which the slice ends.

    Returns:
        The samples (stop - first,) in the dtype of the file, without units.

    Raises:
        SeriesError: Where the samples are damaged, with recording, channel and chunk.
    """
    try:
        return read_slice(session.connection(), row.id, layout_of(row), first, stop)
    except SeriesError as error:
        path = session.scalar(select(Recording.path).where(Recording.id == row.recording_id))
        raise SeriesError(f"recording {path}, {row.name}: {error}") from error


def read_channel(
    session: Session, row: RecordedChannel, start: int | None = None, stop: int | None = None
) -> Channel:
    """Samples of a stored channel, with its sensor and its clock.

    Parameters:
        session: A session of the store.
        row: The row of the channel.
        start: The first sample. A negative one counts from the end; by default (None) the first of
            the record.
        stop: The sample before which the slice ends. A negative one counts from the end; by default
            (None) the end of the record.

    Raises:
        SeriesError: When the chunks of the channel are damaged.
    """
    first, last = resolve(start, stop, row.samples)
    recorded = read_samples(session, row, first, last)
    sensor = Sensor(
        name=row.name,
        quantity=row.quantity,
        unit=row.unit,
        sensitivity=row.sensitivity,
        offset_v=row.offset_v or 0.0,
        position=row.position,
        axis=row.axis,
        range=row.full_scale,
        calibration=calibration_of(row.header),
    )
    header = {key: value for key, value in row.header.items() if key != CALIBRATION}
    return Channel(
        sensor, recorded, row.sampling_rate_hz, row.start_s + first / row.sampling_rate_hz, header
    )


def calibration_of(header: Mapping[str, Any]) -> Calibration | None:
    """The calibration that a stored header holds; None where it holds none.

    Parameters:
        header: The header of the channel's row.
    """
    table = header.get(CALIBRATION)
    return Calibration.from_json(table) if isinstance(table, Mapping) else None
