"""Stored series beside h5py, and a campaign's series and pulses kept by us, h5py, sqlite3, pandas
and QCoDeS.

`python -m benchmarks series querying` measures it. Every way of keeping a campaign is written as
its user would write it, and says what it guarantees. Everything lies in the system's cache; nobody
waits for the disk.
"""

from __future__ import annotations

import datetime as dt
import json
import sqlite3
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pyroshock.ingest.extraction.channels import read_channels
from pyroshock.ingest.extraction.recording import (
    EncodedChannel,
    ExtractedRecording,
    extract_recording,
)
from pyroshock.ingest.extraction.row_matching import expected_hits, match
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.folder.campaign_file import CampaignFile, read_campaign_file
from pyroshock.ingest.folder.campaign_tables import CampaignTables
from pyroshock.ingest.folder.runs_table import RunRow, read_runs
from pyroshock.ingest.storing.campaign_writer import CampaignWriter
from pyroshock.ingest.storing.stored_channels import read_samples
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.conditions import Condition
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.listings import list_pulses
from pyroshock.schema.recordings import RecordedChannel, Recording, SeriesChunk
from pyroshock.schema.series import (
    as_floats,
    encode_series,
    read_slice,
    samples_of,
    series_hash,
    write_series,
)
from pyroshock.schema.session import Store, open_store
from pyroshock.signals.channel import Channel
from sqlalchemy import bindparam, func, select

from .harness import (
    Figure,
    Program,
    Spread,
    beside,
    compared,
    interpreter_with,
    spread_text,
    take_turns,
    wall_seconds,
)
from .shared_records import FULL_SCALE_N, NOISE_STEPS, WRITER, digitised, hit_force, write_campaign

Samples = NDArray[Any]
Floats = NDArray[np.float64]

SERIES = "A stored series against h5py with gzip and shuffle"
TIME_LIMIT, SLICE_LIMIT = 1 / 4, 0.1


def _record(
    sampling_rate_hz: float, bits: int, noise_steps: float = NOISE_STEPS
) -> NDArray[np.float32]:
    rng = np.random.default_rng(3)
    force = hit_force(round(10 * sampling_rate_hz), sampling_rate_hz, rng)
    return digitised(force, FULL_SCALE_N, rng, bits, noise_steps)


#: The series that are measured, all of 10 s with ten hits.
KINDS: dict[str, Callable[[], Samples]] = {
    "51.2 kHz, 16 bits in float32": lambda: _record(51_200.0, 16),
    "51.2 kHz, 16 bits in float32, noisy": lambda: _record(51_200.0, 16, noise_steps=8.0),
    "51.2 kHz, 24 bits in float32": lambda: _record(51_200.0, 24),
    "51.2 kHz, 16 bits scaled in float64": lambda: (
        _record(51_200.0, 16).astype(np.float64) * 0.980665
    ),
    "1 MHz, 16 bits in float32": lambda: _record(1_000_000.0, 16),
}


def measure_series(folder: Path, only: Collection[str] = (), repeats: int = 15) -> Iterator[Figure]:
    """All figures of `only` these kinds (none: of all) on SQLite."""
    for old in folder.glob("series.db*"):
        old.unlink()
    with open_store(f"sqlite:///{folder / 'series.db'}", WRITER, create=True) as store:
        for name in only or KINDS:
            yield from _one_series(store, name, KINDS[name](), folder / "peer.h5", repeats)


