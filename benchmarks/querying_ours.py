"""The store as a way of keeping a campaign: what an ingest writes, and what pages, exports and scripts ask."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyroshock.ingest.processing import StoredSeries
from pyroshock.ingest.store import CampaignStore
from pyroshock.ingest.stored import read_samples
from pyroshock.schema.conditions import Condition
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.listings import list_pulse_keys
from pyroshock.schema.recordings import RecordedChannel
from pyroshock.schema.series import as_floats
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import select
from sqlalchemy.orm import Session

from .querying_ways import CHANNEL, Floats, Keeping
from .stored_content import FACTOR, Content

_EVERY, _AT_ONCE = 10**9, 500


class Ours(Keeping):
    """One SQLite store, opened once, as a command or a server does; each question is a session of its own."""

    name = "pyroshock"
    guarantees = "a transaction a recording, SHA-256 of each series, CRC of each chunk"

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._store: Store | None = None

    def empty(self) -> None:
        self.close()
        super().empty()
        self._open()

    def _open(self) -> None:
        url = f"sqlite:///{self.folder / 'lab.db'}"
        self._store = open_store(url, Writer("benchmark", "0"), create=True)

    def room(self) -> int:
        self.close()  # the log of what was last written goes into the store's file, as with every command's end
        found = super().room()
        self._open()
        return found

    def close(self) -> None:
        if self._store:
            self._store.close()

    @property
    def opened(self) -> Store:
        assert self._store
        return self._store

    def store(self, content: Content) -> None:
        target = CampaignStore(self.opened, content.file, None, content.rows, content.settings)
        for cut in content.cut:
            series = tuple(StoredSeries.of(channel) for channel in cut.channels)
            target.add_recording(replace(cut.done, series=series), cut.hits)

    def whole(self, run: int) -> NDArray[np.float32]:
        with self.opened.reading() as session:
            row = _channel(session, run)
            return read_samples(session, row, 0, row.samples)

    def window(self, run: int, start: int, stop: int) -> NDArray[np.float32]:
        with self.opened.reading() as session:
            return read_samples(session, _channel(session, run), start, stop)

    def pulses(self, level: str) -> list[Floats]:
        where = (Condition(FACTOR, "=", level),)
        with self.opened.reading() as session:
            keys, _ = list_pulse_keys(session, None, where, _EVERY)
            frames: dict[int, bytes] = {}
            for i in range(0, len(keys), _AT_ONCE):
                query = select(Pulse.id, Pulse.fine_force_n).where(Pulse.id.in_(keys[i : i + _AT_ONCE]))
                frames |= dict(iter(session.execute(query)))
            return [as_floats(frames[key], f"pulse {key}") for key in keys]


def _channel(session: Session, run: int) -> RecordedChannel:
    recording = select(Impact.recording_id).where(Impact.run == run).limit(1).scalar_subquery()
    query = select(RecordedChannel).where(RecordedChannel.recording_id == recording, RecordedChannel.name == CHANNEL)
    return session.scalars(query).one()
