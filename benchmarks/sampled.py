"""Rows of recordings that were really ingested: what their curves, channels and series weigh, and copies of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Pulse
from pyroshock.schema.recordings import RecordedChannel, SeriesChunk
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import func, select

from .bulk import Row
from .recordings import write_campaign

_RECORDINGS = 8
_CURVE = ("force_points_n", "fine_period_s", "fine_force_n")


@dataclass(frozen=True)
class SampledChannel:
    """A channel's row without its keys and its hash, and its frames."""

    row: Row
    frames: list[bytes]


@dataclass(frozen=True)
class Sample:
    """Curves of pulses, and the channels of one recording."""

    curves: list[Row]
    channels: list[SampledChannel]


def sample_of(store: Store) -> Sample:
    """The curves of every pulse of the store, and the channels of its first recording."""
    with store.reading() as session:
        curves = session.execute(select(*(getattr(Pulse, name) for name in _CURVE)).order_by(Pulse.id)).mappings()
        columns = [c for c in RecordedChannel.__table__.c if c.name not in ("recording_id", "sha256", "written_by_id")]
        first = select(func.min(RecordedChannel.recording_id)).scalar_subquery()
        found = session.execute(select(*columns).where(RecordedChannel.recording_id == first)).mappings().all()
        frames = {
            row["id"]: list(
                session.scalars(
                    select(SeriesChunk.frame).where(SeriesChunk.channel_id == row["id"]).order_by(SeriesChunk.number)
                )
            )
            for row in found
        }
        channels = [SampledChannel(dict(row), frames[row["id"]]) for row in found]
        return Sample([dict(row) for row in curves], channels)


def ingested_sample(folder: Path) -> Sample:
    """Of hammer recordings as `benchmarks.recordings` makes them, ingested in `folder`."""
    source = write_campaign(folder / "sample", _RECORDINGS, ".mat", np.random.default_rng(11))
    with open_store(f"sqlite:///{folder / 'sample.db'}", Writer("benchmark", "0"), create=True) as store:
        ingest_folder(store, source, jobs=1)
        return sample_of(store)
