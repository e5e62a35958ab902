"""Stored series against h5py with gzip and shuffle: writing, reading, room, and a slice of one percent."""

from __future__ import annotations

import datetime as dt
import os
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.recordings import RecordedChannel, Recording, SeriesChunk
from pyroshock.schema.series import encode_series, read_slice, samples_of, series_hash, write_series
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import func, select

from .figures import Figure
from .measuring import Spread, interleaved, ratio
from .postgres import SERVER_VARIABLE, empty_databases
from .recordings import FULL_SCALE_N, NOISE_STEPS, hit_force, stepped

THEME = "A stored series against h5py with gzip and shuffle"
FASTER, SLICE_SHARE = 4.0, 0.1
Samples = NDArray[Any]


def kinds() -> dict[str, Callable[[], Samples]]:
    """The series that are measured, all of 10 s with ten hits."""
    return {
        "51.2 kHz, 16 bits in float32": lambda: _record(51_200.0, 16),
        "51.2 kHz, 16 bits in float32, noisy": lambda: _record(51_200.0, 16, noise_steps=8.0),
        "51.2 kHz, 24 bits in float32": lambda: _record(51_200.0, 24),
        "51.2 kHz, 16 bits scaled in float64": lambda: _record(51_200.0, 16).astype(np.float64) * 0.980665,
        "1 MHz, 16 bits in float32": lambda: _record(1_000_000.0, 16),
    }


def _record(sampling_rate_hz: float, bits: int, noise_steps: float = NOISE_STEPS) -> NDArray[np.float32]:
    rng = np.random.default_rng(3)
    force = hit_force(round(10.0 * sampling_rate_hz), sampling_rate_hz, 10, rng)
    return stepped(force, FULL_SCALE_N, rng, bits, noise_steps)


def measure_series_on_sqlite(folder: Path, only: Collection[str] = (), repeats: int = 15) -> Iterator[Figure]:
    for old in folder.glob("series.db*"):
        old.unlink()
    return measure_series(f"sqlite:///{folder / 'series.db'}", folder, only, repeats)


def measure_series_on_postgres(folder: Path, only: Collection[str] = (), repeats: int = 15) -> Iterator[Figure]:
    """On the server that `TEST_DATABASE_URL` names."""
    with empty_databases(os.environ[SERVER_VARIABLE], 1) as (url,):
        yield from measure_series(url, folder, only, repeats)


def measure_series(url: str, folder: Path, only: Collection[str] = (), repeats: int = 15) -> Iterator[Figure]:
    """All figures of `only` these kinds (none: of all) in an empty store at `url`; the peer's files go to `folder`."""
    with open_store(url, Writer("benchmark", "0"), create=True) as store:
        kind = store.engine.dialect.name
        for name in only or kinds():
            for figure in _measure_one(store, f"{kind}, {name}", kinds()[name](), folder, repeats):
                yield replace(figure, binding=figure.binding and kind == "sqlite")


