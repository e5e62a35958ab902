"""Ways of keeping a campaign's series and pulses, each as its user would write it, and what each of them guarantees."""

from __future__ import annotations

import sqlite3
from abc import ABC, abstractmethod
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .stored_content import FACTOR, Content, Recorded

Floats = NDArray[np.float64]
CHANNEL = "force"


class Keeping(ABC):
    """A way of keeping a campaign in `folder`, which is its own. Reading opens what it needs, and closes it again."""

    name: str
    guarantees: str

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder

    def empty(self) -> None:
        """Nothing kept; not timed."""
        for old in self.folder.iterdir():
            old.unlink()

    @abstractmethod
    def store(self, content: Content) -> None:
        """All of it, recording by recording."""

    @abstractmethod
    def whole(self, run: int) -> NDArray[np.float32]:
        """The force of a run's recording."""

    @abstractmethod
    def window(self, run: int, start: int, stop: int) -> NDArray[np.float32]:
        """Samples `start` to `stop` of it."""

    @abstractmethod
    def pulses(self, level: str) -> list[Floats]:
        """Of all impacts with this level of `FACTOR`."""

    def room(self) -> int:
        return sum(file.stat().st_size for file in self.folder.iterdir())


class Hdf5(Keeping):
    """A group for each recording, its datasets packed, factors as attributes."""

    name, guarantees = "h5py", "a file that a kill may spoil, no hashes"

    @property
    def _file(self) -> Path:
        return self.folder / "campaign.h5"

    def store(self, content: Content) -> None:
        import h5py

        with h5py.File(self._file, "w") as file:
            for one in content.recorded:
                group = file.create_group(str(one.run))
                group.attrs.update({"rate_hz": one.rate_hz, "path": one.path, **one.factors})
                for name, samples in one.series.items():
                    group.create_dataset(name, data=samples, compression="gzip", shuffle=True)
                for hit, force in zip(one.impacts, one.pulses, strict=True):
                    pulse = group.create_dataset(f"impacts/{hit.repetition}", data=force)
                    pulse.attrs.update(vars(hit))

    def whole(self, run: int) -> NDArray[np.float32]:
        import h5py

        with h5py.File(self._file) as file:
            return np.asarray(file[f"{run}/{CHANNEL}"][:])

    def window(self, run: int, start: int, stop: int) -> NDArray[np.float32]:
        import h5py

        with h5py.File(self._file) as file:
            return np.asarray(file[f"{run}/{CHANNEL}"][start:stop])

    def pulses(self, level: str) -> list[Floats]:
        import h5py

        with h5py.File(self._file) as file:
            found = sorted((group for group in file.values() if group.attrs[FACTOR] == level), key=_number)
            return [np.asarray(pulse[:]) for group in found for pulse in sorted(group["impacts"].values(), key=_number)]


def _number(item: Any) -> int:
    """Of the last part of a name in an HDF5 file, where "10" stands before "2"."""
    return int(item.name.rpartition("/")[2])