def _one_series(
    store: Store, kind: str, samples: Samples, path: Path, repeats: int
) -> Iterator[Figure]:
    size = samples.size
    peer = f"h5py, gzip and shuffle, {kind.partition(' in ')[0]}"
    ours = _StoredSeries(store, samples)

    def peer_writes() -> None:
        with h5py.File(path, "w") as file:
            file.create_dataset("x", data=samples, compression="gzip", shuffle=True)

    def peer_reads(part: int) -> float:
        with h5py.File(path) as file:
            for i in range(0, size - part + 1, part):
                np.asarray(file["x"][i : i + part])
            return float(file["x"].id.get_storage_size())

    ours.write()
    assert ours.read(size).tobytes() == samples.tobytes()
    writing = {"ours": ours.write, peer: peer_writes, "bound": lambda: series_hash(samples)}
    seconds = take_turns(writing, max(15, repeats // 3))
    encoding = take_turns({"encode": lambda: encode_series(samples)}, 5)["encode"]
    yield beside(
        SERIES, f"writing, {kind}", seconds, peer, limit=TIME_LIMIT,
        question="writing a raw series",
        bound=f"encoding takes {spread_text(encoding, 'ms')}, of which the SHA-256 of the samples",
    )  # fmt: skip
    reading: dict[str, Callable[[], object]] = {
        "ours": lambda: ours.read(size),
        peer: lambda: peer_reads(size),
        "wholes": lambda: ours.read(size, times=10),  # as warm as a hundred slices
        "slices": lambda: ours.read(size // 100),
        "peer's slices": lambda: peer_reads(size // 100),
        "decode": lambda: samples_of(ours.encoded),
        "bound": samples.copy,
    }
    seconds = take_turns(reading, repeats)
    yield beside(
        SERIES, f"reading, {kind}", seconds, peer, limit=TIME_LIMIT,
        question="reading a raw series",
        bound=f"decoding takes {spread_text(seconds['decode'], 'ms')}, copying as many bytes",
    )  # fmt: skip
    rooms = {
        "ours": [ours.stored_bytes()],
        peer: [peer_reads(size)],
        "bound": [_noise_bytes(samples)],
    }
    yield beside(
        SERIES, f"room, {kind}", rooms, peer, unit="MB", limit=1.0, kind="room",
        question="room of a raw series",
        bound="the entropy of the recorder's noise, which no packing loses",
    )  # fmt: skip
    slices, wholes = [0.01 * s for s in seconds["slices"]], [0.1 * s for s in seconds["wholes"]]
    shares = [0.01 * a / b for a, b in zip(seconds["peer's slices"], seconds[peer], strict=True)]
    yield compared(
        SERIES, f"1 % over the whole, all in one session, {kind}", slices, wholes,
        limit=SLICE_LIMIT, kind="growth",
        bound=f"a chunk is decoded whole; h5py, its file open: {Spread.of(shares).text()}",
    )  # fmt: skip


def _noise_bytes(samples: Samples) -> float:
    """Of normal noise as it is before the first hit, in steps of the converter: log2(sigma sqrt(2
    pi e)) a sample.

    (Cover and Thomas, Elements of Information Theory, theorem 8.3.1 and example 8.1.2.)
    """
    quiet = samples[: samples.size // 50].astype(np.float64)
    step = np.diff(np.unique(quiet)).min()
    return float(samples.size * np.log2(quiet.std() / step * np.sqrt(2 * np.pi * np.e)) / 8)


class _StoredSeries:
    """A channel of a store, written anew each time."""

    _paths = count()  # recordings have different paths

    def __init__(self, store: Store, samples: Samples) -> None:
        self._store, self._samples, self._key = store, samples, 0
        self.encoded = encode_series(samples)
        with store.writing() as session:
            day = dt.date(2026, 11, 1)
            new = Campaign(
                name=f"measured {next(self._paths)}", kind="hammer", date=day, fingerprint="x"
            )
            session.add(new)
            session.flush()
            self._campaign = new.id

    def write(self) -> None:
        """Encode, and one transaction with its commit."""
        with self._store.writing() as session:
            encoded = encode_series(self._samples)
            channel = RecordedChannel(
                name="force", quantity="force", unit="N", si_unit="N", si_gain=1.0, si_offset=0.0,
                sampling_rate_hz=1.0, start_s=0.0, samples=self._samples.size,
                **vars(encoded.layout),
                sha256=encoded.sha256, header={},
            )  # fmt: skip
            recording = Recording(
                campaign_id=self._campaign, path=f"{next(self._paths)}", sha256="0" * 64,
                size_bytes=1, format="npz",
                status="stored", channels=[channel],
            )  # fmt: skip
            session.add(recording)
            session.flush()
            write_series(session, {channel.id: encoded.frames}, self._store.written_by(session))
            self._key = channel.id

    def read(self, part: int, times: int = 1) -> Samples:
        """The whole, part after part in one session; the last part comes back."""
        with self._store.reading() as session:
            connection, samples_read = session.connection(), self._samples[:0]
            for i in list(range(0, self._samples.size - part + 1, part)) * times:
                samples_read = read_slice(connection, self._key, self.encoded.layout, i, i + part)
            return samples_read

    def stored_bytes(self) -> float:
        """Frames with their row's other columns, as the database counts them."""
        with self._store.reading() as session:
            query = select(func.sum(func.length(SeriesChunk.frame)), func.count())
            frames, rows = session.execute(query.where(SeriesChunk.channel_id == self._key)).one()
        return float(frames) + 16 * float(rows)


QUERYING = (
    "Series and pulses of {} recordings (10 s, two channels at 51.2 kHz, ten "
    "impacts each), kept and asked for"
)
CHANNEL, FACTOR, LEVEL, RUN = "force", "tip_material", "steel", 2
#: What is kept of an impact, beside its pulse.
FIGURES = ("start_s", "contact_time_s", "peak_force_n", "impulse_n_s")
OURS, RAW = "ours", "bound"
#: What is asked of a `Storage`, by its method: as the row of a figure says it, and its question in
#: the first table.
QUESTIONS = {
    "store": ("storing them", "storing series and pulses"),
    "whole": ("one series whole", "reading a stored series"),
    "window": ("a hundredth of a series", "reading a hundredth of a series"),
    "pulses": (f"pulses with {FACTOR}={LEVEL}", "the pulses of a factor's level"),
}


@dataclass(frozen=True, eq=False)
class RecordingContent:
    """One recording: factors, rate and path, `series` by channel (n,), `pulses` (m,) N of its
    impacts, and what our own ingest holds of it."""

    run: int
    attributes: dict[str, str | float]
    series: dict[str, NDArray[np.float32]]
    impacts: tuple[dict[str, Any], ...]
    pulses: tuple[Floats, ...]
    channels: tuple[Channel, ...]
    extracted: ExtractedRecording


@dataclass(frozen=True, eq=False)
class Content:
    """What every way of storing is given: recordings with factors, series and cut pulses, in
    memory."""

    file: CampaignFile
    rows: tuple[RunRow, ...]
    recordings: tuple[RecordingContent, ...]

    @classmethod
    def of(cls, folder: Path) -> Self:
        """Of a campaign folder with a recording a run, each read, judged and cut as an ingest
        does."""
        file = read_campaign_file(folder)
        rows, recordings = read_runs(folder, file.kind, lambda name: name), []
        for row in rows:
            path = str(row.recording)
            channels, _ = read_channels(folder / path, file.sensors)
            expected = expected_hits([row], rows)
            done = extract_recording(
                folder, path, file.sensors, ExtractionSettings(), expected=expected
            )
            factors = {
                level.factor: level.label if level.number is None else level.number
                for level in row.levels
            }
            impacts = [
                {"repetition": number, **{name: getattr(pulse, name) for name in FIGURES}}
                for number, pulse in enumerate(done.pulses, row.repetition)
            ]
            recordings.append(RecordingContent(
                row.run, {"path": path, "rate_hz": channels[0].sampling_rate_hz, **factors},
                {channel.name: channel.recorded for channel in channels}, tuple(impacts),
                tuple(pulse.fine_force_n for pulse in done.pulses), tuple(channels),
                # encoding the series is part of storing them, which is measured
                replace(done, series=(), hits=tuple(match(path, [row], len(done.pulses), rows))),
            ))  # fmt: skip
        return cls(file, rows, tuple(recordings))

    @property
    def bytes(self) -> int:
        series = sum(
            samples.nbytes for recording in self.recordings for samples in recording.series.values()
        )
        return series + sum(
            force.nbytes for recording in self.recordings for force in recording.pulses
        )

    def request(self, what: str) -> tuple[Any, ...]:
        """The arguments of a question; a window is a hundredth of a series, from its first third
        on."""
        size = self.recordings[0].series[CHANNEL].size
        window = (RUN, size // 3, size // 3 + size // 100)
        return {"store": (), "whole": (RUN,), "window": window, "pulses": (LEVEL,)}[what]

    def pulses(self, level: str) -> list[Floats]:
        """Of all impacts with a level of `FACTOR`."""
        return [
            pulse
            for recording in self.recordings
            if recording.attributes[FACTOR] == level
            for pulse in recording.pulses
        ]

    def write(self, folder: Path) -> Path:
        """The recordings as plain arrays with an index, for a program that imports nothing of
        ours."""
        folder.mkdir(parents=True, exist_ok=True)
        index: list[dict[str, Any]] = []
        for recording in self.recordings:
            pulses = {f"pulse_{i}": pulse for i, pulse in enumerate(recording.pulses)}
            # takes them by name
            np.savez(folder / f"{recording.run}.npz", **recording.series, **pulses)  # type: ignore[arg-type]
            index.append(
                {
                    "run": recording.run,
                    "attributes": recording.attributes,
                    "impacts": recording.impacts,
                }
            )
        (folder / "index.json").write_text(json.dumps(index))
        return folder


#: A peer in a program of its own overrides `seconds` and `sums`, and none of the three below.
_ELSEWHERE = "this storage answers in a program of its own"


class Storage:
    """A way of keeping a campaign in `folder`, which is its own. Reading opens what it needs, and
    closes it again."""

    name = guarantees = ""

    def __init__(self, folder: Path, content: Content) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.content = folder, content

    def empty(self) -> None:
        for old in self.folder.iterdir():
            old.unlink()

    def store(self) -> None:
        """All of the content, recording by recording."""
        raise NotImplementedError(_ELSEWHERE)

    def whole(self, run: int) -> Samples:
        """The force of a run's recording."""
        raise NotImplementedError(_ELSEWHERE)

    def window(self, run: int, start: int, stop: int | None) -> Samples:
        return self.whole(run)[start:stop]

    def pulses(self, level: str) -> list[Floats]:
        """Of all impacts with this level of `FACTOR`."""
        raise NotImplementedError(_ELSEWHERE)

    def room(self) -> int:
        return sum(file.stat().st_size for file in self.folder.iterdir())

    def seconds(self, what: str) -> float:
        if what == "store":
            self.empty()
        return wall_seconds(partial(getattr(self, what), *self.content.request(what)))

    def sums(self, what: str) -> list[list[float]]:
        """Length and sum of each array of an answer."""
        arrays = getattr(self, what)(*self.content.request(what))
        return _sums(arrays if isinstance(arrays, list) else [arrays])


class OurStore(Storage):
    """One SQLite store, opened once, as a command or a server does; each question is a session of
    its own."""

    name, guarantees = OURS, "a transaction a recording, SHA-256 of each series, CRC of each chunk"

    def __init__(self, folder: Path, content: Content) -> None:
        super().__init__(folder, content)
        self._open()

    def _open(self) -> None:
        self._store = open_store(f"sqlite:///{self.folder / 'lab.db'}", WRITER, create=True)

    def close(self) -> None:
        self._store.close()

    def empty(self) -> None:
        self.close()
        super().empty()
        self._open()

    def room(self) -> int:
        # the log of the last writing goes into the store's file, as at the end of every command
        self.close()
        return super().room()

    def store(self) -> None:
        tables = CampaignTables(self.content.file, self.content.rows, None, [], {})
        writer = CampaignWriter(self._store, tables, ExtractionSettings())
        for recording in self.content.recordings:
            series = tuple(EncodedChannel.of(channel) for channel in recording.channels)
            writer.add_recording(replace(recording.extracted, series=series))

    def whole(self, run: int) -> Samples:
        return self.window(run, 0, None)

    def window(self, run: int, start: int, stop: int | None) -> Samples:
        with self._store.reading() as session:
            row: Any = session.execute(_CHANNEL_OF_RUN, {"run": run}).one()
            return read_samples(session, row, start, row.samples if stop is None else stop)

    def pulses(self, level: str) -> list[Floats]:
        with self._store.reading() as session:
            where = (Condition(FACTOR, "=", level),)
            columns = (Pulse.id, Pulse.fine_force_n)
            rows, _ = list_pulses(session, None, where, None, columns)
            return [as_floats(row.fine_force_n, f"pulse {row.id}") for row in rows]


#: What a slice is read by, of the channel of a run: of the tables, for a row of the model takes
#: half of the time of a short slice.
_channels, _impacts = RecordedChannel.__table__.c, Impact.__table__.c
_CHANNEL_OF_RUN = select(
    _channels.id, _channels.recording_id, _channels.name, _channels.samples,
    _channels.dtype, _channels.chunk_samples, _channels.step,
).where(
    _channels.recording_id
    == select(_impacts.recording_id)
    .where(_impacts.run == bindparam("run"))
    .limit(1)
    .scalar_subquery(),
    _channels.name == CHANNEL,
)  # fmt: skip


class Hdf5(Storage):
    """A group for each recording, its datasets packed, factors as attributes."""

    name, guarantees = "h5py", "a file that a kill may spoil, no hashes"

    def _open(self, mode: str = "r") -> Any:
        return h5py.File(self.folder / "campaign.h5", mode)

    def store(self) -> None:
        with self._open("w") as file:
            for recording in self.content.recordings:
                group = file.create_group(f"{recording.run:06d}")
                group.attrs.update(recording.attributes)
                for name, samples in recording.series.items():
                    group.create_dataset(name, data=samples, compression="gzip", shuffle=True)
                for impact, force in zip(recording.impacts, recording.pulses, strict=True):
                    pulse = group.create_dataset(f"impacts/{impact['repetition']:06d}", data=force)
                    pulse.attrs.update(impact)

    def whole(self, run: int) -> Samples:
        return self.window(run, 0, None)

    def window(self, run: int, start: int, stop: int | None) -> Samples:
        with self._open() as file:
            return np.asarray(file[f"{run:06d}/{CHANNEL}"][start:stop])

    def pulses(self, level: str) -> list[Floats]:
        with self._open() as file:
            groups = [group for group in file.values() if group.attrs[FACTOR] == level]
            return [np.asarray(pulse[:]) for group in groups for pulse in group["impacts"].values()]


class PlainSqlite(Storage):
    """Three tables and the module of the standard library; a series is its bytes, a window of it a
    part of the blob."""

    name, guarantees = (
        "sqlite3",
        "a transaction a recording, with the same settings as ours; no hashes",
    )

    def _open(self) -> closing[sqlite3.Connection]:
        connection = sqlite3.connect(self.folder / "campaign.db")
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = NORMAL")
        return closing(connection)

    def store(self) -> None:
        attributes = ", ".join(self.content.recordings[0].attributes)
        figures = ", ".join(self.content.recordings[0].impacts[0])
        with self._open() as db:
            db.execute(f"CREATE TABLE recordings (run INTEGER PRIMARY KEY, {attributes})")
            db.execute(
                "CREATE TABLE series (run, channel, samples BLOB, PRIMARY KEY (run, channel))"
            )
            db.execute(
                f"CREATE TABLE impacts (run, {figures}, force BLOB, PRIMARY KEY (run, repetition))"
            )
            for recording in self.content.recordings:
                row = (recording.run, *recording.attributes.values())
                series = [
                    (recording.run, name, x.tobytes()) for name, x in recording.series.items()
                ]
                pairs = zip(recording.impacts, recording.pulses, strict=True)
                impacts = [
                    (recording.run, *impact.values(), force.tobytes()) for impact, force in pairs
                ]
                for table, rows in (
                    ("recordings", [row]),
                    ("series", series),
                    ("impacts", impacts),
                ):
                    marks = ", ".join("?" * len(rows[0]))
                    # Question marks.
                    db.executemany(f"INSERT INTO {table} VALUES ({marks})", rows)  # noqa: S608
                db.commit()

    def whole(self, run: int) -> Samples:
        with self._open() as db:
            query = "SELECT samples FROM series WHERE run = ? AND channel = ?"
            return np.frombuffer(db.execute(query, (run, CHANNEL)).fetchone()[0], np.float32)

    def window(self, run: int, start: int, stop: int | None) -> Samples:
        with self._open() as db:
            query = "SELECT rowid FROM series WHERE run = ? AND channel = ?"
            (row,) = db.execute(query, (run, CHANNEL)).fetchone()
            with db.blobopen("series", "samples", row, readonly=True) as blob:
                blob.seek(4 * start)
                return np.frombuffer(
                    blob.read(-1 if stop is None else 4 * (stop - start)), np.float32
                )

    def pulses(self, level: str) -> list[Floats]:
        where = f"WHERE {FACTOR} = ? ORDER BY run, repetition"
        # The factor is our own.
        query = f"SELECT force FROM impacts JOIN recordings USING (run) {where}"  # noqa: S608
        with self._open() as db:
            return [np.frombuffer(force) for (force,) in db.execute(query, (level,))]


class Parquet(Storage):
    """A table for each recording, and one for all impacts, by pandas as it comes."""

    name, guarantees = "pandas", "files, each of which a kill may spoil; no hashes"

    def store(self) -> None:
        rows = []
        for recording in self.content.recordings:
            pd.DataFrame(recording.series).to_parquet(self.folder / f"{recording.run}.parquet")
            for impact, force in zip(recording.impacts, recording.pulses, strict=True):
                rows.append(
                    {"run": recording.run, **recording.attributes, **impact, "force_n": force}
                )
        pd.DataFrame(rows).to_parquet(self.folder / "impacts.parquet")

    def whole(self, run: int) -> Samples:
        return np.asarray(
            pd.read_parquet(self.folder / f"{run}.parquet", columns=[CHANNEL])[CHANNEL].to_numpy()
        )

    def pulses(self, level: str) -> list[Floats]:
        filters = [(FACTOR, "==", level)]
        return list(
            pd.read_parquet(self.folder / "impacts.parquet", columns=["force_n"], filters=filters)[
                "force_n"
            ]
        )


class RawBytes(Storage):
    """The limit: the same bytes in files, and nothing else."""

    name, guarantees = RAW, "nothing"

    def store(self) -> None:
        for recording in self.content.recordings:
            for name, samples in recording.series.items():
                samples.tofile(self.folder / f"{recording.run}.{name}")
        for level in {str(recording.attributes[FACTOR]) for recording in self.content.recordings}:
            np.concatenate(self.content.pulses(level)).tofile(self.folder / level)

    def whole(self, run: int) -> Samples:
        return self.window(run, 0, None)

    def window(self, run: int, start: int, stop: int | None) -> Samples:
        count = -1 if stop is None else stop - start
        return np.fromfile(self.folder / f"{run}.{CHANNEL}", np.float32, count, offset=4 * start)

    def pulses(self, level: str) -> list[Floats]:
        return [np.fromfile(self.folder / level)]


class QcodesProgram(Storage):
    """QCoDeS' data set in a process of its own, which may have another environment."""

    name, guarantees = "QCoDeS", "a transaction a value"

    def __init__(self, folder: Path, content: Content, program: Program) -> None:
        super().__init__(folder, content)
        self._program = program

    def seconds(self, what: str) -> float:
        if what == "store":
            self._program.ask(what="empty", of=[])
        return self._program.seconds(what=what, of=self.content.request(what))

    def sums(self, what: str) -> list[list[float]]:
        return list(self._program.ask(what=what, of=self.content.request(what))["sums"])


PEERS: tuple[type[Storage], ...] = (Hdf5, PlainSqlite, Parquet)


def measure_querying(
    folder: Path, recordings: int = 24, stores: int = 3, reads: int = 15
) -> Iterator[Figure]:
    """Every question of every way. Raises `ValueError` where a way gives back other numbers than
    were stored."""
    with tempfile.TemporaryDirectory(dir=folder) as name, ExitStack() as stack:
        place = Path(name)
        content = Content.of(
            write_campaign(place / "campaign", recordings, ".npz", np.random.default_rng(5))
        )
        ours = stack.enter_context(closing(OurStore(place / "ours", content)))
        storages: dict[str, Storage] = {OURS: ours, RAW: RawBytes(place / "raw", content)}
        storages |= {kind.name: kind(place / kind.name, content) for kind in PEERS}
        if python := interpreter_with("qcodes"):
            words = ("qcodes", content.write(place / "content"), place / QcodesProgram.name, FACTOR)
            program = stack.enter_context(
                Program("-m", "benchmarks.peer_programs", *words, python=python)
            )
            storages[QcodesProgram.name] = QcodesProgram(
                place / QcodesProgram.name, content, program
            )
        yield from _querying_figures(storages, content, stores, reads)


def _querying_figures(
    storages: Mapping[str, Storage], content: Content, stores: int, reads: int
) -> Iterator[Figure]:
    theme, names = (
        QUERYING.format(len(content.recordings)),
        [*(kind.name for kind in PEERS), QcodesProgram.name],
    )
    for what, (row, question) in QUESTIONS.items():
        for storage in storages.values():
            storage.seconds(what)
        if what != "store":
            check_answers(what, storages, content)
        questions = {name: partial(storage.seconds, what) for name, storage in storages.items()}
        seconds = take_turns(
            questions, stores if what == "store" else reads, reported=[*questions], warm=False
        )
        for name in names:
            bound = "the same bytes in plain files"
            if what == "store" and name in storages:
                bound = (
                    f"ours keeps {storages[OURS].guarantees}; {name} keeps "
                    f"{storages[name].guarantees}; {bound}"
                )
            yield beside(
                theme, f"{row}, beside {name}", seconds, name, limit=1.0, binding=False,
                bound=bound,
                question=question,
            )  # fmt: skip
    for name in [name for name in names if name in storages]:
        rooms = {key: [float(storages[key].room())] for key in (OURS, name)}
        yield beside(
            theme, f"room on disk, beside {name}", rooms, name, unit="MB", limit=1.0, binding=False,
            kind="room",
            bound=f"in memory {content.bytes / 1e6:.3g} MB; noise does not pack",
            question="room on disk",
        )  # fmt: skip


def check_answers(what: str, storages: Mapping[str, Storage], content: Content) -> None:
    """Raises `ValueError` where a way does not give back what was stored; the limit gives the
    pulses in one piece."""
    force, (_, *window) = content.recordings[RUN - 1].series[CHANNEL], content.request("window")
    stored: dict[str, list[Any]] = {"whole": [force], "window": [force[slice(*window)]]}
    expected = _sums(stored.get(what) or content.pulses(LEVEL))
    for name, storage in storages.items():
        sums = storage.sums(what)
        alike = (
            sums == expected
            if name != RAW
            else np.allclose(np.sum(sums, axis=0), np.sum(expected, axis=0))
        )
        if not alike:
            raise ValueError(f"{name}, {what}: gave back other numbers than were stored")


def _sums(arrays: list[Any]) -> list[list[float]]:
    return [[len(x), float(np.sum(x, dtype=np.float64))] for x in arrays]
