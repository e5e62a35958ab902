"""The ingest of a campaign against only reading its files and writing the series with h5py; and its memory."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pyroshock.schema.series import encode_series

from .figures import Figure
from .measuring import Child, Spread, interleaved, ratio, run_child
from .recordings import hammer_record, write_campaign

RECORDINGS, LIMIT = 180, 1.5
THEME = "Ingest of 180 recordings (10 s, two channels at 51.2 kHz, ten impacts each), extraction included"
MEMORY_THEME = "Peak memory of the ingest, all its processes together"
_COMMAND = ("-c", "from pyroshock.app.cli.main import main; main()")
_FORMATS = {".mat": "MATLAB 5, uncompressed", ".npz": "NumPy .npz"}


def campaign(folder: Path, recordings: int, suffix: str) -> Path:
    """A campaign in `folder`, made where it is not there yet."""
    made = folder / f"campaign-{recordings}{suffix}"
    if not (made / "complete").exists():
        shutil.rmtree(made, ignore_errors=True)
        write_campaign(made, recordings, suffix, np.random.default_rng(7))
        (made / "complete").touch()
    return made


def measure_ingest(folder: Path, repeats: int = 3) -> Iterator[Figure]:
    """Time of the command, by its default of processes and by one, over the peer's."""
    for suffix, what in _FORMATS.items():
        source = campaign(folder, RECORDINGS, suffix)
        runs: dict[str, list[Child]] = {"peer": [], "default": [], "one": []}
        for _ in range(repeats):
            runs["peer"].append(_peer(source, folder))
            runs["default"].append(ingest_once(source, folder))
            runs["one"].append(ingest_once(source, folder, jobs=1))
        floor = _floor_s() * RECORDINGS
        yield _time_figure(what, runs["default"], runs["peer"], LIMIT, _nature(runs["default"], floor))
        yield _time_figure(f"{what}, --jobs 1", runs["one"], runs["peer"], None, _nature(runs["one"], floor))


def ingest_once(source: Path, folder: Path, *, jobs: int | None = None, watch_memory: bool = False) -> Child:
    """The command in a fresh process, into a new SQLite store."""
    for old in folder.glob("ingested.db*"):
        old.unlink()
    options = [] if jobs is None else ["--jobs", str(jobs)]
    command = [*_COMMAND, "ingest", source, "--db", f"sqlite:///{folder / 'ingested.db'}"]
    return run_child([*command, *options], watch_memory=watch_memory)


def _peer(source: Path, folder: Path) -> Child:
    return run_child(["-m", "benchmarks.peer", source, folder / "peer.h5"])


def _time_figure(name: str, ours: list[Child], peer: list[Child], limit: float | None, nature: str) -> Figure:
    walls, peers = [run.wall_s for run in ours], [run.wall_s for run in peer]
    texts = [Spread.of(values).text(" s") for values in (walls, peers)]
    return Figure(THEME, name, *texts, ratio(walls, peers), "at most", limit, nature)


def _nature(runs: list[Child], floor_s: float) -> str:
    times = Spread.of([run.wall_s for run in runs]).median / floor_s
    return f"hashing and compressing the same bytes: {floor_s:.3g} s of one processor; we are at {times:.2g} times that"


def _floor_s() -> float:
    """Seconds per recording for what no ingest can leave out: two hashes (file, series) and the compression."""
    channels = hammer_record(np.random.default_rng(7))
    content = b"".join(channel.tobytes() for channel in channels)

    def work() -> None:
        hashlib.sha256(content)
        for channel in channels:
            encode_series(channel)

    return Spread.of(interleaved({"floor": work}, 15)["floor"]).median


def measure_memory(folder: Path, repeats: int = 3) -> Iterator[Figure]:
    """Peak memory of larger and larger campaigns over that of the smallest, which is long enough for all to be busy."""
    for jobs in (1, 2):
        sizes = (RECORDINGS // 4, RECORDINGS // 2, RECORDINGS)
        peaks = {count: [_peak(folder, count, jobs) for _ in range(repeats)] for count in sizes}
        for count in sizes[1:]:
            texts = [Spread.of(peaks[size]).text(" MiB", 2.0**-20) for size in (count, sizes[0])]
            name = f"{count} recordings against {sizes[0]}, --jobs {jobs}"
            nature = f"recordings in flight ({2 * jobs if jobs > 1 else 1} at most, 4 MiB each), and the libraries"
            yield Figure(MEMORY_THEME, name, *texts, ratio(peaks[count], peaks[sizes[0]]), "at most", 1.1, nature)


def _peak(folder: Path, recordings: int, jobs: int) -> int:
    return ingest_once(campaign(folder, recordings, ".mat"), folder, jobs=jobs, watch_memory=True).peak_bytes