def _measure_one(store: Store, name: str, samples: Samples, folder: Path, repeats: int) -> Iterator[Figure]:
    peer = _Peer(folder / "peer.h5", samples)
    ours = _Stored(store, samples)
    ours.write()
    assert ours.read(0, samples.size).tobytes() == samples.tobytes()
    part = samples.size // 100
    at = samples.size // 3
    taken = interleaved({"ours": ours.write, "peer": peer.write, "hash": ours.hash}, max(15, repeats // 3))
    nature = f"the SHA-256 of the samples: {_ms(taken['hash'])}; {ours.write_nature()}"
    yield _faster(f"writing, {name}", taken, "hash", nature, "writing a raw series")
    taken = interleaved(
        {
            "ours": lambda: ours.read(0, samples.size),
            "peer": lambda: peer.read(0, samples.size),
            "wholes": lambda: ours.read_all_by(samples.size, times=10),  # as warm as a hundred slices
            "slices": lambda: ours.read_all_by(part),
            "peer slices": lambda: peer.read_all_by(part),
            "slice": lambda: ours.read(at, at + part),
            "decode": ours.decode,
            "copy": samples.copy,
        },
        repeats,
    )
    nature = f"copying as many bytes: {_ms(taken['copy'])}; decoding {_ms(taken['decode'])}"
    yield _faster(f"reading, {name}", taken, "copy", nature, "reading a raw series")
    yield _room(name, ours.stored_bytes(), peer.stored_bytes(), _noise_bytes(samples))
    hundred = [0.01 * value for value in taken["slices"]]
    peers = ratio([0.01 * value for value in taken["peer slices"]], taken["peer"])
    nature = f"a chunk is decoded whole; h5py, its file open: {peers.text()}"
    wholes = [0.1 * value for value in taken["wholes"]]
    yield _slice(f"1 % over the whole, all in one session, {name}", hundred, wholes, SLICE_SHARE, nature)
    nature = "the session: it costs as much as half a megabyte"
    yield _slice(f"1 % over the whole, each in its own session, {name}", taken["slice"], taken["ours"], None, nature)


def _ms(seconds: list[float]) -> str:
    return Spread.of(seconds).text(" ms", 1e3)


def _faster(name: str, taken: dict[str, list[float]], bound: str, nature: str, question: str) -> Figure:
    ours, peer = taken["ours"], taken["peer"]
    return Figure(
        THEME, name, _ms(ours), _ms(peer), ratio(peer, ours), "at least", FASTER, nature,
        near=ratio(ours, taken[bound]), question=question, rival=f"h5py, gzip and shuffle, {_kind(name)}",
    )  # fmt: skip


def _kind(name: str) -> str:
    """Rate and converter of a figure's name."""
    return name.split(", ", 2)[2].partition(" in ")[0]


def _room(name: str, ours: int, peer: int, noise: float) -> Figure:
    return Figure(
        THEME, f"room, {name}", f"{ours / 1e6:.3g} MB", f"{peer / 1e6:.3g} MB",
        Spread.of([ours / peer]), "at most", 1.0,
        f"the entropy of the recorder's noise, which no packing loses: {noise / 1e6:.3g} MB",
        near=Spread.of([ours / noise]), question="room of a raw series", of="room",
        rival=f"h5py, gzip and shuffle, {_kind(name)}",
    )  # fmt: skip


def _noise_bytes(samples: Samples) -> float:
    """Of normal noise as it is before the first hit, in steps of the converter: log2(sigma sqrt(2 pi e)) a sample.

    (Cover and Thomas, Elements of Information Theory, theorem 8.3.1 and example 8.1.2.)
    """
    quiet = samples[: samples.size // 50].astype(np.float64)
    step = np.diff(np.unique(quiet)).min()
    return float(samples.size * np.log2(quiet.std() / step * np.sqrt(2 * np.pi * np.e)) / 8)


def _slice(name: str, slices: list[float], whole: list[float], limit: float | None, nature: str) -> Figure:
    return Figure(THEME, name, _ms(slices), _ms(whole), ratio(slices, whole), "at most", limit, nature, of="growth")


#: Of recordings, whose paths differ.
_NUMBERS = count()


class _Stored:
    """A channel of a store, written anew each time."""

    def __init__(self, store: Store, samples: Samples) -> None:
        self._store, self._samples = store, samples
        self._encoded = encode_series(samples)
        self._key = 0
        with store.writing() as session:
            campaign = session.scalars(select(Campaign)).first() or Campaign(
                name="measured", kind="hammer", date=dt.date(2026, 11, 1), fingerprint="x"
            )
            session.add(campaign)
            session.flush()
            self._campaign = campaign.id

    def write(self) -> None:
        """Encode, and one transaction with its commit."""
        samples = self._samples
        with self._store.writing() as session:
            encoded = encode_series(samples)
            channel = RecordedChannel(
                name="force", quantity="force", unit="N", si_unit="N", si_gain=1.0, si_offset=0.0,
                sampling_rate_hz=1.0, start_s=0.0, samples=samples.size, **vars(encoded.layout), sha256=encoded.sha256,
                header={},
            )  # fmt: skip
            recording = Recording(
                campaign_id=self._campaign, path=f"{next(_NUMBERS)}", sha256="0" * 64, size_bytes=1, format="npz",
                status="stored", channels=[channel],
            )  # fmt: skip
            session.add(recording)
            session.flush()
            write_series(session, channel.id, encoded.frames, self._store.written_by(session))
            self._key = channel.id

    def write_nature(self) -> str:
        taken = interleaved({"encode": lambda: encode_series(self._samples)}, 5)
        return f"encoding {_ms(taken['encode'])}"

    def hash(self) -> None:
        series_hash(self._samples)

    def read(self, start: int, stop: int) -> Samples:
        """In a session of its own."""
        with self._store.reading() as session:
            return read_slice(session.connection(), self._key, self._encoded.layout, start, stop)

    def read_all_by(self, part: int, times: int = 1) -> None:
        """Slice after slice, in one session."""
        with self._store.reading() as session:
            connection = session.connection()
            for i in list(range(0, self._samples.size - part + 1, part)) * times:
                read_slice(connection, self._key, self._encoded.layout, i, i + part)

    def decode(self) -> None:
        samples_of(self._encoded)

    def stored_bytes(self) -> int:
        """Frames with their row's other columns, as the database counts them."""
        with self._store.reading() as session:
            query = select(func.sum(func.length(SeriesChunk.frame)), func.count())
            frames, rows = session.execute(query.where(SeriesChunk.channel_id == self._key)).one()
        return int(frames) + 16 * int(rows)


class _Peer:
    """An HDF5 file with one dataset."""

    def __init__(self, path: Path, samples: Samples) -> None:
        self._path, self._samples = path, samples

    def write(self) -> None:
        import h5py

        with h5py.File(self._path, "w") as file:
            file.create_dataset("x", data=self._samples, compression="gzip", shuffle=True)

    def read(self, start: int, stop: int) -> Samples:
        import h5py

        with h5py.File(self._path) as file:
            return np.asarray(file["x"][start:stop])

    def read_all_by(self, part: int) -> None:
        import h5py

        with h5py.File(self._path) as file:
            for i in range(0, self._samples.size - part + 1, part):
                np.asarray(file["x"][i : i + part])

    def stored_bytes(self) -> int:
        import h5py

        with h5py.File(self._path) as file:
            return int(file["x"].id.get_storage_size())