class PlainSqlite(Keeping):
    """Three tables and the module of the standard library; a series is its bytes, a window of it a part of the blob."""

    name, guarantees = "sqlite3", "a transaction a recording, with the same settings as ours; no hashes"

    @property
    def _file(self) -> Path:
        return self.folder / "campaign.db"

    def _open(self) -> closing[sqlite3.Connection]:
        connection = sqlite3.connect(self._file)
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = NORMAL")
        return closing(connection)

    def store(self, content: Content) -> None:
        factors = list(content.recorded[0].factors)
        with self._open() as db:
            db.execute(f"CREATE TABLE recordings (run INTEGER PRIMARY KEY, path, rate_hz, {', '.join(factors)})")
            db.execute("CREATE TABLE series (run, channel, samples BLOB, PRIMARY KEY (run, channel))")
            db.execute(
                "CREATE TABLE impacts (run, repetition, velocity_m_s, start_s, contact_time_s, peak_force_n, "
                "impulse_n_s, force BLOB, PRIMARY KEY (run, repetition))"
            )
            for one in content.recorded:
                self._add(db, one)
                db.commit()

    def _add(self, db: sqlite3.Connection, one: Recorded) -> None:
        row = (one.run, one.path, one.rate_hz, *one.factors.values())
        db.execute(f"INSERT INTO recordings VALUES ({', '.join('?' * len(row))})", row)  # noqa: S608 - question marks
        db.executemany(
            "INSERT INTO series VALUES (?, ?, ?)", [(one.run, k, x.tobytes()) for k, x in one.series.items()]
        )
        hits = [
            (one.run, *vars(hit).values(), force.tobytes()) for hit, force in zip(one.impacts, one.pulses, strict=True)
        ]
        db.executemany("INSERT INTO impacts VALUES (?, ?, ?, ?, ?, ?, ?, ?)", hits)

    def whole(self, run: int) -> NDArray[np.float32]:
        with self._open() as db:
            query = "SELECT samples FROM series WHERE run = ? AND channel = ?"
            return np.frombuffer(db.execute(query, (run, CHANNEL)).fetchone()[0], np.float32)

    def window(self, run: int, start: int, stop: int) -> NDArray[np.float32]:
        with self._open() as db:
            query = "SELECT rowid FROM series WHERE run = ? AND channel = ?"
            (row,) = db.execute(query, (run, CHANNEL)).fetchone()
            with db.blobopen("series", "samples", row, readonly=True) as blob:
                blob.seek(4 * start)
                return np.frombuffer(blob.read(4 * (stop - start)), np.float32)

    def pulses(self, level: str) -> list[Floats]:
        where = f"WHERE {FACTOR} = ? ORDER BY run, repetition"
        query = f"SELECT force FROM impacts JOIN recordings USING (run) {where}"  # noqa: S608 - the factor is our own
        with self._open() as db:
            return [np.frombuffer(force) for (force,) in db.execute(query, (level,))]


class Parquet(Keeping):
    """A table for each recording, and one for all impacts, by pandas as it comes."""

    name, guarantees = "pandas", "files, each of which a kill may spoil; no hashes"

    def store(self, content: Content) -> None:
        import pandas as pd

        rows = []
        for one in content.recorded:
            pd.DataFrame(one.series).to_parquet(self._series(one.run))
            for hit, force in zip(one.impacts, one.pulses, strict=True):
                rows.append({"run": one.run, **one.factors, "rate_hz": one.rate_hz, **vars(hit), "force_n": force})
        pd.DataFrame(rows).to_parquet(self._impacts)

    @property
    def _impacts(self) -> Path:
        return self.folder / "impacts.parquet"

    def _series(self, run: int) -> Path:
        return self.folder / f"{run}.parquet"

    def whole(self, run: int) -> NDArray[np.float32]:
        import pandas as pd

        return np.asarray(pd.read_parquet(self._series(run), columns=[CHANNEL])[CHANNEL].to_numpy())

    def window(self, run: int, start: int, stop: int) -> NDArray[np.float32]:
        return self.whole(run)[start:stop]

    def pulses(self, level: str) -> list[Floats]:
        import pandas as pd

        found = pd.read_parquet(self._impacts, columns=["force_n"], filters=[(FACTOR, "==", level)])
        return list(found["force_n"])


class Raw(Keeping):
    """The limit: the same bytes in files, and nothing else."""

    name, guarantees = "bytes in files", "nothing"

    def store(self, content: Content) -> None:
        for one in content.recorded:
            for name, samples in one.series.items():
                samples.tofile(self.folder / f"{one.run}.{name}")
        for level in {str(one.factors[FACTOR]) for one in content.recorded}:
            np.concatenate(content.pulses(level)).tofile(self.folder / level)

    def whole(self, run: int) -> NDArray[np.float32]:
        return np.fromfile(self.folder / f"{run}.{CHANNEL}", np.float32)

    def window(self, run: int, start: int, stop: int) -> NDArray[np.float32]:
        return np.fromfile(self.folder / f"{run}.{CHANNEL}", np.float32, stop - start, offset=4 * start)

    def pulses(self, level: str) -> list[Floats]:
        return [np.fromfile(self.folder / level)]
