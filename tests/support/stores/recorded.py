"""Channels and pulses put straight into a store, for tests of what reads them."""

from __future__ import annotations

import datetime as dt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.ingest.extraction.recording import EncodedChannel
from pyroshock.ingest.storing.row_values import channel_values
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Pulse
from pyroshock.schema.recordings import RecordedChannel, Recording
from pyroshock.schema.series import write_series
from pyroshock.schema.session import Store
from pyroshock.schema.transactions import get_or_add
from pyroshock.signals.channel import Channel, Sensor

WHEN = dt.datetime(2026, 1, 1, tzinfo=dt.UTC)
_ZERO = (
    *(
        "start_s",
        "compression_time_s",
        "impulse_n_s",
        "compression_impulse_n_s",
        "width_half_s",
        "width_tenth_s",
    ),
    *("spline_nrmse", "segmentation_difference", "fine_period_s"),
)


def pulse_row(impact: int, **own: Any) -> Pulse:
    """A pulse in use with these figures, of settings 1; what is not given is of no matter."""
    rest: dict[str, Any] = {
        "impact_id": impact, "settings_id": 1, "current": True, "extracted_at": WHEN,
        **dict.fromkeys(_ZERO, 0.0),
        "contact_time_s": 1e-3, "peak_force_n": 1.0, "spline_peak_force_n": 1.0,
        "samples_in_contact": 9,
        "force_points_n": [], "fine_force_n": b"",
    }  # fmt: skip
    return Pulse(**{**rest, **own})


def add_recording(
    store: Store,
    channels: dict[Sensor, NDArray[Any]],
    rate_hz: float,
    start_s: float = 0.0,
    campaign: str = "c",
) -> tuple[int, dict[str, int]]:
    """A recording of these samples; its key, and the keys of the channels by name."""
    with store.writing() as session:
        values = {"kind": "hammer", "date": dt.date(2026, 1, 1), "fingerprint": campaign}
        owner = get_or_add(session, Campaign, {"name": campaign}, values)
        count = session.query(Recording).count()
        series = [
            EncodedChannel.of(Channel(s, np.asarray(v), rate_hz, start_s))
            for s, v in channels.items()
        ]
        recording = Recording(
            campaign_id=owner.id,
            path=f"{count}.npz",
            sha256=f"{count:064d}",
            size_bytes=1,
            format="npz",
            status="stored",
            channels=[RecordedChannel(**channel_values(channel)) for channel in series],
        )
        session.add(recording)
        session.flush()
        keys = {row.name: row.id for row in recording.channels}
        frames = {keys[channel.channel.name]: channel.encoded.frames for channel in series}
        write_series(session, frames, store.written_by(session))
        return recording.id, keys
